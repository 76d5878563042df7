"""Messages of another host, in the time of this one."""

from __future__ import annotations

from typing import Any

from paramove.bus import (
    LATEST_NS,
    Envelope,
    Reason,
    RejectedError,
    Topic,
    decoded,
    impossible_time,
    times_in,
    topics,
)
from paramove.hosts.clock_offset import ClockOffset

LARGEST_BOUND_NS = 5_000_000
"""Where the offset of a clock is known less well, nobody can tell how old a command is."""


class UnknownTimeError(Exception):
    """Nobody can tell how old a message is."""


def in_own_time(
    topic: Topic, envelope: Envelope, payload: bytes, clock: ClockOffset, now_ns: int
) -> tuple[Envelope, Any]:
    """Envelope and message with all times by this host's clock.

    Args:
        topic: Row of the table.
        envelope, payload: As they were published there.
        clock: That of the other host.
        now_ns: Time here.

    Raises:
        RejectedError: The payload is no sound message of the topic, or a time in it is before this host's clock began.
        UnknownTimeError: No reply has shown what time it is there; or a command to move or arm, and the clock's offset
            is not known to `LARGEST_BOUND_NS`. Never for a request to stop or to disarm, which has no age: its times
            become the time here.
    """
    message = decoded(topic, payload, topic.has_checked_numbers)
    if topic.is_stop or (topic.type is topics.OPERATOR_ARM.type and not message.armed):
        message.captured.FromNanoseconds(now_ns)
        return envelope._replace(published_ns=now_ns, captured_ns=now_ns), message
    bound_ns = clock.bound_ns(now_ns)
    moves = topic.type is topics.ARM_TRAJECTORY.type or (topic.type is topics.OPERATOR_ARM.type and message.armed)
    if bound_ns == float("inf") or (moves and bound_ns > LARGEST_BOUND_NS):
        raise UnknownTimeError(f"the clock there is known to {1e-6 * bound_ns:.1f} ms only, so its age is not known")
    impossible = impossible_time(message)
    if impossible:  # where numbers are not checked: of a request to arm, and of a trajectory, which its driver checks
        raise RejectedError(Reason.NUMBER, f"{impossible}, which never was")
    ahead_ns = clock.offset_ns(now_ns)
    for time in times_in(message):
        time.FromNanoseconds(_earlier(time.ToNanoseconds(), ahead_ns))
    moved = envelope._replace(
        published_ns=envelope.published_ns - ahead_ns, captured_ns=envelope.captured_ns - ahead_ns
    )
    if not (envelope.has_possible_times and moved.has_possible_times):
        raise RejectedError(Reason.NUMBER, f"its header has the time {envelope.published_ns} ns, which never was")
    return moved, message


def _earlier(time_ns: int, by_ns: int) -> int:
    if not 0 <= time_ns - by_ns <= LATEST_NS:
        raise RejectedError(
            Reason.NUMBER, f"a time of {time_ns} ns there is {time_ns - by_ns} ns by the clock here, which never was"
        )
    return time_ns - by_ns
