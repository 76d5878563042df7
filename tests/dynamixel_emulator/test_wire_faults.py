"""Each fault affects the requested fraction of replies; the same seed affects the same replies."""

import pytest

from dynamixel_emulator.errors import EmulatorError
from dynamixel_emulator.packets import DamagedPacket, Instruction, Packet, PacketReader, encoded
from dynamixel_emulator.wire_faults import WireFaults

REQUEST = encoded(Packet(4, Instruction.READ, bytes([132, 0, 4, 0])))
REPLY = Packet(4, Instruction.STATUS, bytes([0, 0x1F, 8, 0, 0]))


def received(faults, times=400):
    """Bytes that a client receives for each of this many requests."""
    return [faults.apply(REQUEST, [(0.0005, encoded(REPLY))]) for _ in range(times)]


def packets(received_bytes):
    return [list(PacketReader().feed(b"".join(data for _, data in one))) for one in received_bytes]


def test_without_faults_replies_are_unchanged():
    assert received(WireFaults(), 3) == [[(0.0005, encoded(REPLY))]] * 3


def test_the_requested_fraction_of_replies_is_lost():
    assert 0.2 < sum(one == [] for one in received(WireFaults(lost=0.25))) / 400 < 0.3


def test_the_same_seed_gives_the_same_faults():
    kinds = {"lost": 0.1, "damaged": 0.3, "cut": 0.1, "noisy": 0.2, "bare": 0.1, "foreign": 0.1, "late": 0.3}
    assert received(WireFaults(**kinds, seed=3)) == received(WireFaults(**kinds, seed=3))
    assert received(WireFaults(**kinds, seed=3)) != received(WireFaults(**kinds, seed=4))


def test_damaged_and_cut_replies_are_never_decoded():
    for faults in (WireFaults(damaged=1.0), WireFaults(cut=1.0)):
        assert all(REPLY not in found for found in packets(received(faults)))


def test_noise_is_skipped():
    replies = received(WireFaults(noisy=1.0))
    assert all(one[0][1].endswith(encoded(REPLY)) and len(one[0][1]) > len(encoded(REPLY)) for one in replies)
    assert sum(found == [REPLY] for found in packets(replies)) > 390  # noise can look like the start of a packet


def test_a_bare_reply_has_its_error_and_no_data():
    assert packets(received(WireFaults(bare=1.0), 1)) == [[Packet(4, Instruction.STATUS, b"\0")]]


def test_a_foreign_reply_has_the_id_of_another_servo():
    assert packets(received(WireFaults(foreign=1.0), 1)) == [[Packet(5, Instruction.STATUS, REPLY.parameters)]]


def test_a_late_reply_is_delayed():
    assert received(WireFaults(late=1.0, late_s=0.2), 1)[0][0][0] == pytest.approx(0.2005)


def test_the_delay_of_an_adapter_applies_once_to_all_replies():
    replies = [(0.0005, encoded(REPLY))] * 3
    delayed = WireFaults(delay_s=0.016).apply(REQUEST, replies)
    assert [delay_s for delay_s, _ in delayed] == pytest.approx([0.0165, 0.0005, 0.0005])


def test_an_echo_precedes_the_reply():
    assert received(WireFaults(echo=True), 1) == [[(0.0, REQUEST), (0.0005, encoded(REPLY))]]
    assert isinstance(packets(received(WireFaults(echo=True, damaged=1.0), 1))[0][0], Packet | DamagedPacket)


@pytest.mark.parametrize(
    "wrong", [{"lost": 1.5}, {"cut": -0.1}, {"late_s": float("nan")}, {"delay_s": -1.0}, {"damaged": float("nan")}]
)
def test_invalid_fractions_and_times_are_rejected(wrong):
    with pytest.raises(EmulatorError, match=next(iter(wrong))):
        WireFaults(**wrong)
