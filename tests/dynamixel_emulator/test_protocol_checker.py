"""The judge finds what should not be sent, only that, and before it has an effect."""

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
        bus.judge = ProtocolChecker(bus.servos, {int(name[1:]): speed for name, speed in speeds.items()})
    return bus


def word(value, size=2):
    return value.to_bytes(size, "little", signed=value < 0)


def write(address, value, size=1, number=1):
    return encoded(Packet(number, Instruction.WRITE, word(address) + word(value, size)))


def kinds(bus):
    return [finding.kind for finding in bus.judge.findings]


def test_a_sound_program_is_found_nothing_of():
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
    assert bus.judge.findings == []
    assert bus.judge.packets == len(sent)


def test_a_step_is_as_large_as_rate_and_time_allow():
    bus = a_bus(n1=1000.0)
    bus.receive(write(TORQUE, 1), BAUD, 1.0)
    bus.receive(write(GOAL, 2048 + 100, 4), BAUD, 1.01)  # the first may use the whole window
    bus.receive(write(GOAL, 2148 + 22, 4), BAUD, 1.03)
    assert kinds(bus) == []
    bus.receive(write(GOAL, 2170 + 23, 4), BAUD, 1.05)
    (found,) = bus.judge.findings
    assert (found.id, found.kind) == (1, "step")
    assert found.detail == "Goal Position goes from 2170 to 2193 within 20 ms: 1000 pulses/s allow 22 of these 23"
    bus.receive(write(GOAL, 2193 + int(1000 * RATE_WINDOW_S) + 3, 4), BAUD, 9.0)  # a pause allows no jump
    assert kinds(bus) == ["step", "step"]


def test_without_a_rate_the_speed_of_the_servo_counts():
    bus = a_bus()
    bus.receive(write(TORQUE, 1), BAUD, 1.0)
    bus.receive(write(GOAL, 2048 + 380, 4), BAUD, 1.01)  # 57 rev/min: 389 in 0.1 s
    assert kinds(bus) == []
    bus.receive(write(GOAL, 2048 - 380, 4), BAUD, 1.11)
    assert kinds(bus) == ["step"]


@pytest.mark.parametrize(("number", "addresses", "data"), [(1, 168, 224), (1, 578, 634), (2, 168, 224), (3, 168, 208)])
def test_a_jump_through_indirect_data_is_found(number, addresses, data):
    """ROBOTIS's ROS 2 driver sends all goals so."""
    bus = a_bus()
    for i, place in enumerate((*range(GOAL, GOAL + 4), LED, 132)):  # the last one is of Present Position
        bus.receive(write(addresses + 2 * i, place, 2, number), BAUD, 1.0)
    bus.receive(write(TORQUE, 1, number=number), BAUD, 1.0)
    bus.receive(write(data, 2048 + 100, 4, number), BAUD, 1.5)
    bus.receive(write(data, 2048, 5, number), BAUD, 2.0)  # LED too
    assert kinds(bus) == []
    bus.receive(write(data, 4000, 4, number), BAUD, 2.01)
    assert kinds(bus) == ["step"]
    assert bus.judge.findings[0].id == number
    bus.receive(write(data, 4000, 2, number), BAUD, 2.1)
    bus.receive(write(data + 5, 7, 1, number), BAUD, 2.1)
    assert kinds(bus) == ["step", "register", "register"]


def test_of_an_ordinary_client_only_what_servos_reject_is_found():
    """It switches torque on with the goal elsewhere and jumps; as ROBOTIS's samples do."""
    found = []
    for servo_rules_only in (False, True):
        bus = a_bus(servo_rules_only)
        bus.servos[0].memory["Hardware Error Status"] = 0x01  # of the voltage: Shutdown does not name it
        for data in (write(GOAL, 0, 4), write(TORQUE, 1), write(GOAL, 4095, 4), write(GOAL, 0, 4)):
            bus.receive(data, BAUD, 1.0)
        found.append(kinds(bus))
        bus.receive(write(ID, 7) + write(GOAL, 5000, 4) + b"hello" + write(132, 5, 4), BAUD, 2.0)
        bus.receive(write(TORQUE, 0), BAUD, 2.0)
        bus.servos[0].memory["Hardware Error Status"] = 0x20
        bus.receive(write(TORQUE, 1), BAUD, 2.0)
    assert found == [["torque", "shut_down", "step", "step"], []]
    assert kinds(bus) == ["eeprom", "limit", "noise", "register", "shut_down"]


