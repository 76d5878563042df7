"""A person calibrates an emulated arm, from the first request to the file and the servos' settings.

And the mathematics of it: for every place of the encoder's seam, both directions, and every turn.
"""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paramove.robots.dynamixel.bus.scan import DetectedServo
from paramove.robots.dynamixel.bus.servo_models import (
    CURRENT_BASED_MODE,
    EXTENDED_MODE,
    POSITION_MODE,
    PULSES_PER_TURN,
    difference,
)
from paramove.robots.dynamixel.calibration.arm_calibration import (
    COUNTS_PER_RAD,
    LONGEST_TRAVEL,
    SEAM_MARGIN,
    CalibrationError,
)
from paramove.robots.dynamixel.calibration.arm_plan import ArmPlan, PlannedServo
from paramove.robots.dynamixel.calibration.procedure import (
    LARGEST_STEP,
    SMALLEST_TRAVEL,
    ArmCalibrator,
    JointSweep,
    Travel,
    calibrated_joint,
    remarks,
)
from paramove.robots.dynamixel.calibration.servo_settings import compare
from tests.robots.dynamixel.small_arm import PLAN, RANGE, SERIAL, ZEROS, calibration, small_arm, swept


@pytest.fixture
def arm(tmp_path):
    with small_arm(tmp_path / "by-id") as arm:
        yield arm


class Hands:
    """Does what is asked for; `wrong` is a joint that is moved the other way."""

    def __init__(self, arm, wrong="", angles=None):
        self.arm, self.wrong, self.angles = arm, wrong, angles or swept()
        self.told, self.asked, self.shown = [], [], []

    def tell(self, detail):
        self.told.append(detail)

    def until_done(self, request, look):
        self.asked.append(request)
        for step in self._steps(request):
            self.arm.move(**step)
            self.shown = look()

    def _steps(self, request):
        joint = request.removeprefix("Move ").split()[0]
        if "becomes limp" in request:
            return [{}]
        if request.startswith("Move every joint"):
            return [dict.fromkeys(ZEROS, angle) for angle in self.angles]
        if joint in ZEROS:
            return [{joint: -0.4 if joint == self.wrong else 0.4}]
        if request.startswith("Move the arm"):
            return [{"pan": 0.5, "lift": -0.25, "elbow": 1.0}]
        return [dict.fromkeys(ZEROS, 0.0)]


def calibrated(arm, hands, plan=PLAN):
    return ArmCalibrator(arm.chain, plan, SERIAL, hands).run("2026-11-23T02:00:00+00:00", "paramove 0.1.0")


def near(found, expected):
    """The same but for a rounded count."""
    for name, joint in found.joints.items():
        other = expected.joints[name]
        for key in ("zero_counts", "min_counts", "max_counts"):
            assert abs(getattr(joint, key) - getattr(other, key)) <= 1, (name, key)
        rest = {"zero_counts": 0, "min_counts": 0, "max_counts": 4000}
        assert joint.model_copy(update=rest) == other.model_copy(update=rest)


def test_an_arm_is_calibrated(arm):
    with arm.emulator.lock:
        for servo in arm.emulator.bus.servos:
            servo.memory["Homing Offset"] = 700  # as it came
            servo.preset("Drive Mode", 1)
            servo.memory["Torque Enable"] = 1
    hands = Hands(arm)
    found = calibrated(arm, hands)
    near(found, calibration())
    assert compare(arm.chain, found, PLAN) == []
    assert hands.asked[0].startswith("Hold the arm, it becomes limp")
    assert hands.asked[3].startswith("Move pan by 10 deg or more so that pan goes up")
    assert hands.shown == ["pan: 28.7 deg", "lift: -14.3 deg", "elbow: 57.3 deg"]
    assert any("lift crosses the seam of its encoder" in detail for detail in hands.told)
    assert any("joint lift" in detail and "mounted mirrored" in detail for detail in hands.told)


def test_a_joint_whose_posture_is_an_end_of_its_range_is_shown_the_other_way(arm):
    servos = tuple(
        dataclasses.replace(one, grows=False, direction="it falls") if one.joint == "elbow" else one
        for one in PLAN.servos
    )
    hands = Hands(arm, wrong="elbow")
    near(calibrated(arm, hands, dataclasses.replace(PLAN, servos=servos)), calibration())
    assert "Move elbow by 10 deg or more so that it falls." in hands.asked


def test_a_joint_that_is_put_back_before_its_direction_is_seen_is_asked_for_again(arm):
    class Hesitating(Hands):
        def _steps(self, request):
            first = request.startswith("Move pan") and request not in self.asked[:-1]
            return [{"pan": 0.4}, {"pan": 0.0}] if first else super()._steps(request)

    hands = Hesitating(arm)
    near(calibrated(arm, hands), calibration())
    assert any(message.startswith("pan is back at its start: leave it") for message in hands.told)
    assert sum(one.startswith("Move pan") for one in hands.asked) == 2


