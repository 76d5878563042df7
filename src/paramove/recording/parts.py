"""A recording in several files: a recorder that was restarted continues in a further file.

`recording.mcap`, `recording.2.mcap`, `recording.3.mcap`, …; each with the ending `.part` while it is not finished. No
file is ever written over or added to, so the file of a killed process is never changed.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from paramove.recording.reader import Recorded, read


@dataclass(frozen=True)
class Gap:
    """Time between two parts, by the bus clock, in which no recorder ran."""

    begin_ns: int
    end_ns: int


def part_path(path: Path, number: int) -> Path:
    """File of the part with a number from 1; the first has the recording's own name."""
    return path if number == 1 else path.with_name(f"{path.stem}.{number}{path.suffix}")


def next_part(path: Path) -> Path:
    """The first part of a recording of which there is no file yet, finished or not."""
    for number in itertools.count(1):
        part = part_path(path, number)
        if not part.exists() and not _unfinished(part).exists():
            return part
    raise AssertionError


class PartedRecording:
    """All parts of a recording, read as one.

    Args:
        path: Of the first part.
        begun_ns: When the run began, by its clock: subtracted from the times of messages and gaps.

    Attributes:
        parts: The files that there are, in order; unfinished ones end with their last whole chunk.
        gaps: Between parts, as far as they were read last.
    """

    def __init__(self, path: Path, begun_ns: int = 0) -> None:
        self._begun_ns = begun_ns
        self.parts: list[Path] = []
        self.gaps: list[Gap] = []
        for number in itertools.count(1):
            part = part_path(path, number)
            existing = next((file for file in (part, _unfinished(part)) if file.is_file()), None)
            if existing is None:
                break
            self.parts.append(existing)

    def read(self, only: Collection[str] = ()) -> Iterator[Recorded]:
        """The messages of all parts (see `paramove.recording.reader.read`).

        A latched value that a later part received again is left out.
        """
        self.gaps = []
        latest: dict[str, tuple[int, int]] = {}
        for part in self.parts:
            before, first = dict(latest), True
            for recorded in map(self._since_begin, read(part, only)):
                stamp = (recorded.publish_ns, recorded.sequence)
                if stamp <= before.get(recorded.topic, (-1, -1)):
                    continue
                if before and first:
                    self.gaps.append(Gap(max(time_ns for time_ns, _ in before.values()), recorded.publish_ns))
                first = False
                latest[recorded.topic] = max(stamp, latest.get(recorded.topic, stamp))
                yield recorded

    def _since_begin(self, recorded: Recorded) -> Recorded:
        if not self._begun_ns:
            return recorded
        log_ns, publish_ns = recorded.log_ns - self._begun_ns, recorded.publish_ns - self._begun_ns
        return replace(recorded, log_ns=log_ns, publish_ns=publish_ns)


def _unfinished(part: Path) -> Path:
    return part.with_name(part.name + ".part")
