"""The bus without a port: bytes of the manual's examples, bytes that mean nothing, servos that are missing or alike."""

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


def said(bus, packet, now_s=1.0):
    return b"".join(data for _, data in bus.receive(encoded(packet), BAUD, now_s))


def test_sync_read_answers_as_in_the_manual():
    answer = said(a_bus(), Packet(BROADCAST, Instruction.SYNC_READ, PRESENT + bytes([1, 2])))
    assert answer == bytes.fromhex("FFFFFD0001080055 00A60000008CC0" + "FFFFFD0002080055 001F080000BABE")


def test_sync_write_of_the_manual():
    bus = a_bus()
    bus.receive(bytes.fromhex("FFFFFD00FE1100837400040001960000 0002AA000000 8287".replace(" ", "")), BAUD, 1.0)
    assert [servo.memory["Goal Position"] for servo in bus.servos] == [150, 170]


def test_bulk_read_of_the_manual():
    bus = a_bus()
    bus.servos[0].voltage, bus.servos[1].temperature = 11.9, 36.0
    bus.run_to(0.0)
    question = bytes.fromhex("FFFFFD00FE0D009201900002000292000100 1A05".replace(" ", ""))
    answer = b"".join(data for _, data in bus.receive(question, BAUD, 0.0))
    assert answer == bytes.fromhex("FFFFFD000106005500 7700C369" + "FFFFFD000205005500 248BA9")


def test_a_fast_read_ends_where_a_servo_is_missing():
    bus = a_bus()
    whole = said(bus, Packet(BROADCAST, Instruction.FAST_SYNC_READ, PRESENT + bytes([1, 2])))
    cut = said(bus, Packet(BROADCAST, Instruction.FAST_SYNC_READ, PRESENT + bytes([1, 7])))
    assert len(whole) == 8 + 2 * 8
    assert cut == whole[:16]
    assert list(PacketReader().feed(cut)) == []


@pytest.mark.parametrize(("asked", "heard"), [([1, 2], [1, 2]), ([2, 7, 1], [2]), ([7, 1, 2], []), ([1, 1], [1, 1])])
def test_those_after_a_missing_one_wait_for_it_in_vain(asked, heard):
    """Each speaks after the one before it in the list (ROBOTIS in DynamixelSDK issue 364)."""
    sync = said(a_bus(), Packet(BROADCAST, Instruction.SYNC_READ, PRESENT + bytes(asked)))
    assert [packet.id for packet in PacketReader().feed(sync)] == heard
    parts = b"".join(bytes([number]) + PRESENT for number in asked)
    bulk = said(a_bus(), Packet(BROADCAST, Instruction.BULK_READ, parts))
    assert [packet.id for packet in PacketReader().feed(bulk)] == heard


def test_those_after_one_that_does_not_answer_wait_too():
    bus = a_bus()
    bus.servos[0].memory["Status Return Level"] = 0
    assert said(bus, Packet(BROADCAST, Instruction.SYNC_READ, PRESENT + bytes([1, 2]))) == b""


def test_a_fast_sync_read_of_the_manual():
    places = {3: 166.0, 7: 2079.0, 4: 1023.0}
    bus = EmulatedBus([EmulatedServo("xl330_m288", number, position=place) for number, place in places.items()])
    question = bytes.fromhex("FFFFFD00FE0A008A8400040003070420F2")
    answer = b"".join(data for _, data in bus.receive(question, BAUD, 0.0))
    assert answer == bytes.fromhex("FFFFFD00FE190055 0003A60000008408 00071F08000016CA 0004FF030000D19E")


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
def test_servos_with_one_id_speak_at_once_and_nothing_can_be_read(models, packet):
    bus = EmulatedBus([EmulatedServo(model, 4) for model in models])
    answers = bus.receive(encoded(packet), BAUD, 1.0)
    assert len(answers) == 1
    assert not [found for found in PacketReader().feed(answers[0][1]) if isinstance(found, Packet)]


def test_beside_two_servos_with_one_id_others_are_heard():
    bus = EmulatedBus([EmulatedServo("xl430_w250", number) for number in (3, 4, 4, 5)])
    answer = said(bus, Packet(BROADCAST, Instruction.SYNC_READ, PRESENT + bytes([3, 4, 5])))
    assert [found.id for found in PacketReader().feed(answer) if isinstance(found, Packet)] == [3, 5]


