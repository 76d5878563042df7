"""Each command has its effect, and an invalid line is rejected with a message that names what is valid."""

import json

import pytest

from dynamixel_emulator.body import HardwareError
from dynamixel_emulator.emulator import DynamixelEmulator
from dynamixel_emulator.errors import EmulatorError
from dynamixel_emulator.fault_commands import COMMANDS, FaultCommands
from dynamixel_emulator.packets import ALERT, BROADCAST, Instruction, Packet, PacketReader, encoded
from dynamixel_emulator.servo import EmulatedServo
from dynamixel_emulator.wire_faults import WireFaults
from tests.docs.markdown import ROOT, table

BAUD = 57600
FAR_S = 1e6
"""A time after all reboots, which the emulator's own clock never reaches."""


class Bench:
    """An emulator whose bus the test accesses directly, at times of its choice."""

    def __init__(self, emulator):
        self.emulator, self.now_s = emulator, FAR_S
        self.commands = FaultCommands(emulator, {"shoulder": 1, "elbow": 2})
        with emulator.lock:
            emulator.bus.begin(FAR_S)

    def do(self, line):
        return self.commands.do(line)

    def ask(self, number, instruction, parameters=b"", baud_rate=BAUD):
        """Packets of the replies."""
        self.now_s += 0.01
        with self.emulator.lock:
            replies = self.emulator.bus.receive(encoded(Packet(number, instruction, parameters)), baud_rate, self.now_s)
        return list(PacketReader().feed(b"".join(data for _, data in replies)))

    def value(self, number, name):
        """Value of a register, read by packet."""
        register = self.servo(number).model.registers[name]
        parameters = register.address.to_bytes(2, "little") + register.size.to_bytes(2, "little")
        (packet,) = self.ask(number, Instruction.READ, parameters)
        return int.from_bytes(packet.parameters[1:], "little", signed=register.signed)

    def write(self, number, name, value):
        """Writes a register; returns the error byte, alert bit included."""
        register = self.servo(number).model.registers[name]
        data = register.address.to_bytes(2, "little") + value.to_bytes(register.size, "little")
        (packet,) = self.ask(number, Instruction.WRITE, data)
        return packet.parameters[0]

    def servo(self, number):
        return next(servo for servo in self.emulator.bus.servos if servo.id == number)

    def wait(self, seconds):
        with self.emulator.lock:
            self.now_s += seconds
            self.emulator.bus.run_to(self.now_s)


@pytest.fixture
def bench():
    with DynamixelEmulator([EmulatedServo("xl430_w250", 1), EmulatedServo("xl330_m288", 2)]) as emulator:
        yield Bench(emulator)


def test_block_and_free(bench):
    bench.write(2, "Torque Enable", 1)
    bench.do("block elbow")
    bench.write(2, "Goal Position", 2500)
    bench.wait(1.0)
    assert (bench.value(2, "Present Position"), bench.value(2, "Moving")) == (2048, 0)
    bench.do("free 2")
    bench.wait(1.0)
    assert bench.value(2, "Present Position") == 2500


def test_a_servo_without_torque_is_led_and_keeps_its_position_when_released(bench):
    bench.do("lead elbow 45")
    bench.wait(0.1)
    assert 2048 < bench.value(2, "Present Position") < 2048 + 512
    bench.wait(1.0)
    assert bench.value(2, "Present Position") == 2048 + 512
    bench.do("free elbow")
    bench.do("lead shoulder 0")
    bench.wait(0.1)
    assert bench.value(2, "Present Position") == 2048 + 512
    assert bench.value(1, "Present Position") == 2048


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("overload 1", HardwareError.OVERLOAD),
        ("overheat 1", HardwareError.OVERHEATING),
        ("shock shoulder", HardwareError.SHOCK),
    ],
)
def test_a_failing_servo_reports_the_error_and_switches_torque_off(bench, line, error):
    bench.write(1, "Torque Enable", 1)
    bench.do(line)
    bench.wait(0.01)
    assert bench.value(1, "Hardware Error Status") == error
    assert bench.value(1, "Torque Enable") == 0
    assert bench.write(1, "LED", 1) == ALERT
    assert bench.value(2, "Hardware Error Status") == 0


def test_an_encoder_error_is_reported_but_by_default_does_not_shut_down(bench):
    bench.write(1, "Torque Enable", 1)
    bench.do("encoder 1")
    assert bench.value(1, "Hardware Error Status") == HardwareError.ENCODER
    assert bench.value(1, "Torque Enable") == 1


def test_voltage_applies_to_all_servos(bench):
    bench.do("voltage 5.5")
    bench.wait(0.01)
    assert (bench.value(1, "Present Input Voltage"), bench.value(2, "Present Input Voltage")) == (55, 55)
    assert bench.value(1, "Hardware Error Status") == HardwareError.VOLTAGE  # 6 to 14 V
    assert bench.value(2, "Hardware Error Status") == 0  # 3.5 to 7 V


def test_voltage_can_apply_to_one_servo(bench):
    bench.do("voltage 9.5 shoulder")
    bench.wait(0.01)
    assert (bench.value(1, "Present Input Voltage"), bench.value(2, "Present Input Voltage")) == (95, 50)


def test_a_reboot_in_motion_stops_the_servo_and_resets_its_ram(bench):
    bench.write(1, "Profile Velocity", 20)
    bench.write(1, "Torque Enable", 1)
    bench.write(1, "Goal Position", 3000)
    bench.wait(0.5)
    bench.do("reboot shoulder")
    assert bench.ask(1, Instruction.PING) == []
    bench.wait(0.5)
    assert (bench.value(1, "Torque Enable"), bench.value(1, "Profile Velocity"), bench.value(1, "Moving")) == (0, 0, 0)
    assert 2048 < bench.value(1, "Goal Position") < 2500


