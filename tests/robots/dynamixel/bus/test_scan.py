"""A scan finds every servo at every usual baud rate, tells what is wrong with it, and writes nothing."""

import pytest

from dynamixel_emulator.emulator import DynamixelEmulator
from dynamixel_emulator.servo import EmulatedServo
from dynamixel_emulator.wire_faults import WireFaults
from paramove.robots.dynamixel.bus.packets import Instruction, Packet, PacketReader
from paramove.robots.dynamixel.bus.scan import USUAL_BAUD_RATES, BusScan, scan_bus
from paramove.robots.dynamixel.bus.servo_chain import ServoChain
from paramove.robots.dynamixel.bus.servo_port import ServoPort
from paramove.robots.dynamixel.bus.servo_reboot import error_text

LATENCY_S = 0.1
PAIRED = (("xl330_m288", 1), ("xl430_w250", 3), ("xl330_m288", 3))


RATE = 1_000_000


@pytest.fixture(autouse=True)
def timeouts(monkeypatch):
    """Other programs may keep the emulator waiting."""
    monkeypatch.setattr("paramove.robots.dynamixel.bus.scan.SHORT_LATENCY_S", LATENCY_S)


class Overheard:
    """Packets that came over a bus."""

    def __init__(self, bus):
        self.packets, self._receive, self._reader = list[Packet](), bus.receive, PacketReader()

    def __call__(self, data, baud_rate, now_s):
        self.packets += self._reader.feed(data)
        return self._receive(data, baud_rate, now_s)


def scanned(servos, *arguments, faults=None, receive=None):
    with DynamixelEmulator(servos) as emulator, ServoPort(emulator.port, RATE, LATENCY_S) as port:
        if faults is not None:
            emulator.faults = faults
        if receive is not None:
            emulator.bus.receive = receive(emulator.bus.receive)
        emulator.bus.receive = overheard = Overheard(emulator.bus)
        before = [bytes(servo.memory.read(0, 64)) for servo in servos]
        found = scan_bus(ServoChain(port), *arguments)
        assert port.baud_rate == RATE
        assert [bytes(servo.memory.read(0, 64)) for servo in servos] == before
        assert {one.instruction for one in overheard.packets} <= {Instruction.PING, Instruction.READ}
    return found


def faults_by_id(found):
    return {one.number: one.fault for one in found.servos}


