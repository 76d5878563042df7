"""The checker reports exactly the client's errors, before the servos execute them."""

from dataclasses import replace

import pytest
from dynamixel_sdk import PacketHandler
from hypothesis import given
from hypothesis import strategies as st

from dynamixel_emulator.bus import EmulatedBus
from dynamixel_emulator.models import XL330_M288, XL430_W250
from dynamixel_emulator.packets import BROADCAST, Instruction, Packet, PacketReader, encoded
from dynamixel_emulator.protocol_checker import MAX_FINDINGS, RATE_WINDOW_S, ProtocolChecker
from dynamixel_emulator.servo import EmulatedServo

BAUD = 57600
TORQUE, LED, GOAL, ID, WATCHDOG, VELOCITY, LIMIT = 64, 65, 116, 7, 98, 104, 48


def a_bus(servo_rules_only=False, **speeds):
    models = (XL430_W250, XL330_M288, replace(XL330_M288, firmware=52))
    servos = [EmulatedServo(model, 1 + i) for i, model in enumerate(models)]
    bus = EmulatedBus(servos, servo_rules_only=servo_rules_only)
    if speeds:
        bus.checker = ProtocolChecker(bus.servos, {int(name[1:]): speed for name, speed in speeds.items()})
    return bus


def word(value, size=2):
    return value.to_bytes(size, "little", signed=value < 0)


def write(address, value, size=1, number=1):
    return encoded(Packet(number, Instruction.WRITE, word(address) + word(value, size)))


def kinds(bus):
    return [finding.kind for finding in bus.checker.findings]


def test_a_correct_program_has_no_findings():
    bus, now_s = a_bus(n1=1000.0), 1.0
    sent = [
        encoded(Packet(BROADCAST, Instruction.PING)),
        write(LIMIT, 3000, 4),
        write(GOAL, 2048, 4),
        write(TORQUE, 1),
        write(WATCHDOG, 5),
        *(write(GOAL, 2048 + 10 * n, 4) for n in range(10)),
        encoded(Packet(BROADCAST, Instruction.SYNC_WRITE, word(GOAL) + word(4) + b"\1" + word(2148, 4))),
        encoded(
            Packet(BROADCAST, Instruction.BULK_WRITE, b"\1" + word(GOAL) + word(4) + word(2158, 4) + b"\2\x41\0\1\0\1")
        ),
        encoded(Packet(BROADCAST, Instruction.SYNC_READ, word(132) + word(4) + b"\1\2")),
        encoded(Packet(1, Instruction.REG_WRITE, word(GOAL) + word(2160, 4))),
        encoded(Packet(1, Instruction.ACTION)),
        write(WATCHDOG, 0),
        write(TORQUE, 0),
        encoded(Packet(1, Instruction.WRITE, word(168 + 56) + b"\xff\xff\xfd")),
    ]
    for data in sent:
        now_s += 0.01
        for cut in (data[:5], data[5:]):
            bus.receive(cut, BAUD, now_s)
    assert bus.checker.findings == []
    assert bus.checker.packets == len(sent)


def test_the_allowed_step_depends_on_speed_and_time():
    bus = a_bus(n1=1000.0)
    bus.receive(write(TORQUE, 1), BAUD, 1.0)
    bus.receive(write(GOAL, 2048 + 100, 4), BAUD, 1.01)  # the first goal can use the whole window
    bus.receive(write(GOAL, 2148 + 22, 4), BAUD, 1.03)
    assert kinds(bus) == []
    bus.receive(write(GOAL, 2170 + 23, 4), BAUD, 1.05)
    (finding,) = bus.checker.findings
    assert (finding.id, finding.kind) == (1, "step")
    assert finding.detail == "Goal Position goes from 2170 to 2193 within 20 ms: 1000 pulses/s allow 22 of these 23"
    bus.receive(write(GOAL, 2193 + int(1000 * RATE_WINDOW_S) + 3, 4), BAUD, 9.0)  # a pause does not allow a jump
    assert kinds(bus) == ["step", "step"]


def test_without_a_speed_the_no_load_speed_of_the_servo_applies():
    bus = a_bus()
    bus.receive(write(TORQUE, 1), BAUD, 1.0)
    bus.receive(write(GOAL, 2048 + 380, 4), BAUD, 1.01)  # 57 rev/min: 389 in 0.1 s
    assert kinds(bus) == []
    bus.receive(write(GOAL, 2048 - 380, 4), BAUD, 1.11)
    assert kinds(bus) == ["step"]