@pytest.mark.parametrize("line", ["dup 1", "dup shoulder xl330_m288"])
def test_a_duplicate_id_makes_replies_unreadable(bench, line):
    bench.do(line)
    bench.wait(0.01)
    assert not [packet for packet in bench.ask(1, Instruction.PING) if isinstance(packet, Packet)]
    assert [packet.id for packet in bench.ask(2, Instruction.PING)] == [2]


def test_a_servo_replies_only_at_its_new_baud_rate(bench):
    bench.do("baud 1 1000000")
    assert bench.ask(1, Instruction.PING) == []
    assert [packet.id for packet in bench.ask(1, Instruction.PING, baud_rate=1_000_000)] == [1]


def test_a_removed_servo_does_not_reply_until_it_is_restored(bench):
    bench.write(1, "Torque Enable", 1)
    bench.do("remove 1")
    assert bench.ask(1, Instruction.PING) == []
    assert [packet.id for packet in bench.ask(BROADCAST, Instruction.PING)] == [2]
    bench.do("restore shoulder")
    bench.wait(0.5)
    assert bench.value(1, "Torque Enable") == 0


def test_torque_can_be_switched_on_without_a_request(bench):
    bench.servo(1).position = 1500.0
    bench.do("torque 1 on")
    assert (bench.value(1, "Torque Enable"), bench.value(1, "Goal Position")) == (1, 1500)
    bench.wait(0.1)
    assert bench.value(1, "Present Position") == 1500
    bench.do("torque 1 off")
    assert bench.value(1, "Torque Enable") == 0


def test_eeprom_can_be_preset(bench):
    bench.do("eeprom 1 Max Position Limit 3000")
    bench.do("eeprom elbow Homing Offset -200")
    bench.do("eeprom 1 Drive Mode 1")
    assert bench.value(1, "Max Position Limit") == 3000
    assert bench.value(2, "Present Position") == 1848
    assert bench.value(1, "Present Position") == 2048  # 4096 minus the previous position
    bench.do("eeprom 1 ID 9")
    assert bench.value(9, "ID") == 9


def test_communication_faults_are_set_one_by_one_and_cleared_together(bench):
    bench.do("faults lost=0.1 damaged=0.2 seed=7")
    bench.do("faults echo=1 bare=0.5")
    bench.do("delay 16")
    expected = WireFaults(lost=0.1, damaged=0.2, seed=7, echo=True, bare=0.5, delay_s=0.016)
    assert bench.emulator.faults == expected
    bench.do("faults")
    assert bench.emulator.faults == WireFaults()


def test_unplug_and_plug_in(bench):
    bench.do("unplug")
    assert not bench.emulator.plugged_in
    assert bench.do("plug_in") == bench.emulator.port
    assert bench.emulator.plugged_in


def test_state_and_findings_are_json(bench):
    bench.write(1, "Torque Enable", 1)
    bench.write(1, "ID", 3)
    state = json.loads(bench.do("state"))
    assert [servo["id"] for servo in state["servos"]] == [1, 2]
    assert state["servos"][0]["torque_enable"] == 1
    assert state["judge"] == {"packets": 2, "findings": {"eeprom": 1}}
    assert [finding["kind"] for finding in json.loads(bench.do("findings"))] == ["eeprom"]
    assert bench.do("findings") == "[]"


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("", "is not a command of the emulator; there are: baud, block, delay"),
        ("lead elbow", "lead JOINT DEGREES"),
        ("lead elbow up", "expected a number, found 'up'"),
        ("lead elbow 1e9", "to an angle of -720 to 720 deg, found 1e9"),
        ("blok 1", "did you mean 'block'"),
        ("block", "block JOINT"),
        ("block wrist", "no servo 'wrist'; there are: 1, 2, elbow, shoulder"),
        ("block 7", "no servo '7'"),
        ("baud 1 1234", "1234 is not a baud rate of servos: 9600"),
        ("voltage much", "expected a number, found 'much'"),
        ("voltage nan", "expected a number"),
        ("voltage -3", "0 to 60 V"),
        ("torque 1 up", "torque is on or off"),
        ("eeprom 1 3", "eeprom ID ITEM VALUE"),
        ("eeprom 1 Max Position Limitt 3", "'Max Position Limit'"),
        ("eeprom 1 Max Position Limit 1.5", "whole numbers"),
        ("eeprom 1 ID 300", "1 bytes, which cannot hold 300"),
        ("dup 1 xl999", "servo model 'xl999' is not known"),
        ("delay -1", "delay_s is finite and not negative"),
        ("faults lots=0.1", "fault 'lots'; did you mean 'lost'"),
        ("faults lost=2", "lost is a fraction of 0 to 1"),
        ("faults lost", "expected a number, found ''"),
    ],
)
def test_an_invalid_line_is_rejected_and_changes_nothing(bench, line, message):
    with pytest.raises(EmulatorError, match=message):
        bench.do(line)
    assert bench.emulator.faults == WireFaults()
    assert bench.do("voltage 11.1") == ""  # the lock was released


def test_the_guide_describes_every_command():
    assert all(usage.split()[0] == name for name, (usage, _) in COMMANDS.items())
    described = [
        line.strip("`") for line, _ in table(ROOT / "docs" / "how-to" / "emulated_servos.md", "fault commands")
    ]
    assert described == [usage for usage, _ in COMMANDS.values()]
