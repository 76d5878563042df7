"""A demonstration set: a folder with recordings of arm poses and labels.yaml, as arrays to train and test with.

It splits into training and test sets by movement, person or parameter cell; the same for the same seed.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple, TypeVar

import numpy as np

from paramove.demonstrations import body_frame, timing
from paramove.demonstrations.labels import FILE_NAME, load_labels
from paramove.demonstrations.movement import DemonstrationError, Movement
from paramove.demonstrations.reading import read_movements
from paramove.demonstrations.writing import Label, Take, write_set
from paramove.documents import Floats

if TYPE_CHECKING:
    from paramove.demonstrations.reaching import Demonstrations

Drawn = TypeVar("Drawn")
SplitBy = Literal["movement", "subject", "theta"]
SAME_THETA = 1e-6
"""Parameters that differ by less lie in one cell."""


def split_groups(
    movements: Sequence[Movement], by: SplitBy, fraction: float, seed: int, bins: int | None = None
) -> tuple[list[int], list[int]]:
    """Indices of the movements that train and of those that test, each in their old order.

    Args:
        movements: All.
        by: movement: a fraction of the movements of each action. subject: whole persons. theta: whole parameter cells,
            so that no parameter of a test was trained with.
        fraction: Fraction of the movements of an action, of the persons or of the cells that test; at least one.
        seed: The same seed and movements, in whatever order, give the same split.
        bins: With theta: number of cells of equal width per parameter; None: each parameter vector is its own cell.

    Raises ValueError for a fraction outside (0, 1), DemonstrationError if there is nothing to choose from.
    """
    if not 0.0 < fraction < 1.0:
        raise ValueError(f"expected a fraction for the test above 0 and below 1, found {fraction}")
    rng = np.random.default_rng(seed)
    if by == "movement":
        tested: set[int] = set()
        for action in sorted({movement.action for movement in movements}):
            chosen = [n for n, movement in enumerate(movements) if movement.action == action]
            chosen.sort(key=lambda n: _identity(movements[n]))
            tested.update(_drawn(chosen, fraction, rng, f"movements of {action}"))
    else:
        group: Callable[[Movement], Hashable] = attrgetter("subject") if by == "subject" else _cells(movements, bins)
        groups = sorted({group(movement) for movement in movements}, key=repr)
        drawn = set(_drawn(groups, fraction, rng, "persons" if by == "subject" else "parameter cells"))
        tested = {n for n, movement in enumerate(movements) if group(movement) in drawn}
    return [n for n in range(len(movements)) if n not in tested], sorted(tested)


def _identity(movement: Movement) -> tuple[object, ...]:
    """Key that identifies a movement of an action, independent of their order."""
    labels = (movement.subject, movement.side, tuple(movement.theta.tolist()), movement.repetition)
    return (*labels, len(movement.time), movement.positions[0].tobytes(), movement.positions[-1].tobytes())


def _cells(movements: Sequence[Movement], bins: int | None) -> Callable[[Movement], Hashable]:
    if bins is None:
        return lambda movement: tuple(np.round(movement.theta / SAME_THETA).astype(np.int64).tolist())
    if bins < 1:
        raise ValueError(f"at least one cell per parameter expected, found {bins}")
    theta = np.stack([movement.theta for movement in movements])
    low, width = theta.min(axis=0), np.ptp(theta, axis=0)
    width = np.where(width > 0.0, width, 1.0)

    def cell(movement: Movement) -> Hashable:
        cell = np.floor((movement.theta - low) / width * bins).astype(np.int64)
        return tuple(np.minimum(cell, bins - 1).tolist())

    return cell


def _drawn(choices: list[Drawn], fraction: float, rng: np.random.Generator, what: str) -> list[Drawn]:
    if len(choices) < 2:
        raise DemonstrationError(
            f"{len(choices)} {what} cannot be split into training and test; "
            "record more, or split by something else (movement, subject, theta)"
        )
    count = min(max(1, round(fraction * len(choices))), len(choices) - 1)
    return [choices[n] for n in rng.permutation(len(choices))[:count]]


class Sequences(NamedTuple):
    """Movements as models take them.

    Attributes:
        sequences: Stacked positions, each (T_k, D), m.
        theta: Shape (K, P).
        labels: Actions, K.
        subjects: K.
    """

    sequences: list[Floats]
    theta: Floats
    labels: list[str]
    subjects: list[str]


@dataclass(frozen=True)
class DemonstrationSet(Sequence[Movement]):
    """Movements with the same points, frame and parameters. Every change gives a new set.

    Attributes:
        movements: In the order of labels.yaml.
        description: For people.
        remarks: Changes on reading, such as gaps that were filled.

    Raises DemonstrationError for movements whose points, frames or parameters differ; names both.
    """

    movements: tuple[Movement, ...]
    description: str = ""
    remarks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for movement in self.movements[1:]:
            first = self.movements[0]
            for what in ("point_names", "frame", "parameter_names"):
                one, other = getattr(first, what), getattr(movement, what)
                if one != other:
                    words = what.replace("_", " ")
                    raise DemonstrationError(
                        f"{movement.source}: {words} {_words(other)}, but {_words(one)} in {first.source}; "
                        "a set has the same in all"
                    )

    @classmethod
    def load(cls, folder: Path | str) -> DemonstrationSet:
        """Reads a folder. Short losses of a point are filled (`max_gap` of labels.yaml) and listed in `remarks`.

        Raises DemonstrationError, or LabelsError with file:line:column of every segment that cannot be used: its
        recording is missing or has other points, it is out of range, has a single frame, or a point is lost too long.
        """
        labels = load_labels(Path(folder) / FILE_NAME)
        movements, remarks = read_movements(labels)
        return cls(tuple(movements), labels.file.description, tuple(remarks))

    def write(self, folder: Path | str) -> None:
        """Writes a folder: one recording per recording that the movements come from, the movements one after another.

        Positions are stored exactly, times to the nanosecond. Raises DemonstrationError if there is a set already.
        """
        takes = [
            Take(
                recording=movement.recording,
                time=movement.time,
                positions=movement.positions,
                point_names=movement.point_names,
                frame=movement.frame,
                labels=(Label.of(movement),),
            )
            for movement in self.movements
        ]
        write_set(Path(folder), takes, self.parameter_names, self.description)

    def __len__(self) -> int:
        return len(self.movements)

    def __getitem__(self, index: int) -> Movement:  # type: ignore[override]
        return self.movements[index]

    @property
    def point_names(self) -> tuple[str, ...]:
        """Names of the points; () of an empty set."""
        return self.movements[0].point_names if self.movements else ()

    @property
    def frame(self) -> str:
        """Coordinate frame; "" of an empty set."""
        return self.movements[0].frame if self.movements else ""

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the components of theta."""
        return self.movements[0].parameter_names if self.movements else ()

    @property
    def actions(self) -> tuple[str, ...]:
        """Names of the actions, sorted."""
        return tuple(sorted({movement.action for movement in self.movements}))

    @property
    def subjects(self) -> tuple[str, ...]:
        """Names of the persons, sorted."""
        return tuple(sorted({movement.subject for movement in self.movements}))

    def select(self, action: str | None = None, subject: str | None = None) -> DemonstrationSet:
        """The movements of one action, of one person, or both.

        Raises DemonstrationError that names what there is, if there are none.
        """
        chosen = tuple(
            movement
            for movement in self.movements
            if action in (None, movement.action) and subject in (None, movement.subject)
        )
        if not chosen:
            raise DemonstrationError(
                f"no movement with action {action or 'any'} and subject {subject or 'any'}; there are the actions "
                f"{', '.join(self.actions) or 'none'} and the subjects {', '.join(self.subjects) or 'none'}"
            )
        return replace(self, movements=chosen)

    def sequences(
        self, action: str | None = None, subject: str | None = None, rate_hz: float | None = None
    ) -> Sequences:
        """Movements of an action and a person (None: all) as `fit` takes them, at `rate_hz` (None: as they are)."""
        chosen = self.select(action, subject)
        if rate_hz is not None:
            chosen = chosen.resampled(rate_hz)
        return Sequences(
            [movement.frames for movement in chosen],
            np.stack([movement.theta for movement in chosen]),
            [movement.action for movement in chosen],
            [movement.subject for movement in chosen],
        )

    def demonstrations(self, action: str | None = None) -> Demonstrations:
        """The movements of one action (None: of the only one) with the description that a model stores.

        Raises DemonstrationError if there are several actions and none is named.
        """
        from paramove.demonstrations.reaching import Demonstrations
        from paramove.phmm import MovementDescription

        if action is None and len(self.actions) > 1:
            raise DemonstrationError(f"a model is of one action; choose among {', '.join(self.actions)}")
        chosen = self.select(action)
        arrays = chosen.sequences()
        duration = float(np.mean([movement.duration for movement in chosen]))
        about = MovementDescription(
            arrays.labels[0], self.point_names, "m", self.frame, self.parameter_names, duration, source=self.description
        )
        return Demonstrations(arrays.sequences, arrays.theta, about)

    def resampled(self, rate_hz: float) -> DemonstrationSet:
        """All at one frame rate (`timing.resampled`)."""
        return self._each(lambda movement: timing.resampled(movement, rate_hz))

    def cut_by_speed(self, point: str = timing.FINGERTIP, *, end: bool = False) -> DemonstrationSet:
        """All cut by the absolute rule: from the first frame above 3 cm/s before 15 cm/s (`timing.cut_by_speed`)."""
        return self._each(lambda movement: timing.cut_by_speed(movement, point, end=end))

    def in_body_frame(self) -> DemonstrationSet:
        """All relative to the person (`body_frame.in_body_frame`)."""
        return self._each(body_frame.in_body_frame)

    def with_right_arms(self) -> DemonstrationSet:
        """Movements of left arms mirrored to right ones (`body_frame.mirrored`)."""
        return self._each(lambda movement: body_frame.mirrored(movement) if movement.side == "left" else movement)

    def scaled_to_arm(self, length: float | None = None) -> DemonstrationSet:
        """Every person's movements scaled so that all arms are `length` metres long (None: the mean of the persons)."""
        measured = [(movement.subject, body_frame.arm_length(movement)) for movement in self.movements]
        lengths = {one: float(np.median([arm for name, arm in measured if name == one])) for one in self.subjects}
        target_length = float(np.mean(list(lengths.values()))) if length is None else length
        return self._each(lambda movement: body_frame.scaled(movement, target_length / lengths[movement.subject]))

    def split(
        self, by: SplitBy = "movement", fraction: float = 0.25, seed: int = 0, bins: int | None = None
    ) -> tuple[DemonstrationSet, DemonstrationSet]:
        """The set to train with and the set to test with (`split_groups`)."""
        trained, tested = split_groups(self.movements, by, fraction, seed, bins)
        return (
            replace(self, movements=tuple(self.movements[n] for n in trained)),
            replace(self, movements=tuple(self.movements[n] for n in tested)),
        )

    def _each(self, change: Callable[[Movement], Movement]) -> DemonstrationSet:
        return replace(self, movements=tuple(change(movement) for movement in self.movements))


def _words(value: tuple[str, ...] | str) -> str:
    return f"'{value}'" if isinstance(value, str) else f"({', '.join(value)})"
