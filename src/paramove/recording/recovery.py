"""Rebuilds a finished recording from one whose writer was killed or whose bytes are damaged."""

from __future__ import annotations

import datetime
import fcntl
import mmap
import os
from dataclasses import dataclass
from pathlib import Path

from mcap.records import Schema

from paramove.bus import topics
from paramove.documents import InputError, rename_durably
from paramove.recording.damage import Content, Damage, Sound, Survey, messages_of, survey
from paramove.recording.writer import RecordingExistsError, RecordingWriter, schema_of

LIBRARY = "paramove recover"
NOTE = "paramove.recovery"
SECOND_NS = 1_000_000_000


class RecoveryError(InputError):
    """A recording cannot be recovered; says why."""


class StillWrittenError(RecoveryError):
    """The recording is being written by a process that is alive."""


@dataclass(frozen=True)
class Recovery:
    """What was kept of a recording and what was lost.

    Attributes:
        source: The recording, which is as it was.
        destination: The recording that was written; None if the source is whole.
        kept: Messages.
        lost: Messages that are known to be lost: counted by the indexes that are left.
        lost_is_exact: Whether no more than these can be lost.
        seconds_kept: From the first to the last message that was kept, without gaps that damages left.
        seconds_lost: Of those gaps, and at the end as far as the file tells.
        damages: Where bytes could not be used.
        known_until_s: Time of the last message that is left of a recording that was never finished: whether others came
            after it nothing in the file tells. None if it was finished.
        last_written: Of the source, on the wall clock: what came until shortly before is in it, if nothing is damaged.
    """

    source: Path
    destination: Path | None
    kept: int
    lost: int
    lost_is_exact: bool
    seconds_kept: float
    seconds_lost: float
    damages: tuple[Damage, ...]
    known_until_s: float | None
    last_written: datetime.datetime


def recovered_path(source: Path) -> Path:
    """Where the recovered recording goes: `run.mcap` for `run.mcap.part`, `run.recovered.mcap` for `run.mcap`."""
    return source.with_suffix("") if source.suffix == ".part" else source.with_name(f"{source.stem}.recovered.mcap")


def recover(source: Path, destination: Path | None = None) -> Recovery:
    """Writes everything that can be read of `source` into a finished recording; `source` is only read.

    Messages are copied byte by byte, in their order. A whole recording is not written again.

    Raises RecoveryError if there is no such file or no message in it, StillWrittenError if its writer is alive,
    RecordingExistsError if the destination exists.
    """
    if not source.is_file():
        raise RecoveryError(f"there is no recording {source}", missing=True)
    with source.open("rb") as file:
        _refuse_open(file.fileno(), source)
        if source.stat().st_size == 0:
            raise RecoveryError(f"{source} is empty: nothing was written before its writer ended")
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
            found = survey(content)
            sound = [part for part in found.parts if isinstance(part, Sound)]
            if found.finished and not found.damages:
                return _told(source, None, found, sum(part.messages for part in sound), 0)
            if not sound:
                raise RecoveryError(f"{source} holds no message that can be read: {_words(found)}")
            goal = destination or recovered_path(source)
            if goal.exists():
                raise RecordingExistsError(f"{goal} exists; recordings are never overwritten: choose another name")
            aside = goal.with_name(f"{goal.stem}.{os.getpid()}.recovering.mcap")  # until it is whole
            try:
                kept, nameless = _copy(content, found, sound, aside)
                rename_durably(aside, goal)
            finally:
                for left in (aside, aside.with_name(f"{aside.name}.part")):
                    left.unlink(missing_ok=True)
    return _told(source, goal, found, kept, nameless)


def _refuse_open(descriptor: int, source: Path) -> None:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise StillWrittenError(f"{source} is being written by a process that is alive; end its run first") from error
    except OSError:  # a file system without locks
        return


def _copy(content: Content, found: Survey, sound: list[Sound], goal: Path) -> tuple[int, int]:
    """Writes the messages whose topics are known; how many, and how many others there are."""
    kept = nameless = 0
    with RecordingWriter(goal, LIBRARY) as writer:
        for note in found.notes:
            if note.name != NOTE:
                writer.note(note.name, dict(note.metadata))
        for part in sound:
            for message in messages_of(content, part):
                channel = found.channels.get(message.channel_id)
                if channel is None:
                    nameless += 1
                    continue
                writer.copy(channel, _schema(found, channel.schema_id), message)
                kept += 1
        writer.note(NOTE, {"kept": str(kept), "damages": _words(found)})
    return kept, nameless


def _schema(found: Survey, number: int) -> Schema:
    """A schema of the file; one whose record is lost is that of the topic table."""
    schema = found.schemas.get(number, Schema(number, b"", "", ""))
    if not schema.data:
        for topic in topics.TOPICS:
            if topic.type_name == schema.name:
                data = schema_of(topic.type.DESCRIPTOR.file).SerializeToString()
                return Schema(number, data, "protobuf", schema.name)
    return schema


def _told(source: Path, destination: Path | None, found: Survey, kept: int, nameless: int) -> Recovery:
    lost = nameless + sum(damage.messages or 0 for damage in found.damages)
    exact = all(damage.messages is not None for damage in found.damages)
    if found.statistics is not None:
        lost, exact = max(found.statistics.message_count - kept, 0), True
    kept_ns, lost_ns = _spans(found)
    last_ns = max((part.last_ns for part in found.parts if isinstance(part, Sound)), default=0)
    return Recovery(
        source=source,
        destination=destination,
        kept=kept,
        lost=lost,
        lost_is_exact=exact,
        seconds_kept=kept_ns / SECOND_NS,
        seconds_lost=lost_ns / SECOND_NS,
        damages=tuple(found.damages),
        known_until_s=None if found.finished else last_ns / SECOND_NS,
        last_written=datetime.datetime.fromtimestamp(source.stat().st_mtime).astimezone(),
    )


def _spans(found: Survey) -> tuple[int, int]:
    """Time that is covered, and time that damages have taken out, in ns."""
    last: int | None = found.statistics.message_start_time if found.statistics else None
    first = last
    lost, damaged = 0, False
    for part in found.parts:
        if isinstance(part, Damage):
            damaged = True
            continue
        if part.messages == 0:
            continue
        if first is None:
            first = part.first_ns
        if damaged and last is not None:
            lost += max(0, part.first_ns - last)
        last, damaged = max(part.last_ns, last or 0), False
    if found.statistics and damaged and last is not None:
        lost += max(0, found.statistics.message_end_time - last)
        last = max(last, found.statistics.message_end_time)
    return (0 if first is None or last is None else last - first - lost), lost


def _words(found: Survey) -> str:
    said = [f"bytes {damage.begin}-{damage.end}: {damage.what}" for damage in found.damages[:10]]
    more = len(found.damages) - 10
    if not found.finished:
        said.append("it was never finished")
    return "; ".join(said + ([f"and {more} more"] if more > 0 else []))
