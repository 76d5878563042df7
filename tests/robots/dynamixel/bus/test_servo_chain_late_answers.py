"""Answers to earlier questions are known by their lengths, and servos that do not talk are asked now and then."""

import pytest

from paramove.robots.dynamixel.bus import servo_chain as late_answers
from paramove.robots.dynamixel.bus.servo_chain import MANY_OWED, MAX_OWED, REST_S, DelayedReplies


@pytest.fixture
def clock(monkeypatch):
    """Seconds, in a list; what is appended is now."""
    times = [100.0]
    monkeypatch.setattr(late_answers.time, "monotonic", lambda: times[-1])
    return times


def silent(late, questions, size=4):
    """Lengths that nobody answered with."""
    lengths = []
    for _ in range(questions):
        late.requested()
        lengths.append(late.length_for(size))
        late.missed(lengths[-1])
    return lengths


def test_without_silence_nothing_more_is_asked_for(clock):
    late = DelayedReplies()
    assert not late
    assert late.length_for(4) == 4
    assert late.rest_s == 0.0


def test_no_question_has_a_length_that_is_owed(clock):
    late = DelayedReplies()
    assert silent(late, MAX_OWED + 1) == list(range(4, 4 + MAX_OWED + 1))
    assert silent(late, 1) == [4]  # the one that is longest ago
    assert late.length_for(7) == 7 + MAX_OWED - 2  # all others from there on are owed


def test_an_answer_to_the_last_question_ends_what_is_owed(clock):
    late = DelayedReplies()
    silent(late, 5)
    late.answered()
    assert not late
    assert late.length_for(4) == 4


def test_a_late_answer_ends_what_was_asked_before_it_but_not_its_own_length(clock):
    """The other servos' answers to the same question are still to come."""
    late = DelayedReplies()
    assert silent(late, 5) == [4, 5, 6, 7, 8]
    late.arrived(6)
    assert [late.length_for(size) for size in (4, 5, 6)] == [4, 5, 9]
    late.arrived(6)
    late.arrived(99)  # of nobody's question
    assert late.length_for(6) == 9


def test_many_silences_are_followed_by_a_rest(clock):
    late = DelayedReplies()
    silent(late, MANY_OWED - 1)
    assert (late.many, late.rest_s) == (False, 0.0)
    silent(late, 1)
    assert late.many
    assert late.rest_s == pytest.approx(REST_S)
    clock.append(clock[-1] + 0.75 * REST_S)
    assert late.rest_s == pytest.approx(0.25 * REST_S)
    clock.append(clock[-1] + REST_S)
    assert late.rest_s == 0.0
    silent(late, 1)
    assert late.rest_s == pytest.approx(REST_S)
    late.arrived(late.length_for(4) - 1)
    assert late.rest_s == 0.0


def test_a_length_comes_back_after_nearly_half_a_second_at_the_earliest(clock):
    late = DelayedReplies()
    begun = {}
    for _ in range(100):
        clock.append(clock[-1] + late.rest_s)
        (length,) = silent(late, 1)
        assert clock[-1] - begun.get(length, -1.0) > 0.44
        begun[length] = clock[-1]
