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
    """A recording cannot be recovered; the text has the reason."""


class StillWrittenError(RecoveryError):
    """The recording is being written by a process that is alive."""


@dataclass(frozen=True)
class Recovery:
    """Recovered and lost messages of a recording.

    Attributes:
        source: The recording, which is as it was.
        destination: The recording that was written; None if the source is whole.
        kept: Recovered messages.
        lost: Messages that are known to be lost: counted by the indexes that are left.
        lost_is_exact: Whether no more than these can be lost.
        seconds_kept: From the first to the last recovered message, without gaps that damages left.
        seconds_lost: Of those gaps, and at the end as far as it is known.
        damages: Where bytes could not be used.
        known_until_s: Time of the last message in a recording that was never finished, so that later ones may be lost;
            None if it was finished.
        last_written: Of the source, on the wall clock: it has all messages until shortly before, if nothing is damaged.
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
        _check_not_open(file.fileno(), source)
        if source.stat().st_size == 0:
            raise RecoveryError(f"{source} is empty: nothing was written before its writer ended")
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
            surveyed = survey(content)
            sound = [part for part in surveyed.parts if isinstance(part, Sound)]
            if surveyed.finished and not surveyed.damages:
                return _recovery(source, None, surveyed, sum(part.messages for part in sound), 0)
            if not sound:
                raise RecoveryError(f"{source} has no readable message: {_description(surveyed)}")
            goal = destination or recovered_path(source)
            if goal.exists():
                raise RecordingExistsError(f"{goal} exists; recordings are never overwritten: choose another name")
            temporary = goal.with_name(f"{goal.stem}.{os.getpid()}.recovering.mcap")  # renamed when complete
            try:
                kept, nameless = _copy(content, surveyed, sound, temporary)
                rename_durably(temporary, goal)
            finally:
                for left in (temporary, temporary.with_name(f"{temporary.name}.part")):
                    left.unlink(missing_ok=True)
    return _recovery(source, goal, surveyed, kept, nameless)


def _check_not_open(descriptor: int, source: Path) -> None:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise StillWrittenError(f"{source} is being written by a process that is alive; end its run first") from error
    except OSError:  # a file system without locks
        return


def _copy(content: Content, surveyed: Survey, sound: list[Sound], goal: Path) -> tuple[int, int]:
    """Writes the messages whose topics are known; returns their number and that of the others."""
    kept = nameless = 0
    with RecordingWriter(goal, LIBRARY) as writer:
        for note in surveyed.notes:
            if note.name != NOTE:
                writer.note(note.name, dict(note.metadata))
        for part in sound:
            for message in messages_of(content, part):
                channel = surveyed.channels.get(message.channel_id)
                if channel is None:
                    nameless += 1
                    continue
                writer.copy(channel, _schema(surveyed, channel.schema_id), message)
                kept += 1
        writer.note(NOTE, {"kept": str(kept), "damages": _description(surveyed)})
    return kept, nameless


def _schema(surveyed: Survey, number: int) -> Schema:
    """A schema of the file; one whose record is lost is that of the topic table."""
    schema = surveyed.schemas.get(number, Schema(number, b"", "", ""))
    if not schema.data:
        for topic in topics.TOPICS:
            if topic.type_name == schema.name:
                data = schema_of(topic.type.DESCRIPTOR.file).SerializeToString()
                return Schema(number, data, "protobuf", schema.name)
    return schema


def _recovery(source: Path, destination: Path | None, surveyed: Survey, kept: int, nameless: int) -> Recovery:
    lost = nameless + sum(damage.messages or 0 for damage in surveyed.damages)
    exact = all(damage.messages is not None for damage in surveyed.damages)
    if surveyed.statistics is not None:
        lost, exact = max(surveyed.statistics.message_count - kept, 0), True
    kept_ns, lost_ns = _spans(surveyed)
    last_ns = max((part.last_ns for part in surveyed.parts if isinstance(part, Sound)), default=0)
    return Recovery(
        source=source,
        destination=destination,
        kept=kept,
        lost=lost,
        lost_is_exact=exact,
        seconds_kept=kept_ns / SECOND_NS,
        seconds_lost=lost_ns / SECOND_NS,
        damages=tuple(surveyed.damages),
        known_until_s=None if surveyed.finished else last_ns / SECOND_NS,
        last_written=datetime.datetime.fromtimestamp(source.stat().st_mtime).astimezone(),
    )


def _spans(surveyed: Survey) -> tuple[int, int]:
    """Recovered time and time lost by damages, ns."""
    last: int | None = surveyed.statistics.message_start_time if surveyed.statistics else None
    first = last
    lost, damaged = 0, False
    for part in surveyed.parts:
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
    if surveyed.statistics and damaged and last is not None:
        lost += max(0, surveyed.statistics.message_end_time - last)
        last = max(last, surveyed.statistics.message_end_time)
    return (0 if first is None or last is None else last - first - lost), lost


def _description(surveyed: Survey) -> str:
    described = [f"bytes {damage.begin}-{damage.end}: {damage.what}" for damage in surveyed.damages[:10]]
    more = len(surveyed.damages) - 10
    if not surveyed.finished:
        described.append("it was never finished")
    return "; ".join(described + ([f"and {more} more"] if more > 0 else []))
