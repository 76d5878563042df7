"""The bus without a port: examples of the manual, noise, missing servos and duplicate IDs."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dynamixel_emulator.bus import EmulatedBus
from dynamixel_emulator.models import MODELS, XL330_M288, XL430_W250
from dynamixel_emulator.packets import BROADCAST, Instruction, Packet, PacketReader, StatusError, encoded
from dynamixel_emulator.servo import EmulatedServo

BAUD = 57600
PRESENT = (132).to_bytes(2, "little") + (4).to_bytes(2, "little")


def a_bus():
    return EmulatedBus(
        [EmulatedServo("xm430_w350", 1, position=166.0), EmulatedServo("xm430_w350", 2, position=2079.0)]
    )


def replies(bus, packet, now_s=1.0):
    return b"".join(data for _, data in bus.receive(encoded(packet), BAUD, now_s))


def test_sync_read_of_the_manual():
    received = replies(a_bus(), Packet(BROADCAST, Instruction.SYNC_READ, PRESENT + bytes([1, 2])))
    assert received == bytes.fromhex("FFFFFD0001080055 00A60000008CC0" + "FFFFFD0002080055 001F080000BABE")


def test_sync_write_of_the_manual():
    bus = a_bus()
    bus.receive(bytes.fromhex("FFFFFD00FE1100837400040001960000 0002AA000000 8287".replace(" ", "")), BAUD, 1.0)
    assert [servo.memory["Goal Position"] for servo in bus.servos] == [150, 170]


def test_bulk_read_of_the_manual():
    bus = a_bus()
    bus.servos[0].voltage, bus.servos[1].temperature = 11.9, 36.0
    bus.run_to(0.0)
    request = bytes.fromhex("FFFFFD00FE0D009201900002000292000100 1A05".replace(" ", ""))
    received = b"".join(data for _, data in bus.receive(request, BAUD, 0.0))
    assert received == bytes.fromhex("FFFFFD000106005500 7700C369" + "FFFFFD000205005500 248BA9")


def test_a_fast_read_ends_at_a_missing_servo():
    bus = a_bus()
    complete = replies(bus, Packet(BROADCAST, Instruction.FAST_SYNC_READ, PRESENT + bytes([1, 2])))
    cut = replies(bus, Packet(BROADCAST, Instruction.FAST_SYNC_READ, PRESENT + bytes([1, 7])))
    assert len(complete) == 8 + 2 * 8
    assert cut == complete[:16]
    assert list(PacketReader().feed(cut)) == []


@pytest.mark.parametrize(
    ("requested", "received"), [([1, 2], [1, 2]), ([2, 7, 1], [2]), ([7, 1, 2], []), ([1, 1], [1, 1])]
)
def test_servos_after_a_missing_one_do_not_reply(requested, received):
    """Each replies after its predecessor in the list (ROBOTIS in DynamixelSDK issue 364)."""
    sync = replies(a_bus(), Packet(BROADCAST, Instruction.SYNC_READ, PRESENT + bytes(requested)))
    assert [packet.id for packet in PacketReader().feed(sync)] == received
    parts = b"".join(bytes([number]) + PRESENT for number in requested)
    bulk = replies(a_bus(), Packet(BROADCAST, Instruction.BULK_READ, parts))
    assert [packet.id for packet in PacketReader().feed(bulk)] == received


def test_servos_after_one_without_status_return_do_not_reply():
    bus = a_bus()
    bus.servos[0].memory["Status Return Level"] = 0
    assert replies(bus, Packet(BROADCAST, Instruction.SYNC_READ, PRESENT + bytes([1, 2]))) == b""


def test_a_fast_sync_read_of_the_manual():
    positions = {3: 166.0, 7: 2079.0, 4: 1023.0}
    bus = EmulatedBus(
        [EmulatedServo("xl330_m288", number, position=position) for number, position in positions.items()]
    )
    request = bytes.fromhex("FFFFFD00FE0A008A8400040003070420F2")
    received = b"".join(data for _, data in bus.receive(request, BAUD, 0.0))
    assert received == bytes.fromhex("FFFFFD00FE190055 0003A60000008408 00071F08000016CA 0004FF030000D19E")


@pytest.mark.parametrize("models", [(XL430_W250, XL330_M288), (XL430_W250, XL430_W250)])
@pytest.mark.parametrize(
    "packet",
    [
        Packet(4, Instruction.PING),
        Packet(4, Instruction.READ, PRESENT),
        Packet(BROADCAST, Instruction.PING),
        Packet(BROADCAST, Instruction.SYNC_READ, PRESENT + bytes([4])),
        Packet(BROADCAST, Instruction.FAST_SYNC_READ, PRESENT + bytes([4])),
    ],
)
def test_simultaneous_replies_of_servos_with_the_same_id_are_unreadable(models, packet):
    bus = EmulatedBus([EmulatedServo(model, 4) for model in models])
    received = bus.receive(encoded(packet), BAUD, 1.0)
    assert len(received) == 1
    assert not [found for found in PacketReader().feed(received[0][1]) if isinstance(found, Packet)]


def test_other_servos_reply_despite_a_duplicate_id():
    bus = EmulatedBus([EmulatedServo("xl430_w250", number) for number in (3, 4, 4, 5)])
    received = replies(bus, Packet(BROADCAST, Instruction.SYNC_READ, PRESENT + bytes([3, 4, 5])))
    assert [found.id for found in PacketReader().feed(received) if isinstance(found, Packet)] == [3, 5]


def test_an_instruction_to_a_secondary_id_is_executed_without_a_reply():
    bus = a_bus()
    for servo in bus.servos:
        servo.memory["Secondary(Shadow) ID"] = 9
    assert replies(bus, Packet(9, Instruction.WRITE, bytes([65, 0, 1]))) == b""
    assert [servo.memory["LED"] for servo in bus.servos] == [1, 1]


def test_an_instruction_to_a_secondary_id_does_not_change_eeprom():
    bus = a_bus()
    for servo in bus.servos:
        servo.memory["Secondary(Shadow) ID"] = 9
    assert replies(bus, Packet(9, Instruction.WRITE, bytes([9, 0, 0]))) == b""
    assert replies(bus, Packet(9, Instruction.FACTORY_RESET, b"\xff")) == b""
    assert [(servo.id, servo.memory["Return Delay Time"]) for servo in bus.servos] == [(1, 250), (2, 250)]


@pytest.mark.parametrize("number", [253, 255])
def test_invalid_ids_disable_the_secondary_id(number):
    bus = a_bus()
    for servo in bus.servos:
        servo.memory["Secondary(Shadow) ID"] = number
    assert replies(bus, Packet(number, Instruction.WRITE, bytes([65, 0, 1]))) == b""
    assert [servo.memory["LED"] for servo in bus.servos] == [0, 0]


@pytest.mark.parametrize(("rate", "n_replies"), [(57142, 2), (59300, 2), (55800, 0), (115200, 0)])
def test_a_small_error_of_the_baud_rate_is_tolerated(rate, n_replies):
    assert len(a_bus().receive(encoded(Packet(BROADCAST, Instruction.PING)), rate, 1.0)) == n_replies


def test_a_servo_reports_a_damaged_packet():
    data = bytearray(encoded(Packet(2, Instruction.READ, PRESENT)))
    data[-1] ^= 0x40
    received = [data for _, data in a_bus().receive(bytes(data), BAUD, 1.0)]
    assert list(PacketReader().feed(b"".join(received))) == [
        Packet(2, Instruction.STATUS, bytes([StatusError.CHECKSUM]))
    ]


def test_an_incomplete_packet_is_discarded_after_a_pause():
    bus, ping = a_bus(), encoded(Packet(1, Instruction.PING))
    assert bus.receive(ping[:6], BAUD, 1.0) == []
    assert len(bus.receive(ping, BAUD, 2.0)) == 1
    bus.receive(ping[:6], BAUD, 3.0)
    assert len(bus.receive(ping[6:], BAUD, 3.01)) == 1


def test_a_reply_has_the_configured_delay():
    bus = a_bus()
    bus.servos[0].memory["Return Delay Time"] = 100
    ((delay_s, _),) = bus.receive(encoded(Packet(1, Instruction.PING)), BAUD, 1.0)
    assert delay_s == pytest.approx(200e-6)


def test_position_reaches_the_goal_without_overshoot_and_stops():
    servo = EmulatedServo("xm430_w350", 1)
    servo.do(Instruction.WRITE, (112).to_bytes(2, "little") + (40).to_bytes(4, "little"))
    servo.do(Instruction.WRITE, (64).to_bytes(2, "little") + b"\x01")
    servo.do(Instruction.WRITE, (116).to_bytes(2, "little") + (1000).to_bytes(4, "little"))
    positions = []
    for tick in range(400):
        servo.run_to(0.01 * tick)
        positions.append(servo.position)
    assert all(later <= earlier + 1e-9 for earlier, later in itertools.pairwise(positions))
    assert abs(positions[-1] - 1000.0) < 0.5
    assert min(positions) > 999.0
    speed = (positions[20] - positions[120]) / 1.0
    assert abs(speed - 40 * 0.229 * 4096 / 60) < 1.0


numbers = st.integers(0, 255)
instructions = st.sampled_from(list(Instruction)).map(int) | numbers
words = st.sampled_from([0, 7, 8, 11, 64, 98, 116, 132, 168, 224, 578, 634, 661, 662, 65535]).map(
    lambda value: value.to_bytes(2, "little")
)
contents = st.one_of(
    st.binary(max_size=40),
    st.builds(lambda address, data: address + data, words, st.binary(max_size=8)),
    st.builds(lambda address, size, rest: address + size + rest, words, words, st.binary(max_size=20)),
)


@given(
    st.sampled_from(sorted(MODELS)),
    st.lists(st.builds(Packet, st.sampled_from([1, 2, 3, BROADCAST]), instructions, contents), max_size=12),
    st.binary(max_size=30),
)
def test_any_received_bytes_leave_the_bus_working(model, packets, noise):
    bus = EmulatedBus([EmulatedServo(model, number) for number in (1, 2)])
    now_s = 0.0
    for packet in packets:
        now_s += 0.01
        bus.receive(encoded(packet) + noise, BAUD, now_s)
        bus.run_to(now_s)
    for servo in bus.servos:  # ID, baud rate or status return level can differ now, but every servo works
        servo.run_to(now_s + 1.0)
        assert servo.do(Instruction.PING).data[:2] == MODELS[model].number.to_bytes(2, "little")