def test_missing_and_wrong_servos_are_told_before_anything_is_asked(arm):
    arm.chain.port.latency_s = 0.03
    pan, lift, elbow = PLAN.servos
    plan = ArmPlan(
        "small_arm",
        PLAN.baud_rate,
        (dataclasses.replace(pan, number=7), lift, dataclasses.replace(elbow, model="xl430_w250")),
    )
    hands = Hands(arm)
    with pytest.raises(
        CalibrationError,
        match=r"pan: expected xl430_w250 with ID 7, none .*; elbow: expected xl430_w250 with ID 3, found xl330_m288",
    ):
        calibrated(arm, hands, plan)
    assert hands.asked == []


def test_a_wrong_showing_changes_no_setting(arm):
    """The wrong direction is seen because the joint reaches further to one side than to the other."""
    before = [arm.memory(joint)["Operating Mode"] for joint in ZEROS]
    plan = dataclasses.replace(
        PLAN, servos=tuple(dataclasses.replace(one, lower=-0.2, upper=RANGE[1]) for one in PLAN.servos)
    )
    hands = Hands(arm, wrong="elbow", angles=[angle for angle in swept() if angle > -0.3])
    with pytest.raises(CalibrationError, match=r"joint elbow would reach from -80 to .* deg, .* -11 to 80 deg"):
        calibrated(arm, hands, plan)
    assert [arm.memory(joint)["Operating Mode"] for joint in ZEROS] == before


def test_a_joint_that_was_not_moved_is_named(arm):
    with pytest.raises(CalibrationError, match="joint pan was moved by 0 counts"):
        calibrated(arm, Hands(arm, angles=[0.0, 0.0]))


SERVO = DetectedServo(3, "xl330_m288", 1200, 45, 1_000_000)
ELBOW_RANGE = np.deg2rad((-90.0, 60.0))
HALF_COUNT = 0.5 / COUNTS_PER_RAD


def planned(**others):
    return PlannedServo("elbow", 3, "xl330_m288", *(float(end) for end in ELBOW_RANGE), **others)


def encoder(angles, sign, offset):
    """Whole counts of a joint that is mounted with this sign, and reads `offset` at 0 rad."""
    return np.rint(offset + sign * COUNTS_PER_RAD * np.asarray(angles)).astype(int)


def shown(angles, sign, offset, present=lambda counts: counts % PULSES_PER_TURN):
    """A joint that a person moved through these angles."""
    positions = [int(present(count)) for count in encoder(angles, sign, offset)]
    sweep = JointSweep("elbow", positions[0])
    for position in positions[1:]:
        sweep.add(position)
    return sweep


BACK_AND_FORTH = np.concatenate(
    [np.linspace(0.2, ELBOW_RANGE[0], 9), np.linspace(*ELBOW_RANGE, 15), np.linspace(ELBOW_RANGE[1], 0.2, 7)]
)


@pytest.mark.parametrize("sign", [1, -1])
def test_every_place_of_the_seam_gives_the_right_angles(sign):
    """For all 4096 places of the zero angle: angles come out, and the seam is outside or known to be inside."""
    plan = planned(sign=sign)
    for offset in range(PULSES_PER_TURN):
        travel = shown(BACK_AND_FORTH, sign, offset).travel()
        held = int(encoder(0.0, sign, offset)) % PULSES_PER_TURN
        joint = calibrated_joint(SERVO, plan, travel, held, sign * 200)
        truth = encoder(ELBOW_RANGE, sign, offset)
        crossed = truth.min() // PULSES_PER_TURN != truth.max() // PULSES_PER_TURN
        assert joint.sign == sign
        assert joint.max_counts - joint.min_counts == truth.max() - truth.min()
        assert joint.operating_mode == EXTENDED_MODE or not crossed
        is_near = min(truth.min() % PULSES_PER_TURN, -1 - truth.max() % -PULSES_PER_TURN) < SEAM_MARGIN
        assert (joint.operating_mode == POSITION_MODE) == (not crossed and not is_near)
        for angle in (ELBOW_RANGE[0], -0.3, 0.0, 0.7, ELBOW_RANGE[1]):
            present = int(encoder(angle, sign, offset)) % PULSES_PER_TURN  # after it was switched on
            assert abs(joint.angle(present) - angle) <= HALF_COUNT + 1e-9
            assert joint.min_counts <= joint.counts(present) <= joint.max_counts
            assert present == joint.counts(present) + PULSES_PER_TURN * joint.turns(present)
            if joint.operating_mode == POSITION_MODE:
                assert joint.turns(present) == 0


