"""One servo without a bus: modes, backup, indirect access and startup as in the e-Manual."""

from dataclasses import replace

import pytest

from dynamixel_emulator.body import HardwareError
from dynamixel_emulator.models import MODELS, XL330_M288, XM430_W350
from dynamixel_emulator.packets import ALERT, Instruction, StatusError
from dynamixel_emulator.servo import EmulatedServo

STORE, RESTORE = bytes.fromhex("01 43 54 52 4C"), bytes.fromhex("02 43 54 52 4C")
INDIRECT = 168


def write(servo, name, value):
    """Writes a register by name, or two bytes at an address; returns the error byte."""
    one = servo.model.registers.get(name)
    address, size = (one.address, one.size) if one else (name, 2)
    data = (value % (1 << 8 * size)).to_bytes(size, "little")
    return servo.do(Instruction.WRITE, address.to_bytes(2, "little") + data).error


def read(servo, address, size):
    return servo.do(Instruction.READ, address.to_bytes(2, "little") + size.to_bytes(2, "little")).data


def test_a_change_of_operating_mode_resets_gains_and_profile():
    servo = EmulatedServo("xm430_w350")
    for name in ("Profile Velocity", "Profile Acceleration", "Position P Gain", "Feedforward 1st Gain"):
        assert write(servo, name, 55) == 0
    assert write(servo, "Operating Mode", 3) == 0
    assert servo.memory["Position P Gain"] == 55  # mode unchanged
    assert write(servo, "Operating Mode", 4) == 0
    values = {name: servo.memory[name] for name in ("Profile Velocity", "Profile Acceleration", "Position P Gain")}
    assert values == {"Profile Velocity": 0, "Profile Acceleration": 0, "Position P Gain": 800}


def test_torque_on_in_position_mode_reduces_the_position_to_one_turn():
    servo = EmulatedServo("xl430_w250")
    servo.turned(5000.0)
    assert servo.memory["Present Position"] == 5000
    assert write(servo, "Torque Enable", 1) == 0
    servo.run_to(0.001)
    assert servo.memory["Present Position"] == pytest.approx(5000 - 4096, abs=2)
    multi = EmulatedServo("xl430_w250")
    write(multi, "Operating Mode", 4)
    multi.turned(5000.0)
    write(multi, "Goal Position", 5000)
    write(multi, "Torque Enable", 1)
    multi.run_to(0.001)
    assert multi.memory["Present Position"] == 5000


@pytest.mark.parametrize(
    ("mode", "offset", "counts"), [(3, 1024, 1024), (3, 1025, 0), (3, -1025, 0), (4, 1025, 1025), (4, -9000, -9000)]
)
def test_a_homing_offset_of_more_than_a_quarter_turn_is_ignored_in_position_mode(mode, offset, counts):
    servo = EmulatedServo("xl430_w250", position=2000.0)
    write(servo, "Operating Mode", mode)
    assert write(servo, "Homing Offset", offset) == 0
    servo.run_to(0.001)
    assert servo.memory["Present Position"] == 2000 + counts


@pytest.mark.parametrize("model", sorted(MODELS))
def test_a_backup_restores_eeprom(model):
    servo = EmulatedServo(model, 5)
    assert servo.do(Instruction.BACKUP, RESTORE).error == StatusError.RESULT_FAIL  # no backup yet
    write(servo, "Operating Mode", 4)
    write(servo, "Position P Gain", 321)
    assert read(servo, 147, 1) == b"\x00"
    assert servo.do(Instruction.BACKUP, STORE).error == 0
    assert read(servo, 147, 1) == b"\x01"
    assert servo.do(Instruction.FACTORY_RESET, b"\xff").error == 0
    assert (servo.id, servo.memory["Operating Mode"], servo.memory["Backup Ready"]) == (1, 3, 1)
    assert servo.do(Instruction.BACKUP, RESTORE).error == 0
    assert not servo.listens  # it reboots
    p_gain = servo.model.registers["Position P Gain"].initial
    assert (servo.id, servo.memory["Operating Mode"], servo.memory["Position P Gain"]) == (5, 4, p_gain)


def test_backup_is_rejected_while_torque_is_on_or_with_invalid_parameters():
    servo = EmulatedServo("xl330_m288")
    assert servo.do(Instruction.BACKUP, b"\x03" + STORE[1:]).error == StatusError.DATA_RANGE
    write(servo, "Torque Enable", 1)
    assert servo.do(Instruction.BACKUP, STORE).error == StatusError.RESULT_FAIL


def test_a_servo_can_start_with_torque_on_and_gains_from_the_backup():
    servo = EmulatedServo("xl330_m288", position=1500.0)
    for name, value in (("Startup Configuration", 3), ("Position P Gain", 321), (INDIRECT, 65)):
        assert write(servo, name, value) == 0
    servo.do(Instruction.BACKUP, STORE)
    for name, value in (("Position P Gain", 100), (INDIRECT, 66)):
        assert write(servo, name, value) == 0
    servo.reboot()
    memory = servo.memory
    assert (memory["Torque Enable"], memory["Position P Gain"], memory["Goal Position"]) == (1, 321, 1500)
    assert read(servo, INDIRECT, 2) == b"\x41\x00"
    assert write(servo, "Torque Enable", 0) == 0
    assert write(servo, "Startup Configuration", 0) == 0
    servo.reboot()
    assert (memory["Torque Enable"], memory["Position P Gain"]) == (0, 400)
    assert write(servo, "Startup Configuration", 4) == StatusError.DATA_RANGE


