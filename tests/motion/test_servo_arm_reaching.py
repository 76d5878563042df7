"""Learned reaching on both servo arms: exact, within the limits, clear of the table, and with the person's shape."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from paramove.motion.clearance import ClearanceChecker
from paramove.motion.plans import MAX_STANDING, Grasp, NoPlanError, PlannedMotion, RestPose
from paramove.motion.servo_arm_reaching import FINGER_GAP_M, ServoArmReaching
from paramove.robots import WorkingSurface
from paramove.robots.description import DescriptionError, RobotDescription
from paramove.robots.planar_arm import OutOfReachError
from paramove.safety.trajectory_check import check_trajectory
from tests.motion.reaching import HOAP3, reaching_model
from tests.motion.servo_reaching import GRASP_Z, description, pick_and_place, places, reaching
from tests.robots.servo_arms import ARMS, ArmModel

NAMES = [robot.name for robot in ARMS]
each_arm = pytest.mark.parametrize("name", NAMES)


class Oracle:
    """MuJoCo's own kinematics and collisions of an arm at its table."""

    def __init__(self, name: str) -> None:
        self.robot = description(name)
        self.scene = ArmModel(self.robot, "scene.xml")
        assert self.robot.chain is not None
        self.chain = self.robot.chain

    def whole(self, row: np.ndarray) -> np.ndarray:
        angles = self.robot.base_pose.copy()
        angles[[*self.chain.indices, self.chain.gripper_index]] = row
        return angles

    def hand(self, row: np.ndarray) -> np.ndarray:
        self.scene.place(self.whole(row))
        return self.scene.data.site(self.chain.sites.end_effector).xpos.copy()

    def object_in(self, row: np.ndarray, gap: float) -> np.ndarray:
        """Where an object of 20 mm is that is so far from the face of a finger that does not move."""
        hand, face = self.hand(row), self.chain.fixed_finger
        if face is None:
            return hand
        left = self.scene.data.site(self.chain.sites.end_effector).xmat.reshape(3, 3)[:, 1]
        return hand + (face - np.sign(face) * (0.010 + gap)) * left

    def touches_table(self, row: np.ndarray) -> bool:
        self.scene.place(self.whole(row))
        model, data = self.scene.model, self.scene.data
        table = model.geom("table").id
        pairs = [set(contact.geom.tolist()) for contact in data.contact[: data.ncon]]
        others = [(pair - {table}).pop() for pair in pairs if table in pair]
        names = [model.body(model.geom_bodyid[geom]).name for geom in others]
        return any(name.split("_")[-1] not in ("cube", "cylinder") for name in names)


def has_a_pose(plan: ServoArmReaching, target: np.ndarray) -> bool:
    try:
        plan._poses.pitch_at(target, 0.0, (np.deg2rad(-90), np.deg2rad(120)))
    except OutOfReachError:
        return False
    return True


def assert_playable(name: str, motion: PlannedMotion, start: np.ndarray | None = None) -> None:
    """The driver's own check takes it, and the jerk is within the description's."""
    plan, robot = reaching(name), description(name)
    commanded = Oracle(name).whole(plan.base_angles if start is None else start)
    limits = robot.motion_limits
    checked = check_trajectory(plan.arm.joints, motion.times, motion.angles, commanded, limits, np.deg2rad(0.01))
    np.testing.assert_allclose(checked.duration_s, motion.times[-1], rtol=0, atol=0.011)
    jerk = np.abs(np.diff(motion.angles, 3, axis=0)).max(axis=0) / 0.01**3
    assert (jerk <= robot.jerk).all()


@each_arm
def test_reaches_what_is_in_reach_exactly_within_limits_and_clear_of_the_table(name: str) -> None:
    plan, oracle = reaching(name), Oracle(name)
    targets = [one for one in places(name, 25, (0.015, 0.2), seed=1) if has_a_pose(plan, one)]
    assert len(targets) >= 22
    for target in targets:
        motion = plan.reach(target)
        assert np.linalg.norm(oracle.hand(motion.angles[-1]) - target) < 1e-6
        np.testing.assert_allclose(motion.angles[0], plan.base_angles, rtol=0, atol=1e-12)
        assert_playable(name, motion)
        assert not any(oracle.touches_table(row) for row in motion.angles[::4])


