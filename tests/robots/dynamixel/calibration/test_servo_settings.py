"""File, description and servos are compared, written and taken over, and never in silence."""

import dataclasses

import pytest

from paramove.robots.dynamixel.bus.servo_chain import ServoTimeoutError
from paramove.robots.dynamixel.calibration.arm_calibration import CalibrationError
from paramove.robots.dynamixel.calibration.servo_settings import (
    DESCRIPTION,
    SERVO,
    adopted,
    compare,
    settings,
    write_settings,
)
from tests.robots.dynamixel.small_arm import PLAN, calibration, small_arm


@pytest.fixture
def arm(tmp_path):
    with small_arm(tmp_path / "by-id") as arm:
        arm.chain.port.latency_s = 0.05
        yield arm


def told(differences):
    return {(one.joint, one.what): (one.expected, one.found) for one in differences}


def write_all(arm, calibrated):
    return {name: write_settings(arm.chain, joint) for name, joint in calibrated.joints.items()}


def test_what_differs_is_told_and_written(arm):
    calibrated = calibration()
    pan, lift = calibrated.joints["pan"], calibrated.joints["lift"]
    found = told(compare(arm.chain, calibrated, PLAN))
    assert found["pan", "Return Delay Time"] == (0, 250)
    assert found["pan", "Min Position Limit"] == (pan.min_counts, 0)
    assert found["lift", "Operating Mode"] == (4, 3)
    assert ("lift", "Min Position Limit") not in found  # the extended mode does not look at it
    assert lift.max_counts > 4095
    changed = write_all(arm, calibrated)
    assert changed["pan"]["Return Delay Time"] == (250, 0)
    assert compare(arm.chain, calibrated, PLAN) == []
    assert write_all(arm, calibrated) == {"pan": {}, "lift": {}, "elbow": {}}
    assert {name: arm.memory("pan")[name] for name in settings(pan)} == settings(pan)


def test_other_servos_than_in_the_file_are_told(arm):
    calibrated = calibration()
    write_all(arm, calibrated)
    with arm.emulator.lock:
        servos = arm.emulator.bus.servos
        servos[0].memory["Firmware Version"] = 52
        servos[1].memory["Homing Offset"] = 100
        servos[2].memory["ID"] = 9
    found = compare(arm.chain, calibrated)
    assert told(found) == {
        ("pan", "firmware"): (46, 52),
        ("lift", "Homing Offset"): (0, 100),
        ("elbow", "servo"): ("ID 3", None),
    }
    assert {one.where for one in found} == {SERVO}


def test_another_model_is_told_and_never_written_to(arm):
    calibrated = calibration()
    pan = calibrated.joints["pan"].model_copy(update={"model": "xl330_m288"})
    other = calibrated.model_copy(update={"joints": {"pan": pan}})
    assert told(compare(arm.chain, other)) == {("pan", "model"): ("xl330_m288", "xl430_w250")}
    before = arm.memory("pan")
    with pytest.raises(CalibrationError, match="servo 1 is a xl430_w250, expected xl330_m288: nothing was written"):
        write_settings(arm.chain, pan)
    with pytest.raises(CalibrationError, match="servo 1 is a xl430_w250, expected xl330_m288"):
        adopted(arm.chain, other)
    assert {name: value for name, value in arm.memory("pan").items() if name != "Realtime Tick"} == {
        name: value for name, value in before.items() if name != "Realtime Tick"
    }


def test_another_description_is_told(arm):
    calibrated = calibration()
    write_all(arm, calibrated)
    pan, lift, _ = PLAN.servos
    plan = dataclasses.replace(
        PLAN,
        robot="other",
        baud_rate=57600,
        servos=(dataclasses.replace(pan, number=7), dataclasses.replace(lift, joint="tilt")),
    )
    found = compare(arm.chain, calibrated, plan)
    assert {one.where for one in found} == {DESCRIPTION}
    assert told(found) == {
        ("", "robot"): ("small_arm", "other"),
        ("", "baud rate"): (2_000_000, 57600),
        ("pan", "ID"): (1, 7),
        ("lift", "joint"): ("there", "not there"),
        ("elbow", "joint"): ("there", "not there"),
        ("tilt", "joint"): ("not there", "there"),
    }


def test_the_servos_settings_can_be_taken_over(arm):
    calibrated = calibration()
    write_all(arm, calibrated)
    with arm.emulator.lock:
        memory = arm.emulator.bus.servos[0].memory
        memory["Firmware Version"], memory["Min Position Limit"] = 46, 1300
    assert compare(arm.chain, calibrated) != []
    taken = adopted(arm.chain, calibrated)
    assert (taken.joints["pan"].firmware, taken.joints["pan"].min_counts) == (46, 1300)
    assert taken.joints["lift"] == calibrated.joints["lift"]
    assert compare(arm.chain, taken) == []


@pytest.mark.parametrize(
    ("name", "value", "detail"),
    [
        ("Homing Offset", 5, "lift: servo 2 has Homing Offset 5, and a calibration has none.*verify --write"),
        ("Operating Mode", 1, "lift: servo 2 has operating mode 1, not 3 to 5"),
        ("Operating Mode", 3, "lift: expected|joint lift"),
    ],
)
def test_settings_that_no_calibration_can_have_are_not_taken_over(arm, name, value, detail):
    calibrated = calibration()
    write_all(arm, calibrated)
    with arm.emulator.lock:
        arm.emulator.bus.servos[1].memory[name] = value
    with pytest.raises(CalibrationError, match=detail):
        adopted(arm.chain, calibrated)


def test_a_servo_with_torque_keeps_its_settings(arm):
    with arm.emulator.lock:
        arm.emulator.bus.servos[0].memory["Torque Enable"] = 1
    with pytest.raises(CalibrationError, match=r"servo 1 has torque, and its settings are locked.*arm reboot 1"):
        write_settings(arm.chain, calibration().joints["pan"])


def test_a_silent_servo_is_told(arm):
    joint = calibration().joints["pan"].model_copy(update={"id": 8})
    with pytest.raises(ServoTimeoutError, match="servo 8 does not answer"):
        write_settings(arm.chain, joint)
