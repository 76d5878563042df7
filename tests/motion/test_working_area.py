"""The working area, computed from the robot's description: where an object can be grasped, lifted and put.

Limits less 1 degree, forearm and hand clear of table and body, approach and lift included (design, part 4).
"""

from __future__ import annotations

import sys

import numpy as np
import pytest

from paramove.motion.clear_plans import ClearPlans
from paramove.motion.gripper_arm import GripperArm
from paramove.motion.plans import NoPlanError, PlannedMotion
from sim.places import STRIP_X, STRIP_Y
from tests.motion.reaching import CORNERS, GRASP_Z, HOAP3, JOINTS, OPENINGS, at, checker, planner

NOTHING = np.empty((0, 2))
STEP = 0.03
X = np.arange(0.105, 0.226, STEP)
Y = np.arange(-0.15, 0.121, STEP)
STRIP = [(x, y) for x in STRIP_X for y in (STRIP_Y[0], -0.045, 0.01, STRIP_Y[1])]


def plans() -> ClearPlans:
    return ClearPlans(GripperArm.of(HOAP3, "right"), planner(), checker())


def fetched(place: tuple[float, float]) -> PlannedMotion | None:
    try:
        return plans().fetch(at(place), NOTHING)
    except NoPlanError:
        return None


def can_be_fetched_and_put(place: tuple[float, float]) -> bool:
    """From the place and back to it: approach, grasp, lift, place and retreat are possible and clear."""
    motion = fetched(place)
    if motion is None:
        return False
    try:
        plans().deliver(motion.end, at(place), NOTHING)
    except NoPlanError:
        return False
    return True


@pytest.mark.long
def test_working_area_is_about_twenty_by_seven_centimetres(capsys: pytest.CaptureFixture[str]) -> None:
    usable = np.array([[can_be_fetched_and_put((x, y)) for y in Y] for x in X])
    shown = [
        f"working area at grasp height {GRASP_Z * 100:.1f} cm, seen from above, far is up, the robot's left is left"
    ]
    for x, row in zip(X[::-1], usable[::-1], strict=True):
        shown.append(f"  x {x * 100:5.1f} cm  {''.join(' #' if good else ' .' for good in row[::-1])}")
    shown.append(f"  y from {Y[-1] * 100:.0f} to {Y[0] * 100:.0f} cm; {usable.sum() * STEP**2 * 1e4:.0f} cm² usable")
    with capsys.disabled():
        sys.stdout.write("\n" + "\n".join(shown) + "\n")
    inside = (X[:, None] > 0.13) & (X[:, None] < 0.19) & (Y > -0.105) & (Y < 0.07)
    assert usable[inside].all()
    assert usable.sum() * STEP**2 > 0.20 * 0.06
    assert not usable.all(), "the search reaches beyond the area"


@pytest.mark.parametrize("place", [*CORNERS, *STRIP])
def test_corners_and_strip_lie_inside(place: tuple[float, float]) -> None:
    assert can_be_fetched_and_put(place)


@pytest.mark.parametrize("opening", OPENINGS)
def test_openings_lie_inside(opening: tuple[float, float]) -> None:
    """What was lifted at the ends of the strip can be brought to each opening."""
    for place in (STRIP[0], STRIP[-1]):
        motion = fetched(place)
        assert motion is not None
        plans().deliver(motion.end, at(opening), NOTHING)


def test_planned_angles_keep_a_degree_from_the_limits() -> None:
    fingers = JOINTS[-1]
    for place in STRIP[::3]:
        motion = fetched(place)
        assert motion is not None
        for column, joint in enumerate(JOINTS):
            if joint == fingers or HOAP3.motors[joint] == "wrist":
                continue
            assert motion.angles[:, column].min() > HOAP3.lower[joint] + np.deg2rad(1.0)
            assert motion.angles[:, column].max() < HOAP3.upper[joint] - np.deg2rad(1.0)
