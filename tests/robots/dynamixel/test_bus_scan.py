"""A scan finds every servo at every usual baud rate, tells what is wrong with it, and writes nothing."""

import pytest

from paramove.robots.dynamixel.bus_scan import scan_bus
from paramove.robots.dynamixel.emulated_servo import EmulatedServo
from paramove.robots.dynamixel.emulator import DynamixelEmulator
from paramove.robots.dynamixel.hardware_error import in_words
from paramove.robots.dynamixel.servo_chain import ServoChain
from paramove.robots.dynamixel.servo_models import XL330_M288, XL430_W250, XM430_W350
from paramove.robots.dynamixel.servo_port import ServoPort

LATENCY_S = 0.1
PAIRED = ((XL330_M288, 1), (XL430_W250, 3), (XL330_M288, 3))


def scanned(servos, *arguments, faults=None):
    with DynamixelEmulator(servos) as emulator, ServoPort(emulator.port, 1_000_000, LATENCY_S) as port:
        if faults is not None:
            emulator.faults = faults
        before = [bytes(servo.memory.read(0, 64)) for servo in servos]
        found = scan_bus(ServoChain(port), *arguments)
        assert port.baud_rate == 1_000_000
        assert [bytes(servo.memory.read(0, 64)) for servo in servos] == before
    return found


def test_servos_of_all_baud_rates_are_found():
    servos = [
        EmulatedServo(XL430_W250, 1, 57600),
        EmulatedServo(XL330_M288, 2, 1_000_000),
        EmulatedServo(XM430_W350, 1, 4_000_000),
    ]
    servos[1].memory["Hardware Error Status"] = 0x24
    servos[2].memory["Torque Enable"] = 1
    found = scanned(servos)
    assert [(one.number, one.model, one.baud_rate) for one in found.servos] == [
        (1, "xl430_w250", 57600),
        (2, "xl330_m288", 1_000_000),
        (1, "xm430_w350", 4_000_000),
    ]
    assert [one.torque for one in found.servos] == [False, False, True]
    assert found.servos[0].voltage == pytest.approx(11.1)
    assert (found.servos[0].temperature, found.servos[0].firmware) == (30, 45)
    assert in_words(found.servos[1].hardware_error) == "overheated, overloaded"
    assert found.shared_ids == ()


def test_another_baud_rate_than_configured_is_told():
    found = scanned([EmulatedServo(XL430_W250, number) for number in range(1, 6)], (57600, 1_000_000))
    assert found.findings(1_000_000) == ["found 5 servos at 57600, configured 1000000"]
    assert found.findings(57600) == found.findings() == []


def test_two_servos_of_one_id_are_told():
    """Of the same model: to a ping both say the same, but they do not stand in the same place."""
    servos = [EmulatedServo(XL330_M288, number, 1_000_000) for number in (1, 2, 2)]
    servos[2].temperature, servos[2].voltage = 41.0, 4.6
    found = scanned(servos, (1_000_000,), range(5))
    assert [one.number for one in found.servos] == [1]
    assert found.shared_ids == ((1_000_000, 2),)
    assert "ID 2 at 1000000 answers with damaged bytes: probably two servos have this ID" in found.findings()[0]


def test_two_models_of_one_id_are_told():
    """Already a ping is damaged, so IDs are asked one by one."""
    servos = [EmulatedServo(model, number, 1_000_000) for model, number in PAIRED]
    found = scanned(servos, (1_000_000,), range(5))
    assert [one.number for one in found.servos] == [1]
    assert found.shared_ids == ((1_000_000, 3),)


def test_a_baud_rate_that_the_adapter_does_not_have_is_passed_over(monkeypatch):
    set_rate = ServoPort.setBaudRate

    def refuse(port, rate):
        if rate == 4_000_000:
            raise ValueError("Failed to set custom baud rate (4000000)")
        return set_rate(port, rate)

    monkeypatch.setattr(ServoPort, "setBaudRate", refuse)
    found = scanned([EmulatedServo(XL330_M288, 1, 1_000_000)], (4_000_000, 1_000_000))
    assert ([one.number for one in found.servos], found.impossible) == ([1], (4_000_000,))


def test_a_silent_bus_has_no_servos():
    assert scanned([EmulatedServo(XL330_M288, 1, 9600)], (1_000_000,)).servos == ()


def test_unknown_bits_of_the_error_are_named():
    assert in_words(0) == ""
    assert in_words(0x81) == "input voltage out of its limits, unknown error, bit 7"
