"""Exact counts of one subscriber's received and lost messages, from epochs and sequence numbers."""

from __future__ import annotations

import enum
from collections import Counter

from paramove.bus.envelope import Envelope, Reason


class Arrival(enum.Enum):
    """Kind of a message, given the messages received before it."""

    NEW = "new"
    REPEATED = "repeated"
    WELCOME = "welcome"  # carries no message
    OUTDATED = "outdated"  # of a publisher that another one has replaced


class SequenceCounter:
    """Follows one topic.

    What was published before a subscriber came is no loss: the first message, usually a welcome, is the baseline.
    From there on every gap is a loss, and a later welcome also reveals a loss at the end. A publisher that came, or was
    restarted, while the subscriber was there is counted from its first message.

    Attributes:
        from_first: Whether the subscriber was there before its first publisher.
        epoch: Of the present publisher; None until something was received.
        sequence: Latest of that epoch.
        messages: Messages received, each counted once.
        lost: Messages published and not received.
        repeated: Messages that came again.
        rejected: How many messages were rejected, by reason.
        epochs: How many publishers followed each other.
    """

    def __init__(self) -> None:
        self.from_first = False
        self.epoch: int | None = None
        self.sequence = 0
        self.messages = 0
        self.lost = 0
        self.repeated = 0
        self.epochs = 0
        self.rejected: Counter[Reason] = Counter()
        self._past: set[int] = set()

    def accept(self, envelope: Envelope) -> Arrival:
        """Counts one message that passed the checks of the envelope."""
        if envelope.epoch in self._past:
            self.rejected[Reason.EPOCH] += 1
            return Arrival.OUTDATED
        first = envelope.epoch != self.epoch
        if first:
            if self.epoch is not None:
                self._past.add(self.epoch)
            if self.epoch is not None or self.from_first:
                self.lost += max(0, envelope.sequence - int(envelope.has_message))
            self.epoch = envelope.epoch
            self.epochs += 1
        elif envelope.sequence <= self.sequence:
            if not envelope.has_message:
                return Arrival.WELCOME
            self.repeated += 1
            return Arrival.REPEATED
        else:
            # A welcome without a message means that everything up to its sequence had been published.
            self.lost += envelope.sequence - self.sequence - int(envelope.has_message)
        self.sequence = envelope.sequence
        if not envelope.has_message:
            return Arrival.WELCOME
        self.messages += 1
        return Arrival.NEW

    def has_reached(self, epoch: int, sequence: int) -> bool:
        """Whether everything up to that message has been received, or belongs to a publisher that was replaced."""
        return epoch in self._past or (epoch == self.epoch and self.sequence >= sequence)
