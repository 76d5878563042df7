"""Loss counting equals the truth for any pattern of losses, welcomes and restarts."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from paramove.bus.envelope import FLAG_LAST_VALUE, FLAG_WELCOME, Envelope, Reason
from paramove.bus.sequence import Arrival, SequenceCounter


def _message(epoch: int, sequence: int, flags: int = 0) -> Envelope:
    return Envelope(0, 0, epoch, sequence, 0, 0, flags)


@settings(deadline=None, derandomize=True, max_examples=200)
@given(
    st.lists(
        st.tuples(st.integers(0, 20), st.lists(st.sampled_from(["heard", "lost", "welcome", "again"]), max_size=40)),
        min_size=1,
        max_size=4,
    )
)
def test_counts_equal_the_truth(publishers: list[tuple[int, list[str]]]) -> None:
    counter = SequenceCounter()
    heard = lost = repeated = 0
    for epoch, (said_before, events) in enumerate(publishers, start=1):
        sequence = said_before
        newest_heard = said_before
        counter.accept(_message(epoch, sequence, FLAG_WELCOME))
        lost += said_before if epoch > 1 else 0  # by a restarted publisher, while this subscriber was there
        for event in events:
            if event == "welcome":
                counter.accept(_message(epoch, sequence, FLAG_WELCOME))
                newest_heard = sequence
            elif event == "again":
                verdict = counter.accept(_message(epoch, newest_heard, FLAG_WELCOME | FLAG_LAST_VALUE))
                assert verdict is Arrival.REPEATED
                repeated += 1
            else:
                sequence += 1
                if event == "heard":
                    assert counter.accept(_message(epoch, sequence)) is Arrival.NEW
                    heard += 1
                    newest_heard = sequence
                else:
                    lost += 1
        # What was lost last shows with the next welcome.
        counter.accept(_message(epoch, sequence, FLAG_WELCOME))
        assert counter.has_reached(epoch, sequence)
        assert not counter.has_reached(epoch, sequence + 1)
    assert (counter.messages, counter.lost, counter.repeated) == (heard, lost, repeated)
    assert counter.epochs == len(publishers)


def test_a_message_before_the_welcome_is_the_base_line() -> None:
    counter = SequenceCounter()
    assert counter.accept(_message(1, 41)) is Arrival.NEW
    assert counter.accept(_message(1, 41, FLAG_WELCOME)) is Arrival.WELCOME
    assert (counter.lost, counter.messages) == (0, 1)


def test_a_late_joiner_gets_the_last_value_once() -> None:
    counter = SequenceCounter()
    assert counter.accept(_message(1, 5, FLAG_WELCOME | FLAG_LAST_VALUE)) is Arrival.NEW
    assert counter.accept(_message(1, 5, FLAG_WELCOME | FLAG_LAST_VALUE)) is Arrival.REPEATED
    assert counter.accept(_message(1, 6)) is Arrival.NEW
    assert counter.lost == 0


def test_a_replaced_publisher_is_not_heard_again() -> None:
    counter = SequenceCounter()
    counter.accept(_message(1, 5))
    counter.accept(_message(2, 1))
    assert counter.accept(_message(1, 6)) is Arrival.OUTDATED
    assert counter.rejected[Reason.EPOCH] == 1
    assert counter.has_reached(1, 100)
