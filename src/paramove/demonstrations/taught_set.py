"""A demonstration set that grows while somebody teaches: each movement is written at once, and can be dropped again."""

from __future__ import annotations

import errno
import itertools
import os
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from paramove.demonstrations.labelling import next_repetition
from paramove.demonstrations.labels import FILE_NAME, Segment, load_labels
from paramove.demonstrations.movement import TARGET_NAMES, DemonstrationError
from paramove.demonstrations.writing import Label, Take, write_set
from paramove.documents import Floats, findings, replacing

RECORDING = "taught_{:03d}.mcap"


class TaughtSet:
    """Adds movements to a folder; a later failure loses nothing. Theta is the position at which a movement ends.

    Args:
        folder: Of the set.
        action: The demonstrated action, such as reaching.
        subject: The person who demonstrates it.
        description: Of the set.
        append: Whether the set may exist already.

    Attributes:
        written: Recordings of this session, the latest last.

    Raises DemonstrationError if there is a set and `append` is not given, if it has other parameters, or for a name
    that no action has; OSError if the folder cannot be written.
    """

    def __init__(self, folder: Path, action: str, subject: str, description: str, *, append: bool = False) -> None:
        self._folder, self._action, self._subject, self._description = folder, action, subject, description
        self._labels = folder / FILE_NAME
        self._before: list[bytes | None] = []
        self.written: list[str] = []
        self._segment((0.0, 0.0, 0.0))
        self._check_can_be_written()
        if self._labels.exists():
            self._check_existing(append)

    @property
    def positions(self) -> list[tuple[float, ...]]:
        """Theta of each movement of this action by this person in the set."""
        there = load_labels(self._labels).file.segments if self._labels.exists() else []
        return [tuple(one.theta) for one in there if (one.action, one.subject) == (self._action, self._subject)]

    def _check_existing(self, append: bool) -> None:
        if not append:
            raise DemonstrationError(
                f"{self._folder} holds a demonstration set already; choose another folder, or --append to it"
            )
        has = tuple(load_labels(self._labels).file.parameters)
        if has != TARGET_NAMES:
            raise DemonstrationError(
                f"{self._labels} has the parameters ({', '.join(has)}), teaching gives ({', '.join(TARGET_NAMES)}); "
                "choose another folder"
            )

    def add(
        self, time: Floats, positions: Floats, point_names: tuple[str, ...], frame: str, moved: tuple[int, int],
        theta: Floats,
    ) -> str:  # fmt: skip
        """Writes a movement.

        Args:
            time: (T,), s. positions: of its points, (T, P, 3), m. point_names: of these. frame: of these.
            moved: First frame, and one past the last, of the movement between rests.
            theta: Where it ends, (3,), m.

        Returns the name of its recording. Raises DemonstrationError if it cannot be written.
        """
        where = tuple(float(value) for value in theta)
        label = Label(*moved, self._action, where, self._subject, self._repetition(where))
        take = Take(self._free_name(), time - time[0], positions, point_names, frame, (label,))
        before = self._labels.read_bytes() if self._labels.exists() else None
        write_set(self._folder, [take], TARGET_NAMES, self._description, add=True)
        self._before.append(before)
        self.written.append(take.recording)
        return take.recording

    def drop(self) -> str:
        """Deletes the latest movement of this session, its recording and its label; the name of its recording.

        Raises DemonstrationError if there is none, or labels.yaml was changed since.
        """
        if not self.written:
            raise DemonstrationError("no segment of this session is left to drop")
        name = self.written[-1]
        segments = load_labels(self._labels).file.segments
        if not segments or segments[-1].recording != name:
            raise DemonstrationError(f"{self._labels} was changed meanwhile; take {name} out of it by hand")
        self.written.pop()
        before = self._before.pop()
        if before is None:
            self._labels.unlink()
        else:
            with replacing(self._labels) as unfinished:
                unfinished.write_bytes(before)
        (self._folder / name).unlink()
        return name

    def _check_can_be_written(self) -> None:
        place = next(path for path in (self._folder.absolute(), *self._folder.absolute().parents) if path.exists())
        number = 0 if place.is_dir() else errno.ENOTDIR
        if number or not os.access(place, os.W_OK | os.X_OK):
            number = number or errno.EACCES
            raise OSError(number, os.strerror(number), str(place))

    def _segment(self, theta: tuple[float, ...]) -> Segment:
        try:
            return Segment(
                recording="any", start=0.0, end=1.0, action=self._action, theta=list(theta), subject=self._subject
            )
        except ValidationError as error:
            raise DemonstrationError(
                f"action {self._action!r}, subject {self._subject!r}: {findings(error)}"
            ) from error

    def _repetition(self, theta: tuple[float, ...]) -> int:
        there = load_labels(self._labels).file.segments if self._labels.exists() else []
        return next_repetition(there, self._segment(theta))

    def _free_name(self) -> str:
        names = (RECORDING.format(number) for number in itertools.count(1))
        return next(name for name in names if not any(self._folder.glob(f"{name}*")))  # nor an unfinished one


def moved_part(hand: Floats, rests_within: float) -> tuple[int, int]:
    """First frame, and one past the last, of a movement between the rests before and after it.

    Args:
        hand: Path, shape [T, 3], m.
        rests_within: The hand rests while it is within this distance of its start, and as close to its end, m.

    Raises DemonstrationError if the hand does not move.
    """
    away = np.flatnonzero(np.linalg.norm(hand - hand[0], axis=1) > rests_within)
    on_the_way = np.flatnonzero(np.linalg.norm(hand - hand[-1], axis=1) > rests_within)
    if not away.size or not on_the_way.size:
        raise DemonstrationError(
            f"the hand was moved by less than {1e3 * rests_within:g} mm, or returned to its start; the "
            "segment is left out"
        )
    return max(0, int(away[0]) - 1), int(on_the_way[-1]) + 2