def test_a_secondary_id_is_obeyed_without_an_answer():
    bus = a_bus()
    for servo in bus.servos:
        servo.memory["Secondary(Shadow) ID"] = 9
    assert said(bus, Packet(9, Instruction.WRITE, bytes([65, 0, 1]))) == b""
    assert [servo.memory["LED"] for servo in bus.servos] == [1, 1]


def test_a_secondary_id_changes_nothing_that_is_kept_without_power():
    bus = a_bus()
    for servo in bus.servos:
        servo.memory["Secondary(Shadow) ID"] = 9
    assert said(bus, Packet(9, Instruction.WRITE, bytes([9, 0, 0]))) == b""
    assert said(bus, Packet(9, Instruction.FACTORY_RESET, b"\xff")) == b""
    assert [(servo.id, servo.memory["Return Delay Time"]) for servo in bus.servos] == [(1, 250), (2, 250)]


@pytest.mark.parametrize("number", [253, 255])
def test_ids_that_no_servo_can_have_switch_the_secondary_one_off(number):
    bus = a_bus()
    for servo in bus.servos:
        servo.memory["Secondary(Shadow) ID"] = number
    assert said(bus, Packet(number, Instruction.WRITE, bytes([65, 0, 1]))) == b""
    assert [servo.memory["LED"] for servo in bus.servos] == [0, 0]


@pytest.mark.parametrize(("rate", "heard"), [(57142, 2), (59300, 2), (55800, 0), (115200, 0)])
def test_a_rate_that_is_nearly_right_is_understood(rate, heard):
    assert len(a_bus().receive(encoded(Packet(BROADCAST, Instruction.PING)), rate, 1.0)) == heard


def test_a_packet_that_was_damaged_is_told_by_its_servo():
    data = bytearray(encoded(Packet(2, Instruction.READ, PRESENT)))
    data[-1] ^= 0x40
    answers = [data for _, data in a_bus().receive(bytes(data), BAUD, 1.0)]
    assert list(PacketReader().feed(b"".join(answers))) == [
        Packet(2, Instruction.STATUS, bytes([StatusError.CHECKSUM]))
    ]


def test_half_a_packet_is_forgotten_after_a_pause():
    bus, ping = a_bus(), encoded(Packet(1, Instruction.PING))
    assert bus.receive(ping[:6], BAUD, 1.0) == []
    assert len(bus.receive(ping, BAUD, 2.0)) == 1
    bus.receive(ping[:6], BAUD, 3.0)
    assert len(bus.receive(ping[6:], BAUD, 3.01)) == 1


def test_an_answer_comes_after_the_delay_that_is_set():
    bus = a_bus()
    bus.servos[0].memory["Return Delay Time"] = 100
    ((delay_s, _),) = bus.receive(encoded(Packet(1, Instruction.PING)), BAUD, 1.0)
    assert delay_s == pytest.approx(200e-6)


def test_position_goes_where_the_goal_is_not_beyond_and_then_stands():
    servo = EmulatedServo("xm430_w350", 1)
    servo.do(Instruction.WRITE, (112).to_bytes(2, "little") + (40).to_bytes(4, "little"))
    servo.do(Instruction.WRITE, (64).to_bytes(2, "little") + b"\x01")
    servo.do(Instruction.WRITE, (116).to_bytes(2, "little") + (1000).to_bytes(4, "little"))
    seen = []
    for tick in range(400):
        servo.run_to(0.01 * tick)
        seen.append(servo.position)
    assert all(later <= earlier + 1e-9 for earlier, later in itertools.pairwise(seen))
    assert abs(seen[-1] - 1000.0) < 0.5
    assert min(seen) > 999.0
    speed = (seen[20] - seen[120]) / 1.0
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
def test_whatever_is_said_to_it_the_bus_goes_on(model, packets, noise):
    bus = EmulatedBus([EmulatedServo(model, number) for number in (1, 2)])
    now_s = 0.0
    for packet in packets:
        now_s += 0.01
        bus.receive(encoded(packet) + noise, BAUD, now_s)
        bus.run_to(now_s)
    for servo in bus.servos:  # one may have another ID, rate or answer level now, but none is broken
        servo.run_to(now_s + 1.0)
        assert servo.do(Instruction.PING).data[:2] == MODELS[model].number.to_bytes(2, "little")