@each_arm
def test_picks_and_places_within_limits_and_clear_of_the_table(name: str) -> None:
    plan, oracle = reaching(name), Oracle(name)
    ends = places(name, 8, (GRASP_Z, GRASP_Z), seed=2, farthest=0.75)
    for source, place in zip(ends[::2], ends[1::2], strict=True):
        motion = pick_and_place(name, source, place)
        assert_playable(name, motion)
        assert not any(oracle.touches_table(row) for row in motion.angles[::4])
        at = {phase: motion.angles[round(start / 0.01)] for phase, start in motion.phases}
        assert list(at) == [
            "approach", "lower", "grasp", "lift", "carry", "place", "release", "withdraw", "retreat"
        ]  # fmt: skip
        for phase, point, gap in (
            ("grasp", source, FINGER_GAP_M),
            ("lift", source, FINGER_GAP_M),
            ("release", place, 0),
        ):
            assert np.linalg.norm(oracle.object_in(at[phase], gap) - point) < 2e-4
        np.testing.assert_allclose(motion.angles[-1], plan.base_angles, rtol=0, atol=1e-12)


@each_arm
def test_the_gripper_is_open_over_the_object_and_closed_while_it_holds_it(name: str) -> None:
    chain = description(name).chain
    assert chain is not None
    motion = pick_and_place(name, (0.15, -0.05, GRASP_Z), (0.14, 0.08, GRASP_Z))
    opening = (motion.angles[:, -1] - chain.gripper_closed) / (chain.gripper_open - chain.gripper_closed)
    starts = {phase: round(start / 0.01) for phase, start in motion.phases}
    np.testing.assert_allclose(opening[starts["lower"] : starts["grasp"]], 0.6, rtol=0, atol=1e-9)
    np.testing.assert_allclose(opening[starts["lift"] : starts["release"]], 0.0, rtol=0, atol=1e-9)
    held = np.flatnonzero(motion.holding)
    assert starts["grasp"] < held[0] <= starts["grasp"] + 1
    assert abs(held[-1] - starts["release"]) <= 1
    assert np.diff(held).max() == 1


@each_arm
def test_the_hand_points_down_where_it_grasps_if_it_can(name: str) -> None:
    motion = pick_and_place(name, (0.15, 0.0, GRASP_Z), (0.12, 0.10, GRASP_Z))
    pitch = np.rad2deg(description(name).chain.kinematics.forward(motion.angles[:, :-1]).pitch)
    starts = {phase: round(start / 0.01) for phase, start in motion.phases}
    np.testing.assert_allclose(pitch[[starts["grasp"], starts["release"]]], 90.0, rtol=0, atol=1e-6)


def test_an_object_is_put_down_with_the_pitch_with_which_it_was_grasped() -> None:
    """Or else it would stand askew: it is upright in the hand that grasps it. The Koch reaches far only with less."""
    near, far = (0.15, 0.0, GRASP_Z), (0.21, 0.05, GRASP_Z)
    plan, kinematics = reaching("koch_v1_1"), description("koch_v1_1").chain.kinematics
    for target in (far, None):
        fetch = plan.fetch(near, grasp=Grasp(None if target is None else np.array(target)))
        deliver = plan.deliver(plan.hold(fetch.end, (0.13, -0.11, 0.10)).end, far)
        pitches = []
        for motion, phase in ((fetch, "grasp"), (deliver, "release")):
            start = dict(motion.phases)[phase]
            pitches.append(float(kinematics.forward(motion.angles[round(start / 0.01)][:-1]).pitch))
        assert pitches[0] < np.deg2rad(85)
        np.testing.assert_allclose(pitches[1], pitches[0], rtol=0, atol=1e-6)


@each_arm
def test_a_second_attempt_grasps_in_another_way(name: str) -> None:
    plan, kinematics = reaching(name), description(name).chain.kinematics
    pitches, openings = [], []
    for attempt in (1, 2, 3):
        motion = plan.fetch((0.15, 0.0, GRASP_Z), grasp=Grasp(np.array((0.15, 0.05, GRASP_Z)), attempt))
        at = motion.angles[round(dict(motion.phases)["grasp"] / 0.01)]
        pitches.append(float(np.rad2deg(kinematics.forward(at[:-1]).pitch)))
        openings.append(plan.arm.opening_of(float(at[-1])))
        assert_playable(name, motion)
    np.testing.assert_allclose(pitches, [90, 75, 90], rtol=0, atol=1e-6)
    np.testing.assert_allclose(openings, [0.6, 0.8, 0.6], rtol=0, atol=1e-6)


