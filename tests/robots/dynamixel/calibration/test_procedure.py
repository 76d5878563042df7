"""A person calibrates an emulated arm, from the first request to the file and the servos' settings."""

import dataclasses

import pytest

from paramove.robots.dynamixel.calibration.arm_calibration import CalibrationError
from paramove.robots.dynamixel.calibration.arm_plan import ArmPlan
from paramove.robots.dynamixel.calibration.procedure import ArmCalibrator
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