@pytest.mark.parametrize(("number", "addresses", "data"), [(1, 168, 224), (1, 578, 634), (2, 168, 224), (3, 168, 208)])
def test_a_jump_through_indirect_data_is_found(number, addresses, data):
    """ROBOTIS's ROS 2 driver sends all goals through indirect data."""
    bus = a_bus()
    for i, target in enumerate((*range(GOAL, GOAL + 4), LED, 132)):  # 132: Present Position, read-only
        bus.receive(write(addresses + 2 * i, target, 2, number), BAUD, 1.0)
    bus.receive(write(TORQUE, 1, number=number), BAUD, 1.0)
    bus.receive(write(data, 2048 + 100, 4, number), BAUD, 1.5)
    bus.receive(write(data, 2048, 5, number), BAUD, 2.0)  # and LED
    assert kinds(bus) == []
    bus.receive(write(data, 4000, 4, number), BAUD, 2.01)
    assert kinds(bus) == ["step"]
    assert bus.checker.findings[0].id == number
    bus.receive(write(data, 4000, 2, number), BAUD, 2.1)
    bus.receive(write(data + 5, 7, 1, number), BAUD, 2.1)
    assert kinds(bus) == ["step", "register", "register"]


def test_of_an_ordinary_client_only_what_servos_reject_is_found():
    """It switches torque on away from the goal, and its goals jump, as in ROBOTIS's samples."""
    findings = []
    for servo_rules_only in (False, True):
        bus = a_bus(servo_rules_only)
        bus.servos[0].memory["Hardware Error Status"] = 0x01  # voltage: not enabled in Shutdown
        for data in (write(GOAL, 0, 4), write(TORQUE, 1), write(GOAL, 4095, 4), write(GOAL, 0, 4)):
            bus.receive(data, BAUD, 1.0)
        findings.append(kinds(bus))
        bus.receive(write(ID, 7) + write(GOAL, 5000, 4) + b"hello" + write(132, 5, 4), BAUD, 2.0)
        bus.receive(write(TORQUE, 0), BAUD, 2.0)
        bus.servos[0].memory["Hardware Error Status"] = 0x20
        bus.receive(write(TORQUE, 1), BAUD, 2.0)
    assert findings == [["torque", "shut_down", "step", "step"], []]
    assert kinds(bus) == ["eeprom", "limit", "noise", "register", "shut_down"]


def test_a_value_that_no_servo_accepts_is_reported_also_where_nobody_answers():
    """As that of ROBOTIS's sample of bulk writes, whose 255 is for servos with a brighter light."""
    bus = a_bus(servo_rules_only=True)
    bus.receive(encoded(Packet(BROADCAST, Instruction.SYNC_WRITE, word(LED) + word(1) + b"\1\xff")), BAUD, 0.0)
    (finding,) = bus.checker.findings
    assert (finding.kind, finding.id) == ("range", 1)
    assert "LED 255" in finding.detail
    assert "0 to 1" in finding.detail


def test_goals_beyond_limits_are_reported():
    bus = a_bus()
    bus.receive(write(LIMIT, 3000, 4), BAUD, 1.0)
    for data in (write(GOAL, 3001, 4), write(GOAL, -1, 4), write(VELOCITY, -266, 4), write(100, 886, 2)):
        bus.receive(data, BAUD, 1.0)
    assert kinds(bus) == ["limit"] * 4
    assert bus.checker.findings[0].detail == "Goal Position 3001 is outside of 0 to 3000"


def test_torque_on_away_from_the_goal_is_reported():
    bus = a_bus()
    bus.receive(write(GOAL, 2200, 4), BAUD, 1.0)
    bus.receive(write(TORQUE, 1), BAUD, 1.1)
    assert kinds(bus) == ["torque"]
    assert "152 pulses away" in bus.checker.findings[0].detail
    bus.receive(write(TORQUE, 1), BAUD, 1.2)  # already on
    assert kinds(bus) == ["torque"]