@each_arm
def test_an_object_of_another_width_is_grasped_at_its_middle_or_rejected(name: str) -> None:
    plan, oracle = reaching(name), Oracle(name)
    narrowest, widest = oracle.chain.object_width
    source, face = np.array((0.15, -0.05, GRASP_Z)), oracle.chain.fixed_finger
    for width in (narrowest, widest):
        motion = plan.fetch(source, grasp=Grasp(width=width))
        aside = oracle.object_in(motion.angles[round(dict(motion.phases)["grasp"] / 0.01)], FINGER_GAP_M) - source
        expected = 0.0 if face is None else abs(width / 2 - 0.010)
        np.testing.assert_allclose(np.linalg.norm(aside), expected, rtol=0, atol=2e-4)
    for width in (narrowest - 0.006, widest + 0.006):
        with pytest.raises(NoPlanError, match=f"{1000 * width:.0f} mm wide"):
            plan.fetch(source, grasp=Grasp(width=width))


@each_arm
@pytest.mark.parametrize(
    ("height", "attempt", "expected"),
    [(0.050, 1, 0.036), (0.065, 1, 0.036), (0.035, 1, 0.0252), (0.020, 1, 0.020), (None, 1, 0.036), (None, 2, 0.020)],
)
def test_a_low_object_is_grasped_low_and_put_down_as_low(
    name: str, height: float | None, attempt: int, expected: float
) -> None:
    plan, near, far = reaching(name), np.array((0.15, 0.0, 0.036)), np.array((0.15, 0.06, 0.036))
    fetch = plan.fetch(near, grasp=Grasp(far, attempt, height=height))
    for motion, phase in (
        (fetch, "grasp"),
        (plan.deliver(fetch.end, far), "release"),
        (plan.home(fetch.end, holding=True), "release"),
    ):
        at = motion.gripper[round(dict(motion.phases)[phase] / 0.01)]
        np.testing.assert_allclose(at[2], expected, rtol=0, atol=1e-4)


@pytest.mark.parametrize("turn_deg", [-40.0, 10.0, 35.0, 130.0])
@pytest.mark.parametrize("place", [(0.15, 0.0), (0.16, 0.06), (0.14, -0.08)])
def test_a_hand_with_roll_is_turned_along_the_sides_of_a_block(turn_deg: float, place: tuple[float, float]) -> None:
    plan, oracle, source = reaching("koch_v1_1"), Oracle("koch_v1_1"), np.array((*place, 0.036))
    far = np.array((0.15, -0.03, 0.036))
    fetch = plan.fetch(source, grasp=Grasp(far, width=0.020, turn=np.deg2rad(turn_deg)))
    row = fetch.angles[round(dict(fetch.phases)["grasp"] / 0.01)]
    np.testing.assert_allclose(oracle.object_in(row, FINGER_GAP_M), source, rtol=0, atol=2e-4)
    side = oracle.scene.data.site(oracle.chain.sites.end_effector).xmat.reshape(3, 3)[:, 1]
    off_deg = np.rad2deg(np.arctan2(side[1], side[0])) - turn_deg
    assert abs(np.remainder(off_deg + 45, 90) - 45) < 3.0, "the hand does not point straight down"
    assert_playable("koch_v1_1", fetch)
    deliver = plan.deliver(fetch.end, far)
    assert_playable("koch_v1_1", deliver, fetch.angles[-1])
    row = deliver.angles[round(dict(deliver.phases)["release"] / 0.01)]
    np.testing.assert_allclose(oracle.object_in(row, 0.0), far, rtol=0, atol=2e-4)


@pytest.mark.parametrize("turn_deg", [-85.0, -30.0, 20.0, 80.0])
def test_a_hand_with_roll_closes_across_what_lies(turn_deg: float) -> None:
    plan, oracle, source = reaching("koch_v1_1"), Oracle("koch_v1_1"), np.array((0.15, 0.05, 0.036))
    fetch = plan.fetch(source, grasp=Grasp(None, 1, 0.020, 0.020, np.deg2rad(turn_deg), 0.030))
    oracle.object_in(fetch.angles[round(dict(fetch.phases)["grasp"] / 0.01)], FINGER_GAP_M)
    side = oracle.scene.data.site(oracle.chain.sites.end_effector).xmat.reshape(3, 3)[:, 1]
    off_deg = np.rad2deg(np.arctan2(side[1], side[0])) - turn_deg
    assert abs(np.remainder(off_deg, 180) - 90) < 3.0
    assert_playable("koch_v1_1", fetch)


def test_an_arm_without_roll_takes_a_block_that_fits_between_its_fingers_as_it_stands() -> None:
    plan, source = reaching("open_manipulator_x"), np.array((0.15, 0.0, 0.036))
    for width, turn_deg in ((0.030, 45.0), (0.045, 0.0)):
        plan.fetch(source, grasp=Grasp(width=width, turn=np.deg2rad(turn_deg)))
    with pytest.raises(NoPlanError, match="64 mm wide"):
        plan.fetch(source, grasp=Grasp(width=0.045, turn=np.deg2rad(45.0)))
    with pytest.raises(NoPlanError, match="60 mm wide"):
        plan.fetch(source, grasp=Grasp(width=0.030, turn=np.deg2rad(90.0), length=0.060))


