"""An object is fetched and held where the goal says, and put down by a later goal."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from paramove.motion.clear_plans import MIN_CLEARANCE, ClearPlans
from paramove.motion.gripper_arm import GripperArm
from paramove.motion.plans import RestPose
from paramove.msgs.relocation_pb2 import RelocationGoal
from paramove.safety.trajectory_check import check_trajectory
from tests.applications.launched import relocator
from tests.motion.fake_driver import FAILED, OFFER, PLACE, REJECTED, SUCCEEDED, Cell, FakeDriver, goal
from tests.motion.reaching import ARM, HOAP3, JOINTS, OPENINGS, at, checker, planner

HOLD = (0.13, -0.12, -0.045)
FETCH, PLACE_HELD = RelocationGoal.KIND_FETCH, RelocationGoal.KIND_PLACE_HELD


def fetch(name: str = "fetch", **more) -> RelocationGoal:
    return goal(FETCH, name, **{"source": PLACE, "target": HOLD, **more})


def gripper(cell: Cell) -> np.ndarray:
    return ARM.kinematics.forward(cell.driver.angles[:5]).gripper


def test_holds_the_object_there_and_puts_it_down_when_asked() -> None:
    cell = Cell()
    last = cell.do(fetch())
    assert (last.state, last.holding, cell.driver.held) == (SUCCEEDED, True, True), last.reason
    np.testing.assert_allclose(gripper(cell), HOLD, rtol=0, atol=5e-4)
    assert not cell.driver.at_base
    put = cell.do(goal(PLACE_HELD, "put", target=OPENINGS[1]))
    assert (put.state, cell.driver.held, cell.driver.at_base) == (SUCCEEDED, False, True), put.reason


def test_feeling_nothing_fails_and_brings_the_arm_home() -> None:
    cell = Cell(FakeDriver(graspable=False))
    last = cell.do(fetch())
    assert last.state == FAILED
    assert "felt nothing in the hand" in last.reason
    assert cell.driver.at_base


def test_an_object_that_slips_on_the_way_is_noticed() -> None:
    cell = Cell(FakeDriver(slips_at="carry"))
    last = cell.do(fetch())
    assert last.state == FAILED
    assert "slipped out of the hand" in last.reason


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"target": (0.30, 0.0, -0.03)}, "the arm reaches"),
        ({"target": (0.15, 0.0, -0.16)}, "would come within"),
        ({"source": (0.30, 0.0)}, "the arm reaches"),
    ],
)
def test_where_it_cannot_be_held_is_refused_before_the_arm_moves(more: dict, words: str) -> None:
    cell = Cell()
    last = cell.do(fetch(**more))
    assert last.state == REJECTED
    assert words in last.reason
    assert cell.driver.heard == []


def test_only_from_the_base_pose() -> None:
    cell = Cell()
    assert cell.do(goal(RelocationGoal.KIND_OFFER_HAND, "offer", source=OFFER)).state == SUCCEEDED
    assert "send a goal of kind REST first" in cell.do(fetch()).reason


def test_a_held_object_goes_over_what_stands_in_the_way() -> None:
    """Straight it would touch the standing object with the hand; over it, it keeps the distance of all plans."""
    start, place, standing = np.array([0.165, 0.0, -0.05]), np.array([0.15, -0.10, -0.085]), np.array([[0.18, -0.05]])
    check = checker()
    straight = planner().hold(start, place)
    over = ClearPlans(GripperArm.of(HOAP3, "right"), planner(), check).hold(
        RestPose(np.empty(6), start), place, standing
    )
    near, far = (check.smallest(one.angles, standing, one.holding, every=6).distance for one in (straight, over))
    assert near < 0.0 < MIN_CLEARANCE <= far
    np.testing.assert_allclose(over.gripper[-1], place, rtol=0, atol=1e-6)
    assert over.holding.all()


@pytest.mark.parametrize("place", [*itertools.product((0.13, 0.186), (-0.10, -0.02, 0.065))])
def test_the_gate_lets_the_way_to_where_the_relocator_holds_it_pass(place: tuple[float, float]) -> None:
    """As the driver samples it, every millisecond, from places all over the working area."""
    plans = ClearPlans(GripperArm.of(HOAP3, "right"), planner(), checker())
    lifted = plans.fetch(at(place), np.empty((0, 2))).end
    motion = plans.hold(lifted, np.array(relocator().hold), np.empty((0, 2)))
    pose = HOAP3.base_pose.copy()
    pose[JOINTS] = motion.angles[0]
    names, limits = [*ARM.joints, ARM.fingers], HOAP3.motion_limits
    tolerance = np.deg2rad(HOAP3.stream.start_tolerance_deg)
    checked = check_trajectory(names, motion.times, motion.angles.tolist(), pose, limits, tolerance)
    np.testing.assert_allclose(checked.rows[-1, JOINTS], motion.angles[-1], rtol=0, atol=1e-12)
