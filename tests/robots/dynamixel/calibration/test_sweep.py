"""The mathematics of calibration: for every place of the encoder's seam, both directions, and every turn."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paramove.robots.dynamixel.bus.scan import DetectedServo
from paramove.robots.dynamixel.bus.servo_models import PULSES_PER_TURN
from paramove.robots.dynamixel.calibration.arm_calibration import (
    COUNTS_PER_RAD,
    CURRENT_BASED,
    EXTENDED,
    LONGEST_TRAVEL,
    POSITION,
    CalibrationError,
)
from paramove.robots.dynamixel.calibration.arm_plan import PlannedServo
from paramove.robots.dynamixel.calibration.sweep import (
    LARGEST_STEP,
    SEAM_MARGIN,
    SMALLEST_TRAVEL,
    JointSweep,
    Travel,
    calibrated_joint,
    difference,
    remarks,
)

SERVO = DetectedServo(3, "xl330_m288", 1200, 45, 1_000_000)
RANGE = np.deg2rad((-90.0, 60.0))
HALF_COUNT = 0.5 / COUNTS_PER_RAD


def planned(**others):
    return PlannedServo("elbow", 3, "xl330_m288", *(float(end) for end in RANGE), **others)


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


BACK_AND_FORTH = np.concatenate([np.linspace(0.2, RANGE[0], 9), np.linspace(*RANGE, 15), np.linspace(RANGE[1], 0.2, 7)])


@pytest.mark.parametrize("sign", [1, -1])
def test_every_place_of_the_seam_gives_the_right_angles(sign):
    """For all 4096 places of the zero angle: angles come out, and the seam is outside or known to be inside."""
    plan = planned(sign=sign)
    for offset in range(PULSES_PER_TURN):
        travel = shown(BACK_AND_FORTH, sign, offset).travel()
        held = int(encoder(0.0, sign, offset)) % PULSES_PER_TURN
        joint = calibrated_joint(SERVO, plan, travel, held, sign * 200)
        truth = encoder(RANGE, sign, offset)
        crossed = truth.min() // PULSES_PER_TURN != truth.max() // PULSES_PER_TURN
        assert joint.sign == sign
        assert joint.max_counts - joint.min_counts == truth.max() - truth.min()
        assert joint.operating_mode == EXTENDED or not crossed
        near = min(truth.min() % PULSES_PER_TURN, -1 - truth.max() % -PULSES_PER_TURN) < SEAM_MARGIN
        assert (joint.operating_mode == POSITION) == (not crossed and not near)
        for angle in (RANGE[0], -0.3, 0.0, 0.7, RANGE[1]):
            present = int(encoder(angle, sign, offset)) % PULSES_PER_TURN  # after it was switched on
            assert abs(joint.angle(present) - angle) <= HALF_COUNT + 1e-9
            assert joint.min_counts <= joint.counts(present) <= joint.max_counts
            assert present == joint.counts(present) + PULSES_PER_TURN * joint.turns(present)
            if joint.operating_mode == POSITION:
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
    posture=st.floats(RANGE[0], RANGE[1]),
    sign=st.sampled_from([1, -1]),
    offset=st.integers(0, PULSES_PER_TURN - 1),
    turn=st.integers(-2, 2),
)
def test_any_posture_and_any_turn_give_the_same_zero(posture, sign, offset, turn):
    travel = shown(BACK_AND_FORTH, sign, offset).travel()
    held = int(encoder(posture, sign, offset)) % PULSES_PER_TURN + turn * PULSES_PER_TURN
    joint = calibrated_joint(SERVO, planned(sign=sign, posture=posture), travel, held, sign * 100)
    assert abs(joint.zero_counts - offset) % PULSES_PER_TURN in (0, 1, PULSES_PER_TURN - 1)


@given(st.integers(-(2**20), 2**20), st.integers(-(2**20), 2**20))
def test_the_shorter_way_is_taken(later, earlier):
    step = difference(later, earlier)
    assert -PULSES_PER_TURN // 2 <= step < PULSES_PER_TURN // 2
    assert (earlier + step - later) % PULSES_PER_TURN == 0


@pytest.mark.parametrize("offset", [2000, 4090])
def test_a_gripper_holds_with_a_limited_current(offset):
    joint = calibrated_joint(SERVO, planned(grips=True), shown(BACK_AND_FORTH, 1, offset).travel(), offset, 100)
    assert joint.operating_mode == CURRENT_BASED
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
        calibrated_joint(SERVO, planned(), travel, int(encoder(RANGE[1], 1, 2000)), -100)


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
