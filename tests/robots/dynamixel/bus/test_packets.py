"""Packets are those of the manual's examples and of the SDK, whatever is in them and however they come in."""

import pytest
from dynamixel_sdk import Protocol2PacketHandler
from hypothesis import given, settings
from hypothesis import strategies as st

from paramove.robots.dynamixel.bus.packets import (
    BROADCAST,
    HEADER,
    DamagedPacket,
    Instruction,
    Packet,
    PacketReader,
    encoded,
)

tricky_bytes = st.lists(st.sampled_from([0xFF, 0xFD, 0x00, 0x55]) | st.integers(0, 255), max_size=40).map(bytes)
packets = st.builds(Packet, st.integers(0, 252), st.sampled_from(list(Instruction)).map(int), tricky_bytes)


@pytest.mark.parametrize(
    ("packet", "wire"),
    [
        (Packet(1, Instruction.PING), "FFFFFD00010300011 94E"),
        (Packet(BROADCAST, Instruction.PING), "FFFFFD00FE0300013142"),
        (Packet(1, Instruction.READ, bytes([0x84, 0, 4, 0])), "FFFFFD0001070002840004001D15"),
        (Packet(1, Instruction.STATUS, bytes([0, 0xA6, 0, 0, 0])), "FFFFFD0001080055 00A60000008CC0"),
        (Packet(1, Instruction.CLEAR, bytes([1, 0x44, 0x58, 0x4C, 0x22])), "FFFFFD0001080010 0144584C22B1DC"),
    ],
)
def test_examples_of_the_manual(packet, wire):
    assert encoded(packet) == bytes.fromhex(wire.replace(" ", ""))


class Wire:
    """Takes what the SDK writes, and gives what it shall read."""

    def __init__(self, incoming=b""):
        self.is_using = False
        self.written, self.incoming = b"", incoming

    def clearPort(self):  # noqa: N802 - the SDK's name
        pass

    def writePort(self, packet):  # noqa: N802
        self.written = bytes(packet)
        return len(packet)

    def readPort(self, length):  # noqa: N802
        taken, self.incoming = self.incoming[:length], self.incoming[length:]
        return taken

    def isPacketTimeout(self):  # noqa: N802
        return True


@given(packets.filter(lambda packet: HEADER not in packet.parameters))
def test_the_sdk_writes_the_same(packet):
    """But where bytes must be stuffed: version 4.1.0 forgets the longer packet that it made and sends the bare one."""
    wire = Wire()
    sent = [0, 0, 0, 0, packet.id, 0, 0, packet.instruction, *packet.parameters, 0, 0]
    sent[5:7] = (len(packet.parameters) + 3).to_bytes(2, "little")
    Protocol2PacketHandler().txPacket(wire, sent)
    assert wire.written == encoded(packet)


def test_the_sdk_does_not_stuff():
    """The day it does, `ServoPort` must not do it a second time."""
    wire = Wire()
    Protocol2PacketHandler().txPacket(wire, [0, 0, 0, 0, 1, 6, 0, Instruction.WRITE, *HEADER, 0, 0])
    assert wire.written[7:-2] == bytes([Instruction.WRITE]) + HEADER


@settings(derandomize=True)  # some bytes the SDK misreads: the next test
@given(st.integers(0, 252), tricky_bytes)
def test_the_sdk_reads_the_same(number, parameters):
    read, result = Protocol2PacketHandler().rxPacket(
        Wire(encoded(Packet(number, Instruction.STATUS, b"\0" + parameters))), False
    )
    assert result == 0
    assert bytes(read[9 : 9 + len(parameters)]) == parameters


def test_the_sdk_misreads_bytes_behind_stuffed_ones():
    """Version 4.1.0 looks for stuffing where it has already moved bytes; the driver reads with `PacketReader`."""
    packet = Packet(1, Instruction.STATUS, b"\0\xff\xff\xfd\xff\xfd\xfd")
    read, _ = Protocol2PacketHandler().rxPacket(Wire(encoded(packet)), False)
    assert bytes(read[8:15]) != packet.parameters
    assert list(PacketReader().feed(encoded(packet))) == [packet]


@given(st.lists(packets, min_size=1, max_size=4), st.lists(st.integers(1, 30), min_size=1, max_size=20))
def test_packets_come_out_as_they_went_in_in_any_pieces(sent, pieces):
    data, reader, found, at = b"".join(map(encoded, sent)), PacketReader(), [], 0
    while at < len(data):
        size = pieces[at % len(pieces)]
        found += reader.feed(data[at : at + size])
        at += size
    assert found == sent


@given(packets, tricky_bytes.filter(lambda noise: HEADER not in noise and not noise.endswith((b"\xff", b"\xfd"))))
def test_noise_before_a_packet_is_passed_over(packet, noise):
    assert list(PacketReader().feed(noise + encoded(packet))) == [packet]


@given(packets, st.integers(0, 10**6), st.integers(1, 255))
def test_a_changed_byte_is_never_taken_for_a_packet(packet, place, change):
    data = bytearray(encoded(packet))
    data[place % len(data)] ^= change
    assert packet not in list(PacketReader().feed(bytes(data)))


def test_a_damaged_packet_is_told_and_the_next_one_is_read():
    good, bad = encoded(Packet(7, Instruction.PING)), bytearray(encoded(Packet(3, Instruction.READ, bytes(4))))
    bad[-3] ^= 1
    assert list(PacketReader().feed(bytes(bad) + good)) == [DamagedPacket(3), Packet(7, Instruction.PING)]