def test_servos_of_all_baud_rates_are_found():
    servos = [
        EmulatedServo("xl430_w250", 1, 57600),
        EmulatedServo("xl330_m288", 2, 1_000_000),
        EmulatedServo("xm430_w350", 1, 4_000_000),
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
    assert (found.servos[0].temperature, found.servos[0].firmware) == (30, 46)
    assert error_text(found.servos[1].hardware_error) == "overheated, overloaded"
    assert (found.asked, found.findings()) == (list(USUAL_BAUD_RATES), [])


@pytest.mark.parametrize("rate", [9_600, 4_500_000])
def test_the_slowest_and_the_fastest_baud_rate_of_servos_are_among_the_usual_ones(rate):
    found = scanned([EmulatedServo("xm430_w350", 1, rate)])
    assert [(one.number, one.baud_rate) for one in found.servos] == [(1, rate)]


class OlderServos:
    """Servos 1 and 3 that understand Protocol 1.0 only, with model number 12, on a bus."""

    def __init__(self, _receive, ids=(1, 3)):
        self._ids = ids

    def __call__(self, data, baud_rate, now_s):
        begins = data[:2] == b"\xff\xff" and data[2] in self._ids and data[3] == len(data) - 4
        if baud_rate != RATE or not begins or data[-1] != ~sum(data[2:-1]) & 255:
            return []
        values = b"\x0c\x00" if data[4] == 2 else b""  # read; else ping
        body = bytes([data[2], 2 + len(values), 0]) + values
        return [(0.0, b"\xff\xff" + body + bytes([~sum(body) & 255]))]


def test_servos_of_protocol_1_are_named_with_id_and_model_number():
    found = scanned([], receive=OlderServos)
    assert [(one.number, one.model_number, one.baud_rate) for one in found.older] == [(1, 12, RATE), (3, 12, RATE)]
    assert found.servos == []
    assert all("Protocol 1.0" in message for message in found.findings())
    assert len(found.findings()) == 2


def test_a_reply_to_every_id_is_no_servo_of_protocol_1():
    found = scanned([], receive=lambda receive: OlderServos(receive, ids=range(254)))
    assert found.older == []


def test_a_model_that_only_the_sdk_knows_is_told_with_its_state_and_another_by_its_number():
    servos = [EmulatedServo("xl430_w250", number, RATE) for number in (1, 2)]
    servos[0].memory["Model Number"], servos[1].memory["Model Number"] = 1080, 9
    known, unknown = scanned(servos, (RATE,)).servos
    assert (known.name, known.table, known.voltage, known.torque) == ("xc430_w240", None, 11.1, False)
    assert known.values["Temperature Limit"] == 72
    assert (unknown.model, unknown.name, unknown.voltage, unknown.fault) == ("", "model 9", None, "")


def test_another_baud_rate_than_configured_is_told():
    found = scanned([EmulatedServo("xl430_w250", number) for number in range(1, 6)], (57600, 1_000_000))
    assert found.findings(1_000_000) == ["found 5 servos at 57600, configured 1000000"]
    assert found.findings(57600) == found.findings() == []


PROBABLY = "answers with damaged bytes: probably two servos have this ID"


def test_two_servos_of_one_id_are_told():
    """Of the same model: to a ping both say the same, but they do not stand in the same place."""
    servos = [EmulatedServo("xl330_m288", number, RATE) for number in (1, 2, 2)]
    servos[2].temperature, servos[2].voltage = 41.0, 4.6
    found = scanned(servos, (RATE,), range(5))
    assert [(one.number, one.has_duplicate_id) for one in found.servos] == [(1, False), (2, True)]
    (finding,) = found.findings()
    assert finding.startswith(f"ID 2 at {RATE} {PROBABLY}")
    assert "connect one of them alone and give it another ID" in finding


def test_two_models_of_one_id_are_told():
    """Already a ping is damaged, so IDs are asked one by one."""
    found = scanned([EmulatedServo(model, number, RATE) for model, number in PAIRED], (RATE,), range(5))
    assert [(one.number, one.has_duplicate_id) for one in found.servos] == [(1, False), (3, True)]
    assert (found.servos[1].name, found.servos[1].model_number) == ("unknown model", 0)


def test_two_servos_of_one_id_alone_are_no_other_device():
    found = scanned([EmulatedServo(model, number, RATE) for model, number in PAIRED[1:]], (RATE,), range(5))
    assert ([one.number for one in found.servos], found.foreign) == ([3], [])


def test_two_servos_of_one_id_that_answer_one_after_the_other_are_counted():
    def twice(receive):
        return lambda *heard: [answer for one in receive(*heard) for answer in (one, one)]

    found = scanned([EmulatedServo("xl330_m288", 2, RATE)], (RATE,), receive=twice)
    assert faults_by_id(found) == {2: "answers 2 times to one question: 2 servos have this ID"}


def test_an_id_whose_reads_alone_are_damaged_is_told():
    """As of two servos that say the same to a ping, at the very same time."""

    def damaged_reads(receive):
        def damaged(*heard):
            return [(after_s, data if len(data) < 20 else data[:-1] + b"?") for after_s, data in receive(*heard)]

        return damaged

    found = scanned([EmulatedServo("xl330_m288", 2, RATE)], (RATE,), receive=damaged_reads)
    assert faults_by_id(found)[2].startswith(PROBABLY)
    assert found.servos[0].model == "xl330_m288"


def test_a_servo_that_answers_to_pings_alone_is_told():
    servo = EmulatedServo("xl330_m288", 2, RATE)
    servo.memory["Status Return Level"] = 0
    (finding,) = scanned([servo], (RATE,)).findings()
    assert finding.startswith(f"ID 2 at {RATE} failed in 3 of 3 reads")
    assert "Status Return Level (68) is 0" in finding


def test_damaged_answers_are_told():
    found = scanned([EmulatedServo("xl430_w250", 2, RATE)], (RATE,), range(4), faults=WireFaults(damaged=1.0, seed=1))
    assert found.damaged == [RATE]
    assert found.findings()[0].startswith(f"answers at {RATE} bit/s are damaged")
    assert faults_by_id(found)[2].startswith(PROBABLY)


def test_noise_around_sound_answers_is_no_fault():
    servos = [EmulatedServo("xl430_w250", number, RATE) for number in (1, 2)]
    found = scanned(servos, (RATE,), range(4), faults=WireFaults(noisy=1.0))
    assert faults_by_id(found) == {1: "", 2: ""}
    assert found.findings() == []


def test_one_disturbance_makes_no_servo():
    """Who asks on hears that nobody has the ID."""

    def disturbed(receive):
        noise = iter([b"noise", b"noise"])  # after the ping of all, and that of ID 0
        return lambda *heard: [*receive(*heard), (0.0, next(noise, b""))]

    assert scanned([], (RATE,), range(2), receive=disturbed).servos == []


def test_damage_now_and_then_is_told_as_failed_reads():
    """Also where a sound answer comes with it: it may be another servo's."""
    servos = [EmulatedServo("xl430_w250", 2, RATE)]

    def damaged_once(receive):
        spoilt = iter([False, True])

        def damaged(*heard):
            return [(s, data[:-1] + b"?" + data if next(spoilt, False) else data) for s, data in receive(*heard)]

        return damaged

    found = scanned(servos, (RATE,), receive=damaged_once)
    assert faults_by_id(found) == {2: "failed in 1 of 3 reads: another servo with this ID, or a bad cable"}
    assert found.servos[0].torque is False


def test_another_device_is_told_and_not_taken_for_servos():
    found = scanned([], (RATE,), receive=lambda _: lambda *_: [(0.0, b"$GPGGA,120000.0,,,,,0,0,,,M,,M,,*47\r\n")])
    assert (found.servos, found.foreign) == ([], [RATE])
    assert "another device" in found.findings()[0]


def test_an_echo_is_no_answer():
    servos = [EmulatedServo("xl430_w250", 2, RATE)]
    assert faults_by_id(scanned(servos, (RATE,), faults=WireFaults(echo=True))) == {2: ""}


def test_a_baud_rate_that_the_adapter_does_not_have_is_passed_over(monkeypatch):
    set_rate = ServoPort.setBaudRate

    def reject(port, rate):
        if rate == 4_000_000:
            raise ValueError("Failed to set custom baud rate (4000000)")
        return set_rate(port, rate)

    monkeypatch.setattr(ServoPort, "setBaudRate", reject)
    found = scanned([EmulatedServo("xl330_m288", 1, 1_000_000)], (4_000_000, 1_000_000))
    assert ([one.number for one in found.servos], found.asked) == ([1], [RATE])


def test_a_silent_bus_has_no_servos():
    assert scanned([EmulatedServo("xl330_m288", 1, 9600)], (RATE,)) == BusScan(asked=[RATE])


def test_unknown_bits_of_the_error_are_named():
    assert error_text(0) == ""
    assert error_text(0x81) == "input voltage out of its limits, unknown error, bit 7"
