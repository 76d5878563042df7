"""A reboot clears the error of one servo; what that one carries would fall."""

import pytest

from paramove.robots.dynamixel.bus.servo_chain import ServoTimeoutError
from paramove.robots.dynamixel.bus.servo_reboot import (
    ServoLoadedError,
    check_unloaded,
    reboot_messages,
    reboot_servo,
    servo_before_reboot,
)
from tests.robots.dynamixel.small_arm import small_arm


@pytest.fixture
def arm(tmp_path):
    with small_arm(tmp_path / "by-id") as arm:
        with arm.emulator.lock:
            for servo in arm.emulator.bus.servos:
                servo.memory["Torque Enable"] = 1
        yield arm


def test_the_error_is_told_and_cleared_and_the_others_hold(arm):
    with arm.emulator.lock:
        arm.emulator.bus.servos[1].memory["Hardware Error Status"] = 0x20
    servo = servo_before_reboot(arm.chain, 2)
    assert reboot_messages(servo) == ["servo 2: overloaded; take the load off; look for what blocked the joint"]
    after = reboot_servo(arm.chain, 2)
    assert (after.hardware_error, after.torque) == (0, False)
    assert reboot_messages(after) == ["servo 2: no hardware error"]
    assert [arm.memory(joint)["Torque Enable"] for joint in ("pan", "lift", "elbow")] == [1, 0, 1]


@pytest.mark.parametrize(("number", "name", "load"), [(2, "Present Load", -300), (3, "Present Current", 500)])
def test_a_loaded_joint_is_refused(arm, number, name, load, monkeypatch):
    servo = servo_before_reboot(arm.chain, number)
    check_unloaded(arm.chain, servo)
    read = arm.chain.read
    monkeypatch.setattr(arm.chain, "read", lambda who, one: load if one.name == name else read(who, one))
    with pytest.raises(ServoLoadedError, match=rf"servo {number} holds its joint with (30|29) % .* --yes"):
        check_unloaded(arm.chain, servo)
    with arm.emulator.lock:
        arm.emulator.bus.servos[number - 1].memory["Torque Enable"] = 0
    check_unloaded(arm.chain, servo_before_reboot(arm.chain, number))


def test_a_silent_servo_is_told(arm):
    arm.chain.port.latency_s = 0.03
    with pytest.raises(ServoTimeoutError, match="servo 9 does not answer"):
        servo_before_reboot(arm.chain, 9)
    arm.chain.reboot(1)
    with pytest.raises(ServoTimeoutError, match=r"servo 1 (does|did) not answer"):
        reboot_servo(arm.chain, 1, timeout_s=0.05)