def test_writes_to_locked_tripped_and_shut_down_servos_are_reported():
    bus = a_bus()
    bus.receive(write(TORQUE, 1) + write(ID, 3), BAUD, 1.0)
    assert kinds(bus) == ["eeprom"]
    bus.receive(write(WATCHDOG, 1), BAUD, 1.0)
    bus.run_to(2.0)
    bus.receive(write(GOAL, 2048, 4), BAUD, 2.0)
    assert kinds(bus) == ["eeprom", "watchdog"]
    bus.receive(write(TORQUE, 0), BAUD, 2.1)
    bus.servos[0].memory["Hardware Error Status"] = 0x20
    bus.receive(write(TORQUE, 1), BAUD, 2.2)
    assert kinds(bus) == ["eeprom", "watchdog", "shut_down"]


def test_invalid_writes_to_registers_are_reported():
    bus = a_bus()
    for data in (write(132, 5, 4), write(GOAL, 5, 2), write(40, 1), write(GOAL + 2, 5, 4)):
        bus.receive(data, BAUD, 1.0)
    assert set(kinds(bus)) == {"register"}
    assert bus.checker.counts["register"] >= 4


@pytest.mark.parametrize(
    ("data", "kind"),
    [
        (b"hello", "noise"),
        (encoded(Packet(1, 0x33)), "instruction"),
        (encoded(Packet(1, Instruction.STATUS, b"\0")), "instruction"),
        (encoded(Packet(1, Instruction.WRITE, b"\x40\0")), "instruction"),
        (encoded(Packet(BROADCAST, Instruction.SYNC_WRITE, word(GOAL) + word(4) + b"\1\0\0")), "instruction"),
        (encoded(Packet(BROADCAST, Instruction.BULK_WRITE, b"\1" + word(GOAL) + word(4) + b"\0")), "instruction"),
        (encoded(Packet(1, Instruction.PING))[:-1] + b"\0", "checksum"),
        (b"\xff\xff\xfd\0\1\2\0", "length"),
        (b"\xff\xff\xfd\0\1\xff\xff", "length"),
    ],
)
def test_noise_and_invalid_packets_are_reported(data, kind):
    bus = a_bus()
    bus.receive(data, BAUD, 1.0)
    assert kinds(bus)[0] == kind
    bus.receive(encoded(Packet(1, Instruction.PING)), BAUD, 1.05)
    assert bus.checker.packets >= 1


def test_an_incomplete_packet_is_reported_after_its_timeout():
    bus = a_bus()
    bus.receive(write(TORQUE, 1)[:9], BAUD, 1.0)
    assert kinds(bus) == []
    bus.receive(write(TORQUE, 0), BAUD, 2.0)
    assert kinds(bus) == ["incomplete"]


def test_the_sdks_missing_byte_stuffing_is_reported():
    class Port:
        def __init__(self):
            self.is_using, self.sent = False, b""

        def clearPort(self):  # noqa: N802 - name required by the SDK
            pass

        def writePort(self, packet):  # noqa: N802
            self.sent += bytes(packet)
            return len(packet)

    port = Port()
    PacketHandler(2.0).writeTxOnly(port, 1, 224, 4, [0xFF, 0xFF, 0xFD, 1])
    bus = a_bus()
    bus.receive(port.sent, BAUD, 1.0)
    assert kinds(bus) == ["stuffing"]


def test_only_the_first_findings_are_stored_but_all_are_counted():
    bus = a_bus()
    for number in range(MAX_FINDINGS + 5):
        bus.receive(write(132, number, 4), BAUD, 1.0)
    assert (len(bus.checker.findings), bus.checker.counts["register"]) == (MAX_FINDINGS, MAX_FINDINGS + 5)


packets = st.builds(Packet, st.integers(0, 254), st.integers(0, 255), st.binary(max_size=30))


@given(st.lists(packets | st.binary(max_size=12), max_size=8), st.lists(st.integers(1, 30), min_size=1, max_size=10))
def test_every_byte_is_yielded_once_and_valid_packets_one_at_a_time(sent, sizes):
    data = b"".join(encoded(one) if isinstance(one, Packet) else one for one in sent)
    checker, out, at, iteration = ProtocolChecker([]), [], 0, 0
    while at < len(data):
        out += checker.pieces(data[at : at + sizes[iteration % len(sizes)]], 1.0)
        at, iteration = at + sizes[iteration % len(sizes)], iteration + 1
    assert b"".join(out) == data
    reader = PacketReader()
    if all(isinstance(one, Packet) for one in sent):
        assert max((len(list(reader.feed(piece))) for piece in out), default=0) <= 1
        assert checker.packets == len(sent)
