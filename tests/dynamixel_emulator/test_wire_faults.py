"""Each fault does what its name says, to as many answers as asked for, and with the same seed to the same ones."""

import pytest

from dynamixel_emulator.errors import EmulatorError
from dynamixel_emulator.packets import DamagedPacket, Instruction, Packet, PacketReader, encoded
from dynamixel_emulator.wire_faults import WireFaults

QUESTION = encoded(Packet(4, Instruction.READ, bytes([132, 0, 4, 0])))
ANSWER = Packet(4, Instruction.STATUS, bytes([0, 0x1F, 8, 0, 0]))


def heard(faults, times=400):
    """All that a client reads."""
    return [faults.told(QUESTION, [(0.0005, encoded(ANSWER))]) for _ in range(times)]


def packets(told):
    return [list(PacketReader().feed(b"".join(data for _, data in one))) for one in told]


def test_without_faults_answers_stay_as_they_are():
    assert heard(WireFaults(), 3) == [[(0.0005, encoded(ANSWER))]] * 3


def test_lost_answers_are_as_many_as_asked_for():
    assert 0.2 < sum(one == [] for one in heard(WireFaults(lost=0.25))) / 400 < 0.3


def test_the_same_seed_gives_the_same_faults():
    kinds = {"lost": 0.1, "damaged": 0.3, "cut": 0.1, "noisy": 0.2, "bare": 0.1, "foreign": 0.1, "late": 0.3}
    assert heard(WireFaults(**kinds, seed=3)) == heard(WireFaults(**kinds, seed=3))
    assert heard(WireFaults(**kinds, seed=3)) != heard(WireFaults(**kinds, seed=4))


def test_damaged_and_cut_answers_are_never_read_as_answers():
    for faults in (WireFaults(damaged=1.0), WireFaults(cut=1.0)):
        assert all(ANSWER not in found for found in packets(heard(faults)))


def test_noise_is_passed_over():
    told = heard(WireFaults(noisy=1.0))
    assert all(one[0][1].endswith(encoded(ANSWER)) and len(one[0][1]) > len(encoded(ANSWER)) for one in told)
    assert sum(found == [ANSWER] for found in packets(told)) > 390  # noise may look like the beginning of a packet


def test_a_bare_answer_has_its_error_and_no_data():
    assert packets(heard(WireFaults(bare=1.0), 1)) == [[Packet(4, Instruction.STATUS, b"\0")]]


def test_a_foreign_answer_names_another_servo():
    assert packets(heard(WireFaults(foreign=1.0), 1)) == [[Packet(5, Instruction.STATUS, ANSWER.parameters)]]


def test_a_late_answer_comes_later():
    assert heard(WireFaults(late=1.0, late_s=0.2), 1)[0][0][0] == pytest.approx(0.2005)


def test_an_adapter_that_keeps_bytes_back_does_so_once_for_all_answers():
    answers = [(0.0005, encoded(ANSWER))] * 3
    told = WireFaults(delay_s=0.016).told(QUESTION, answers)
    assert [delay_s for delay_s, _ in told] == pytest.approx([0.0165, 0.0005, 0.0005])


def test_an_echo_comes_before_the_answer():
    assert heard(WireFaults(echo=True), 1) == [[(0.0, QUESTION), (0.0005, encoded(ANSWER))]]
    assert isinstance(packets(heard(WireFaults(echo=True, damaged=1.0), 1))[0][0], Packet | DamagedPacket)


@pytest.mark.parametrize(
    "wrong", [{"lost": 1.5}, {"cut": -0.1}, {"late_s": float("nan")}, {"delay_s": -1.0}, {"damaged": float("nan")}]
)
def test_what_is_no_share_or_no_time_is_refused(wrong):
    with pytest.raises(EmulatorError, match=next(iter(wrong))):
        WireFaults(**wrong)
