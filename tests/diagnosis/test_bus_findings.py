"""Servos behind a pseudo-terminal, with most that can be wrong with them; what mends it is run too."""

import shlex
import subprocess
import threading
import time

import pytest

from dynamixel_emulator.emulator import DynamixelEmulator
from dynamixel_emulator.servo import EmulatedServo
from paramove.diagnosis.bus_findings import bus_findings, servo_findings
from paramove.diagnosis.finding import Level
from paramove.robots.dynamixel.bus.packets import Instruction, PacketReader
from paramove.robots.dynamixel.bus.scan import DetectedServo
from paramove.robots.dynamixel.bus.servo_port import ServoPort

RATES = (57_600, 1_000_000)
FAST = RATES[1]
PATIENT_S = 0.5
"""Other programs may keep the emulator waiting."""


def wrong_servos():
    """1 twice, 2 with too high a voltage, 3 at another rate, 4 with errors, 5 too hot."""
    twins = [EmulatedServo("xl430_w250", 1, FAST), EmulatedServo("xl430_w250", 1, FAST)]
    high, slow, stopped, hot = (
        EmulatedServo("xl330_m288", 2, FAST),
        EmulatedServo("xm430_w350", 3, RATES[0]),
        EmulatedServo("xl430_w250", 4, FAST),
        EmulatedServo("xl430_w250", 5, FAST),
    )
    high.voltage = 9.0
    stopped.memory["Hardware Error Status"] = 0x24
    hot.temperature = 75.0
    return [*twins, high, slow, stopped, hot]


class Overheard:
    """Instructions that came over a bus."""

    def __init__(self, bus):
        self.instructions, self._receive, self._reader = set(), bus.receive, PacketReader()

    def __call__(self, data, baud_rate, now_s):
        self.instructions |= {packet.instruction for packet in self._reader.feed(data)}
        return self._receive(data, baud_rate, now_s)