STRETCHED = {
    "open_manipulator_x.xml": {
        'name="joint3" axis="0 1 0" range="-1.499': 'name="joint3" axis="0 1 0" range="-2.27',
        'name="joint4" axis="0 1 0" range="-1.699950691 1.968': 'name="joint4" axis="0 1 0" range="-2.0 2.2',
    },
    "robot.yaml": {
        "servo_id: 13, motor: xm430_w350, lower_deg: -85.9": "servo_id: 13, motor: xm430_w350, lower_deg: -130",
        "lower_deg: -97.4, upper_deg: 112.8": "lower_deg: -114, upper_deg: 126",
    },
}


def test_an_elbow_that_can_pass_the_stretched_arm_stays_on_its_side(tmp_path: Path) -> None:
    """Otherwise a far position would be reached with the elbow below, and no path leads there."""
    folder = tmp_path / "open_manipulator_x"
    shutil.copytree(description("open_manipulator_x").model_path.parent, folder)
    for name, changes in STRETCHED.items():
        text = (folder / name).read_text(encoding="utf-8")
        for old, new in changes.items():
            assert old in text
            text = text.replace(old, new)
        (folder / name).write_text(text, encoding="utf-8")
    plan, target = ServoArmReaching(RobotDescription.load(folder), reaching_model()), np.array((0.19, 0.0, 0.036))
    for place in ((0.23, -0.08), (0.24, 0.09), (0.27, 0.09)):
        fetch = plan.fetch(np.array((*place, 0.036)), grasp=Grasp(target))
        plan.deliver(fetch.end, target)


@each_arm
def test_begins_wherever_the_arm_is(name: str) -> None:
    plan, oracle = reaching(name), Oracle(name)
    start = plan.reach((0.10, -0.14, 0.05)).angles[-1]
    start[-2] += 0.3 if name == "koch_v1_1" else 0.0  # the roll, which the planned paths leave at 0
    motion = plan.reach((0.14, 0.10, 0.08), start=RestPose(start, plan.arm.position(start)))
    np.testing.assert_allclose(motion.angles[0], start, rtol=0, atol=1e-12)
    assert np.linalg.norm(oracle.hand(motion.angles[-1]) - (0.14, 0.10, 0.08)) < 1e-6
    assert_playable(name, motion, start)
    home = plan.home(motion.end)
    np.testing.assert_allclose(home.angles[-1], plan.base_angles, rtol=0, atol=1e-12)
    assert_playable(name, home, motion.angles[-1])


@each_arm
def test_a_standing_object_in_the_way_is_kept_clear_of(name: str) -> None:
    robot, tall = description(name), WorkingSurface(x=(-1.0, 1.0), y=(-1.0, 1.0), z=0.0, object_height=0.08)
    plan = ServoArmReaching(robot, reaching_model(), tall)
    clearance = ClearanceChecker(robot, plan.arm, tall)
    source, target = (0.15, -0.08, GRASP_Z), (0.15, 0.08, GRASP_Z)
    fetch = plan.fetch(source)
    free = plan.deliver(fetch.end, target)
    carried = free.gripper[free.holding]
    standing = carried[np.abs(carried[:, 1]).argmin()][None, :2]
    allowed = plan.options.clearance
    assert clearance.to_standing(free.angles[free.holding][::3], standing, True).distance < allowed
    around = plan.deliver(fetch.end, target, standing)
    assert clearance.to_standing(around.angles[around.holding][::3], standing, True).distance > 0.9 * allowed
    assert clearance.to_standing(around.angles[~around.holding][::3], standing, False).distance > 0.9 * allowed
    assert_playable(name, around, fetch.angles[-1])


@each_arm
def test_what_no_path_keeps_clear_of_is_named(name: str) -> None:
    with pytest.raises(NoPlanError, match="standing object") as rejection:
        reaching(name).fetch((0.15, 0.0, GRASP_Z), np.array([[0.05, 0.2], [0.157, 0.0]]))
    assert rejection.value.in_the_way == {1}
    with pytest.raises(NoPlanError, match="at most"):
        reaching(name).fetch((0.15, 0.0, GRASP_Z), np.full((MAX_STANDING + 1, 2), 1.0))