@pytest.mark.parametrize(
    ("model", "last"), [(XM430_W350, 661), (XL330_M288, 251), (replace(XL330_M288, firmware=52), 227)]
)
def test_indirect_addresses_must_be_complete_and_in_ram(model, last):
    servo = EmulatedServo(model)
    half = servo.do(Instruction.WRITE, INDIRECT.to_bytes(2, "little") + b"\x41")
    assert half.error == StatusError.DATA_LENGTH
    for address, error in ((63, StatusError.DATA_RANGE), (64, 0), (last, 0), (last + 1, StatusError.DATA_RANGE)):
        assert write(servo, INDIRECT, address) == error
    write(servo, "Torque Enable", 1)
    assert write(servo, INDIRECT, 64) == StatusError.ACCESS


@pytest.mark.parametrize(
    ("velocity", "acceleration", "distance", "during"),
    [(0, 0, 500, 0x00), (100, 0, 500, 0x12), (100, 2, 200, 0x22), (100, 10, 1500, 0x32)],
)
def test_moving_status_reports_profile_and_arrival(velocity, acceleration, distance, during):
    servo = EmulatedServo("xl430_w250")
    assert servo.memory["Moving Status"] == 0
    for name, value in (
        ("Profile Velocity", velocity), ("Profile Acceleration", acceleration), ("Torque Enable", 1),
        ("Goal Position", 2048 + distance),
    ):  # fmt: skip
        assert write(servo, name, value) == 0
    servo.run_to(0.02)
    assert servo.memory["Moving Status"] == during
    servo.run_to(8.0)
    assert servo.memory["Moving Status"] == (during & 0x30) | 0x01


def test_a_profile_uses_the_registers_at_the_time_of_the_goal():
    servo = EmulatedServo("xl430_w250")
    write(servo, "Profile Velocity", 20)
    write(servo, "Torque Enable", 1)
    write(servo, "Goal Position", 3048)
    write(servo, "Profile Velocity", 40)
    servo.run_to(0.5)
    assert servo.memory["Velocity Trajectory"] == 20
    write(servo, "Goal Position", 3048)
    servo.run_to(1.0)
    assert servo.memory["Velocity Trajectory"] == 40


def test_moving_is_set_while_a_profile_is_slower_than_the_threshold():
    servo = EmulatedServo("xl430_w250")
    for name, value in (("Profile Velocity", 4), ("Torque Enable", 1), ("Goal Position", 2060)):
        write(servo, name, value)
    servo.run_to(0.1)
    assert (servo.memory["Moving"], servo.memory["Present Velocity"]) == (1, 4)  # Moving Threshold is 10
    servo.run_to(2.0)
    assert servo.memory["Moving"] == 0


def test_acceleration_without_velocity_is_a_profile_only_in_velocity_mode():
    servo = EmulatedServo("xl430_w250")
    for name, value in (("Profile Acceleration", 1), ("Torque Enable", 1), ("Goal Position", 3000)):
        write(servo, name, value)
    servo.run_to(1.0)
    assert servo.memory["Present Position"] == pytest.approx(3000, abs=1)
    wheel = EmulatedServo("xl430_w250")
    for name, value in (
        ("Operating Mode", 1), ("Drive Mode", 4), ("Profile Acceleration", 1000), ("Torque Enable", 1),
        ("Goal Velocity", 100),
    ):  # fmt: skip
        write(wheel, name, value)
    wheel.run_to(0.5)  # half of the acceleration time of 1000 ms
    assert wheel.memory["Present Velocity"] == pytest.approx(50, abs=1)


def test_realtime_tick_counts_from_the_start():
    servo = EmulatedServo("xl430_w250")
    servo.run_to(40.0)
    assert servo.memory["Realtime Tick"] == pytest.approx(40_000 - 32_768, abs=2)
    servo.reboot()
    servo.run_to(40.5)
    assert servo.memory["Realtime Tick"] == pytest.approx(500, abs=2)


def test_the_reply_to_a_reboot_still_has_the_alert_bit():
    servo = EmulatedServo("xl330_m288")
    servo.fail(HardwareError.OVERLOAD)
    assert servo.do(Instruction.REBOOT).error == ALERT
    assert servo.do(Instruction.PING).error == 0


def test_an_xl330_can_switch_torque_on_by_a_goal():
    servo = EmulatedServo("xl330_m288")
    assert write(servo, "Drive Mode", 12) == 0
    assert write(servo, "Goal Position", 2100) == 0
    assert servo.memory["Torque Enable"] == 1
