"""A recording played on a bus: what was published then is published now, with the time of now."""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
from pathlib import Path

from paramove.bus import Topic, times_in, topics
from paramove.client.run import Run
from paramove.documents import InputError, nearest
from paramove.recording import RecordedTopic, contents, read_any

_COMMANDS = frozenset(
    row.type_name for row in (topics.ARM_TRAJECTORY, topics.RELOCATION_GOAL, topics.WIRE_HOAP3_STREAM)
)
"""Types of messages that would move an arm: only played where their topic is named."""


def is_played(topic: Topic, named: bool = False) -> bool:
    """Whether a recorded topic may be played: never what nodes or persons alone publish, commands only if `named`."""
    row = next((one for one in topics.TOPICS if one.name == topic.name), topic)  # a recording may have another type
    if topic.reserved_for or row.reserved_for:
        return False
    return named or topic.type_name not in _COMMANDS


def play(
    run: Run,
    path: Path,
    names: Collection[str] = (),
    rate: float = 1.0,
    start_s: float = 0.0,
    wait_s: float = 2.0,
) -> int:
    """Publish the messages of a recording at their distances in time; times in them become those of now.

    Args:
        run: Where.
        path: The recording.
        names: Topics; empty: all that may be played.
        rate: 2.0 is twice as fast.
        start_s: From so long after the begin of the recording.
        wait_s: For a subscriber of each topic.

    Returns:
        How many messages were published.

    Raises:
        InputError: There is no such recording or topic, a topic may not be played, or its messages are none of the
            topic's any more.
        TopicTakenError: Somebody publishes one of the topics.
    """
    rows = _rows(path, contents(path), names)
    publishers = {row.name: run.offer(row) for row in rows}
    run.wait_for_subscribers(publishers.values(), wait_s)
    count = 0
    first_ns: int | None = None
    begun_s = time.monotonic()
    for one in read_any(path):
        first_ns = one.log_ns if first_ns is None else first_ns
        at_s = 1e-9 * (one.log_ns - first_ns)
        if at_s < start_s or one.topic not in publishers:
            continue
        run.idle(begun_s + (at_s - start_s) / rate - time.monotonic())
        now_ns = run.now_ns
        for stamp in times_in(one.message):
            stamp.FromNanoseconds(max(0, stamp.ToNanoseconds() + now_ns - one.publish_ns))
        publishers[one.topic].publish(one.message, now_ns, now_ns)
        count += 1
    return count


def _rows(path: Path, recorded: Sequence[RecordedTopic], names: Collection[str]) -> list[Topic]:
    """Rows of the named topics, or of all that may be played."""
    known = {topic.name: topic for topic in recorded}
    missing = [name for name in names if name not in known]
    if missing:
        raise InputError(f"{path} has no topic '{missing[0]}'; {nearest(missing[0], known)}")
    rows = [known[name].row for name in names or known]
    playable = [row for row in rows if is_played(row, named=bool(names))]
    if names and len(playable) < len(rows):
        others = ", ".join(row.name for row in rows if row not in playable)
        raise InputError(f"not played, as nodes or persons alone publish them: {others}")
    if not playable:
        raise InputError(f"{path} has no topic that is played")
    for row in playable:
        fault = _fault(row, known[row.name])
        if fault:
            raise InputError(f"{path}: {row.name} cannot be played: {fault}")
    return playable


def _fault(row: Topic, recorded: RecordedTopic) -> str:
    """Why the messages recorded of a topic cannot be published on it; "" if they can."""
    if recorded.change:
        return f"{recorded.change}, and its subscribers would misread it; leave it out by --topics, or undo the change"
    if recorded.most_bytes > row.max_bytes:
        return f"a message has {recorded.most_bytes} bytes, the topic allows {row.max_bytes}; raise its max_bytes"
    return ""