@each_arm
def test_what_it_holds_is_put_down_before_it_goes_home(name: str) -> None:
    plan = reaching(name)
    fetch = plan.fetch((0.15, 0.05, GRASP_Z))
    lifted, grasped = fetch.end, fetch.gripper[round(dict(fetch.phases)["grasp"] / 0.01)]
    motion = plan.home(lifted, holding=True)
    assert [phase for phase, _ in motion.phases] == ["place", "release", "withdraw", "retreat"]
    released = motion.gripper[motion.holding][-1]
    np.testing.assert_allclose(released, grasped, rtol=0, atol=1e-4)
    np.testing.assert_allclose(motion.angles[-1], plan.base_angles, rtol=0, atol=1e-12)
    assert_playable(name, motion, lifted.angles)


@each_arm
def test_opens_and_closes_the_gripper_and_leaves(name: str) -> None:
    plan = reaching(name)
    here = plan.reach((0.15, 0.05, 0.08)).end
    closing = plan.fingers(here, plan.offer_opening, plan.closed_opening)
    assert plan.arm.opening_of(closing.angles[-1, -1]) == pytest.approx(plan.closed_opening, abs=1e-9)
    np.testing.assert_allclose(closing.gripper, np.repeat(here.gripper[None], len(closing.times), axis=0), atol=1e-9)
    assert closing.holding[-1]
    leaving = plan.leave(closing.end, plan.closed_opening)
    assert [phase for phase, _ in leaving.phases] == ["release", "retreat"]
    np.testing.assert_allclose(leaving.angles[-1], plan.base_angles, rtol=0, atol=1e-12)
    held = plan.hold(plan.fetch((0.15, -0.05, GRASP_Z)).end, (0.14, 0.06, 0.1))
    np.testing.assert_allclose(held.gripper[-1], (0.14, 0.06, 0.1), rtol=0, atol=1e-6)
    assert held.holding[1:].all()


@each_arm
def test_the_way_has_the_arch_and_the_progress_of_the_person(name: str) -> None:
    """Where nothing is in the way the hand follows the learned way, not a straight line."""
    plan = reaching(name)
    target = np.array([0.15, 0.06, 0.06])
    motion = plan.reach(target)
    way = plan._person.approach(target).between(motion.gripper[0], target, plan._arm.yaw_axis)
    gaps = np.linalg.norm(motion.gripper[:, None] - way[None], axis=-1)
    assert gaps.min(axis=0).max() < 0.004
    line = target - motion.gripper[0]
    along = (way - motion.gripper[0]) @ line / (line @ line)
    beside = np.linalg.norm(way - motion.gripper[0] - along[:, None] * line, axis=1)
    assert beside.max() > 0.1 * np.linalg.norm(line)


@each_arm
@pytest.mark.parametrize("target", [(0.6, 0.0, 0.1), (0.0, 0.55, 0.05), (0.1, 0.0, 0.8)])
def test_a_target_out_of_reach_is_refused_with_a_place_that_can_be_reached(name: str, target: tuple) -> None:
    plan = reaching(name)
    with pytest.raises(
        OutOfReachError, match=r"cannot be reached.*nearest position that can be reached is"
    ) as rejection:
        plan.reach(target)
    nearest = rejection.value.position
    assert nearest is not None
    assert np.linalg.norm(nearest - target) < np.linalg.norm(target)
    np.testing.assert_allclose(plan.reach(nearest).gripper[-1], nearest, rtol=0, atol=1e-6)


@each_arm
def test_below_the_table_nothing_is_reached(name: str) -> None:
    with pytest.raises(OutOfReachError, match=r"the arm would touch the table|its .* would touch its") as rejection:
        pick_and_place(name, (0.15, 0.0, 0.002), (0.15, 0.05, GRASP_Z))
    assert rejection.value.position is not None
    assert rejection.value.position[2] > 0.005


@each_arm
@pytest.mark.parametrize("target", [(0.1, 0.0), (0.1, np.nan, 0.1), (1e300, 0.0, 0.1), "abc"])
def test_what_is_no_place_is_refused(name: str, target: object) -> None:
    with pytest.raises(ValueError, match=r"expected three numbers|could not convert"):
        reaching(name).reach(target)


def test_a_robot_without_a_chain_is_refused() -> None:
    with pytest.raises(DescriptionError, match="it is not a servo arm"):
        ServoArmReaching(HOAP3, reaching_model())


def test_knows_whether_a_target_lies_between_those_of_the_training() -> None:
    plan = reaching("open_manipulator_x")
    assert plan.within_training((0.18, 0.0, 0.0))
    assert not plan.within_training((0.30, 0.25, 0.3))