def test_goals_beyond_limits_are_found():
    bus = a_bus()
    bus.receive(write(LIMIT, 3000, 4), BAUD, 1.0)
    for data in (write(GOAL, 3001, 4), write(GOAL, -1, 4), write(VELOCITY, -266, 4), write(100, 886, 2)):
        bus.receive(data, BAUD, 1.0)
    assert kinds(bus) == ["limit"] * 4
    assert bus.judge.findings[0].detail == "Goal Position 3001 is outside of 0 to 3000"


def test_torque_must_not_come_on_with_the_goal_elsewhere():
    bus = a_bus()
    bus.receive(write(GOAL, 2200, 4), BAUD, 1.0)
    bus.receive(write(TORQUE, 1), BAUD, 1.1)
    assert kinds(bus) == ["torque"]
    assert "152 pulses away" in bus.judge.findings[0].detail
    bus.receive(write(TORQUE, 1), BAUD, 1.2)  # is on already
    assert kinds(bus) == ["torque"]


def test_eeprom_with_torque_on_a_tripped_watchdog_and_a_shut_down_servo_are_found():
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


def test_registers_that_cannot_be_written_so_are_found():
    bus = a_bus()
    for data in (write(132, 5, 4), write(GOAL, 5, 2), write(40, 1), write(GOAL + 2, 5, 4)):
        bus.receive(data, BAUD, 1.0)
    assert set(kinds(bus)) == {"register"}
    assert bus.judge.counts["register"] >= 4


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
def test_what_is_no_packet_or_none_that_means_something_is_found(data, kind):
    bus = a_bus()
    bus.receive(data, BAUD, 1.0)
    assert kinds(bus)[0] == kind
    bus.receive(encoded(Packet(1, Instruction.PING)), BAUD, 1.05)
    assert bus.judge.packets >= 1


def test_half_a_packet_is_found_when_its_time_is_over():
    bus = a_bus()
    bus.receive(write(TORQUE, 1)[:9], BAUD, 1.0)
    assert kinds(bus) == []
    bus.receive(write(TORQUE, 0), BAUD, 2.0)
    assert kinds(bus) == ["incomplete"]


def test_the_bare_header_that_the_sdk_sends_is_found():
    class Port:
        def __init__(self):
            self.is_using, self.sent = False, b""

        def clearPort(self):  # noqa: N802 - called so by the SDK
            pass

        def writePort(self, packet):  # noqa: N802
            self.sent += bytes(packet)
            return len(packet)

    port = Port()
    PacketHandler(2.0).writeTxOnly(port, 1, 224, 4, [0xFF, 0xFF, 0xFD, 1])
    bus = a_bus()
    bus.receive(port.sent, BAUD, 1.0)
    assert kinds(bus) == ["stuffing"]


def test_only_the_first_findings_are_kept_but_all_are_counted():
    bus = a_bus()
    for number in range(MAX_FINDINGS + 5):
        bus.receive(write(132, number, 4), BAUD, 1.0)
    assert (len(bus.judge.findings), bus.judge.counts["register"]) == (MAX_FINDINGS, MAX_FINDINGS + 5)


packets = st.builds(Packet, st.integers(0, 254), st.integers(0, 255), st.binary(max_size=30))


@given(st.lists(packets | st.binary(max_size=12), max_size=8), st.lists(st.integers(1, 30), min_size=1, max_size=10))
def test_every_byte_is_handed_on_once_and_sound_packets_one_at_a_time(said, sizes):
    data = b"".join(encoded(one) if isinstance(one, Packet) else one for one in said)
    judge, out, at, turn = ProtocolChecker([]), [], 0, 0
    while at < len(data):
        out += judge.pieces(data[at : at + sizes[turn % len(sizes)]], 1.0)
        at, turn = at + sizes[turn % len(sizes)], turn + 1
    assert b"".join(out) == data
    reader = PacketReader()
    if all(isinstance(one, Packet) for one in said):
        assert max((len(list(reader.feed(piece))) for piece in out), default=0) <= 1
        assert judge.packets == len(said)