@pytest.fixture(scope="module", autouse=True)
def no_turns():
    """Emulated servos answer to a ping of all at once; real ones take turns, which are waited for."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("paramove.robots.dynamixel.bus.servo_chain.TURN_S", 0.0)
        yield


@pytest.fixture(scope="module")
def wrong(tmp_path_factory):
    """The emulator, its port, what was found, and the instructions that it took to find it."""
    link = tmp_path_factory.mktemp("by-id") / "usb-adapter"
    with DynamixelEmulator(wrong_servos(), link) as emulator:
        emulator.bus.receive = overheard = Overheard(emulator.bus)
        found = bus_findings(link, RATES, PATIENT_S, range(8))
        yield emulator, link, found, frozenset(overheard.instructions)


@pytest.fixture(scope="module")
def findings(wrong):
    return wrong[2]


def about(findings, subject, level):
    return [one for one in findings if one.subject == subject and one.level is level]


def test_servos_are_only_asked(wrong):
    assert wrong[3] == {Instruction.PING, Instruction.READ}


def test_every_servo_is_listed_with_what_it_tells(findings):
    (two,) = about(findings, "servo 2", Level.OK)
    assert two.detail == "xl330_m288, firmware 46, 1000000 bit/s, 9.0 V, 30 °C"
    assert two.facts["voltage"] == 9.0
    listed = [one.facts["id"] for one in findings if "id" in one.facts]
    assert sorted(listed) == [1, 2, 3, 4, 5]


def test_rates_at_which_nobody_answered_are_not_told_as_found(tmp_path):
    with DynamixelEmulator([EmulatedServo("xl430_w250", 1, FAST)], tmp_path / "usb"):
        found = bus_findings(tmp_path / "usb", [57600, FAST], PATIENT_S)
    assert found[0].detail == f"usb: 1 servo found at {FAST} bit/s"


def test_a_double_id_is_told(findings):
    (one,) = about(findings, "servo 1", Level.PROBLEM)
    assert one.detail == "answers with damaged bytes: probably two servos have this ID; else a cable is bad"
    assert "connect one of them alone" in one.remedy[0]
    assert "set ID of servo 1 to one that no other servo has" in one.remedy[1]


def test_a_voltage_outside_of_the_limits_is_told(findings):
    two, _ = about(findings, "servo 2", Level.PROBLEM)
    assert two.detail == "measures 9.0 V, its limits are 3.5 to 7.0 V"
    assert "5 V" in two.remedy[0]


def test_errors_are_told_in_words(findings):
    (four,) = about(findings, "servo 4", Level.PROBLEM)
    assert four.detail == "has stopped: overheated, overloaded (Hardware Error Status 0x24)"


def test_heat_is_told(findings):
    five, error = about(findings, "servo 5", Level.PROBLEM)
    assert "overheated" in error.detail
    assert five.detail == "is 75 °C hot, its limit is 72 °C"


def test_different_rates_are_told(findings):
    (bus,) = about(findings, "bus", Level.PROBLEM)
    assert "(3 at 57600 bit/s; 1, 2, 4, 5 at 1000000 bit/s)" in bus.detail


def run(line):
    subprocess.run(shlex.split(line), check=True, capture_output=True, timeout=60)


def comes_true(condition):
    """The emulator may act after the program that asked it has ended."""
    end_s = time.monotonic() + 60.0
    while not condition() and time.monotonic() < end_s:
        threading.Event().wait(0.01)
    return condition()


def test_the_command_for_another_rate_mends_it(wrong, findings):
    (bus,) = about(findings, "bus", Level.PROBLEM)
    run(bus.remedy[-1])
    assert comes_true(lambda: wrong[0].bus.servos[3].baud_rate == FAST)


def test_the_command_for_a_restart_mends_it(wrong, findings):
    (four,) = about(findings, "servo 4", Level.PROBLEM)
    run(four.remedy[-1])
    assert comes_true(lambda: wrong[0].bus.servos[4].memory["Hardware Error Status"] == 0)


def test_damaged_answers_are_told(tmp_path):
    with DynamixelEmulator([EmulatedServo("xl430_w250", 7, FAST)], tmp_path / "usb") as emulator:
        emulator.faults.damaged = 1.0
        bus, _, seven = bus_findings(tmp_path / "usb", [FAST], PATIENT_S, range(6, 9))
    assert (bus.level, "damaged" in bus.detail) == (Level.PROBLEM, True)
    assert (seven.subject, "a cable is bad" in seven.detail) == ("servo 7", True)


def test_an_echo_is_no_answer(tmp_path):
    with DynamixelEmulator([EmulatedServo("xl430_w250", 7, FAST)], tmp_path / "usb") as emulator:
        emulator.faults.echo = True
        found = bus_findings(tmp_path / "usb", [FAST], PATIENT_S)
    assert [(one.subject, one.level) for one in found] == [("bus", Level.OK), ("servo 7", Level.OK)]


def test_a_bus_without_servos_but_with_an_echo_is_told_with_what_to_look_at(tmp_path):
    with DynamixelEmulator([], tmp_path / "usb") as emulator:
        emulator.faults.echo = True
        (finding,) = bus_findings(tmp_path / "usb", [FAST], PATIENT_S)
    assert (finding.level, "no servo answers" in finding.detail) == (Level.WARNING, True)
    assert "supply" in finding.remedy[0]


def test_another_device_is_told(tmp_path):
    with DynamixelEmulator([], tmp_path / "usb") as emulator:
        emulator.bus.receive = lambda *_: [(0.0, b"$GPGGA,120000.0,,,,,0,0,,,M,,M,,*47\r\n")]
        (finding,) = bus_findings(tmp_path / "usb", [FAST], PATIENT_S)
    assert (finding.level, "another device" in finding.detail) == (Level.WARNING, True)


def test_a_port_that_cannot_be_opened_is_told(tmp_path):
    (finding,) = bus_findings(tmp_path / "usb", [FAST])
    assert finding.level is Level.PROBLEM
    assert "no serial port" in finding.detail


def test_a_rate_that_the_adapter_does_not_have_is_passed_over(tmp_path, monkeypatch):
    set_rate = ServoPort.setBaudRate

    def reject(port, rate):
        if rate == 4_500_000:
            raise ValueError("Failed to set custom baud rate")
        return set_rate(port, rate)

    monkeypatch.setattr(ServoPort, "setBaudRate", reject)
    with DynamixelEmulator([], tmp_path / "usb"):
        (finding,) = bus_findings(tmp_path / "usb", [FAST, 4_500_000], PATIENT_S)
    assert finding.detail == f"usb: no servo answers at {FAST} bit/s"


@pytest.mark.parametrize(
    ("servo", "detail"),
    [
        (
            DetectedServo(1, "xl430_w250", 1060, 45, FAST, failed=1, values={"Torque Enable": 0}),
            "failed in 1 of 3 reads",
        ),
        (DetectedServo(1, "xl430_w250", 1060, 45, FAST, failed=3), "Status Return Level"),
        (DetectedServo(1, "", 9, 45, FAST), "model 9 has no table"),
        (DetectedServo(1, "x", 8, 45, FAST, values={"Temperature Limit": 72, "Present Temperature": 62}), "62 °C hot"),
        (DetectedServo(1, "x", 8, 45, FAST, values={"Hardware Error Status": 0x80}), "unknown error, bit 7"),
    ],
)
def test_what_else_can_be_wrong(tmp_path, servo, detail):
    assert detail in servo_findings(tmp_path / "usb", servo)[1].detail


def test_registers_of_a_model_without_table_are_left_to_other_programs(tmp_path):
    twice = DetectedServo(1, "xl320", 350, 45, FAST, at_once=2)
    assert "Wizard" in servo_findings(tmp_path / "usb", twice)[1].remedy[-1]