@given(
    begin=st.integers(0, PULSES_PER_TURN - 1),
    steps=st.lists(st.integers(-LARGEST_STEP, LARGEST_STEP), min_size=1, max_size=40),
    turns=st.lists(st.integers(-3, 3), min_size=1, max_size=7),
)
def test_a_path_is_followed_in_whatever_turn_it_is_presented(begin, steps, turns):
    """A servo may present a place in any turn, and change the turn on the way."""
    path = begin + np.concatenate([[0], np.cumsum(steps)])
    sweep = JointSweep("elbow", int(path[0] % PULSES_PER_TURN))
    for place, count in enumerate(path[1:]):
        sweep.add(int(count % PULSES_PER_TURN + PULSES_PER_TURN * turns[place % len(turns)]))
    assert (sweep.lowest, sweep.present, sweep.highest) == (path.min(), path[-1], path.max())
    length = path.max() - path.min()
    if SMALLEST_TRAVEL <= length <= LONGEST_TRAVEL:
        travel = sweep.travel()
        assert travel == Travel(path.min() % PULSES_PER_TURN, path.min() % PULSES_PER_TURN + length)
    else:
        with pytest.raises(CalibrationError):
            sweep.travel()


@given(
    sign=st.sampled_from([1, -1]),
    offset=st.integers(0, PULSES_PER_TURN - 1),
    turn=st.integers(-2, 2),
)
def test_any_turn_gives_the_same_zero(sign, offset, turn):
    travel = shown(BACK_AND_FORTH, sign, offset).travel()
    held = int(encoder(0.0, sign, offset)) % PULSES_PER_TURN + turn * PULSES_PER_TURN
    joint = calibrated_joint(SERVO, planned(sign=sign), travel, held, sign * 100)
    assert abs(joint.zero_counts - offset) % PULSES_PER_TURN in (0, 1, PULSES_PER_TURN - 1)


@given(st.integers(-(2**20), 2**20), st.integers(-(2**20), 2**20))
def test_the_shorter_way_is_taken(later, earlier):
    step = difference(later, earlier)
    assert -PULSES_PER_TURN // 2 <= step < PULSES_PER_TURN // 2
    assert (earlier + step - later) % PULSES_PER_TURN == 0


@pytest.mark.parametrize("offset", [2000, 4090])
def test_a_gripper_holds_with_a_limited_current(offset):
    joint = calibrated_joint(SERVO, planned(grips=True), shown(BACK_AND_FORTH, 1, offset).travel(), offset, 100)
    assert joint.operating_mode == CURRENT_BASED_MODE
    assert abs(joint.angle(offset)) <= HALF_COUNT


def test_what_cannot_be_calibrated_is_refused_with_the_reason():
    with pytest.raises(CalibrationError, match=r"elbow was moved by 3 counts.*from one end to the other"):
        shown([0.0, 3.0 / COUNTS_PER_RAD], 1, 100).travel()
    with pytest.raises(CalibrationError, match=r"elbow was moved by 4096 counts.*turn it by at most 348 deg"):
        shown(np.linspace(0.0, 2.0 * np.pi, 50), 1, 100).travel()
    with pytest.raises(CalibrationError, match=r"moved by 1252 counts between two readings.*more slowly"):
        shown([0.0, 1.92], 1, 100).travel()
    travel = shown(BACK_AND_FORTH, 1, 2000).travel()
    with pytest.raises(CalibrationError, match=r"moved by 33 counts.*show a direction"):
        calibrated_joint(SERVO, planned(), travel, 2000, 33)
    with pytest.raises(CalibrationError, match=r"posture is at 3000 counts, outside of the demonstrated travel"):
        calibrated_joint(SERVO, planned(), travel, 3000, 100)
    with pytest.raises(CalibrationError, match=r"would reach from -1\d deg|would reach from -?\d+ to \d+ deg"):
        calibrated_joint(SERVO, planned(), travel, int(encoder(ELBOW_RANGE[1], 1, 2000)), -100)


def test_a_mirrored_servo_and_a_short_travel_are_remarked():
    travel = shown(np.linspace(-0.8, 1.0, 20), -1, 4000).travel()
    plan = planned()
    joint = calibrated_joint(SERVO, plan, travel, 4000, -100)
    told = " ".join(remarks(joint, plan))
    assert "moved from -46 to 57 deg of -90 to 60 deg" in told
    assert "mounted mirrored" in told
    assert "crosses the seam" in told
    whole = shown(BACK_AND_FORTH, 1, 2000).travel()
    assert remarks(calibrated_joint(SERVO, plan, whole, 2000, 100), plan) == []
