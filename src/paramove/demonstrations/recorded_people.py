"""Recorded movements of people, read from a folder and brought into the body frame of each person.

A folder holds `pointing27/data.npz` and `table_reach/data.npz`. A file has the arrays flat (frames, points x 3),
flat_time (frames,) in s, offsets (movements + 1,), points, unit, axes, and per movement action, target, subject,
repetition, segment (first frame, one past the last), ok; `hand` and `segment_grasp` where there are several.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from paramove.demonstrations.body_frame import chain_length
from paramove.demonstrations.movement import at_times
from paramove.documents import Floats, InputError, Ints, read_arrays

VARIABLE = "PARAMOVE_DATA"
RATE_HZ = 50.0
"""All recordings are brought to this rate: the sources have 45.45 Hz, irregular, and 100 Hz."""
REFERENCE_ARM_M = 0.52
"""Length of the chain of arm points that everybody's movements are scaled to: that of the synthetic demonstrator."""
SLOW, FAST = 0.03, 0.15
"""A movement begins in the first frame of the fingertip above 3 cm/s before it exceeds 15 cm/s."""

ARM_CHAINS = (("shoulder", "elbow", "wrist"), ("rightShoulder", "upperArm", "forearm", "hand"))
FINGERTIPS = ("index", "indexFinger")
UNITS = {"m": 1.0, "mm": 0.001}


class RecordingsError(InputError):
    """A folder of recordings is missing or does not have the layout described above."""


@dataclass(frozen=True)
class RecordedMovement:
    """One movement at `RATE_HZ`, lengths divided by the person's arm length and multiplied by `REFERENCE_ARM_M`.

    Attributes:
        action, subject, hand, repetition: who did what; hand "L" or "R".
        target_id: number of the target, equal for equal targets of the same action.
        points: from the beginning of the recording to its end, shape (T, 3 x points), m. Frame: origin where the
            shoulder of the acting arm is when the movement begins, x forward, y left, z up; left arms are mirrored.
        target: in the same frame and scale, shape (3,), m; not finite where the action has none.
        segment: first frame and one past the last of the movement.
        grasp: the same for its part up to the grasp; None where there is none.
        onset: first frame by the absolute rule for speeds, which does not depend on the kind of movement.
        shoulder: which point is the shoulder of the acting arm.
    """

    action: str
    subject: int
    hand: str
    repetition: int
    target_id: int
    points: Floats
    target: Floats
    segment: tuple[int, int]
    grasp: tuple[int, int] | None
    onset: int
    shoulder: int

    @property
    def movement(self) -> Floats:
        """The movement from its first to its last frame. Shape (T, D), m."""
        return self.points[slice(*self.segment)]

    @property
    def to_grasp(self) -> Floats:
        """The movement up to the grasp where it has one, else all of it. Shape (T, D), m."""
        return self.points[slice(*(self.grasp or self.segment))]

    @property
    def from_onset(self) -> Floats:
        """The movement from the onset by the absolute rule to its last frame. Shape (T, D), m.

        The origin is the shoulder at this onset: the shoulder at the first frame of the segment would reveal the
        distance between both, and with that the kind of movement.
        """
        part = self.points[self.onset : self.segment[1]]
        origin = part[0, 3 * self.shoulder : 3 * self.shoulder + 3]
        return part - np.tile(origin, part.shape[1] // 3)

    @property
    def direction(self) -> Floats:
        """Direction of the target from the shoulder: azimuth (positive to the left) and elevation, rad. Shape (2,)."""
        x, y, z = self.target
        return np.array([np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))])


@dataclass(frozen=True)
class Recordings:
    """Movements of one data set, without those that the source marks as not usable."""

    name: str
    point_names: tuple[str, ...]
    movements: tuple[RecordedMovement, ...]

    @property
    def fingertip(self) -> int:
        """Which body point is the tip of the index finger."""
        return _index_of(self.point_names, FINGERTIPS)

    @property
    def subjects(self) -> tuple[int, ...]:
        """Numbers of the persons."""
        return tuple(sorted({movement.subject for movement in self.movements}))

    @property
    def actions(self) -> tuple[str, ...]:
        """Names of the actions."""
        return tuple(sorted({movement.action for movement in self.movements}))

    def of(self, *, subject: int | None = None, action: str | None = None) -> tuple[RecordedMovement, ...]:
        """The movements of one person, of one action, or of both."""
        return tuple(
            one
            for one in self.movements
            if (subject is None or one.subject == subject) and (action is None or one.action == action)
        )


def data_folder(folder: str | Path | None = None) -> Path:
    """The folder of recordings: the one given, that of the variable PARAMOVE_DATA, or shared/data next to the clone.

    Raises RecordingsError if it does not exist.
    """
    default = Path(__file__).resolve().parents[4] / "shared" / "data"
    path = Path(folder or os.environ.get(VARIABLE) or default)
    if not path.is_dir():
        raise RecordingsError(f"no folder with recordings at {path}: give one with --data or in {VARIABLE}")
    return path


def load_recordings(name: str, folder: str | Path | None = None, *, rate_hz: float = RATE_HZ) -> Recordings:
    """Read the data set `name` ("pointing27", "table_reach" or any of the same layout).

    Raises RecordingsError where the folder, the file or an array is missing, or its shape does not fit.
    """
    path = data_folder(folder) / name / "data.npz"
    if not path.is_file():
        raise RecordingsError(f"{path} is missing: a data set is a folder with a file data.npz")
    arrays = read_arrays(path, raising=RecordingsError)
    try:
        return _recordings(name, arrays, rate_hz)
    except KeyError as error:
        raise RecordingsError(f"{path}: the array {error} is missing; found {', '.join(sorted(arrays))}") from error
    except (ValueError, IndexError) as error:
        raise RecordingsError(f"{path}: {error}") from error


@dataclass(frozen=True)
class _Raw:
    """One recording in our axes but in the frame of the laboratory; points (T, P, 3), m."""

    index: int
    times: Floats
    points: Floats
    target: Floats


def _recordings(name: str, arrays: dict[str, Any], rate_hz: float) -> Recordings:
    names = tuple(str(point) for point in arrays["points"])
    chain = _chain_of(names)
    tip = _index_of(names, FINGERTIPS)
    # With a sternum, persons may sit turned; without, the laboratory's axes are those of all persons.
    sternum = names.index("sternum") if "sternum" in names else None
    raws = _raw_movements(arrays, len(names))
    ids = _target_ids(arrays)
    movements: list[RecordedMovement] = []
    for subject in np.unique(arrays["subject"]):
        own = [raw for raw in raws if arrays["subject"][raw.index] == subject]
        if not own:
            continue
        hands = [str(arrays["hand"][raw.index]) if "hand" in arrays else "R" for raw in own]
        body_from_room = _facing(own, hands, chain[0], sternum)
        scale = REFERENCE_ARM_M / _arm_length(own, chain)
        for raw, hand in zip(own, hands, strict=True):
            turned = replace(raw, points=raw.points @ body_from_room.T, target=body_from_room @ raw.target)
            movements.append(_in_body_frame(turned, arrays, hand, scale, chain[0], tip, int(ids[raw.index]), rate_hz))
    if not movements:
        raise ValueError("no movement is marked as usable (array ok)")
    return Recordings(name, names, tuple(sorted(movements, key=lambda one: (one.subject, one.action, one.target_id))))


def _raw_movements(arrays: dict[str, Any], n_points: int) -> list[_Raw]:
    """Usable movements in m and axes x forward, y left, z up."""
    axes = _axes(str(arrays["axes"]))
    unit = UNITS[str(arrays["unit"])]
    offsets, usable = arrays["offsets"], arrays["ok"]
    raws = []
    for i in np.flatnonzero(usable):
        rows = slice(int(offsets[i]), int(offsets[i + 1]))
        points = arrays["flat"][rows].astype(np.float64).reshape(-1, n_points, 3)
        if not np.isfinite(points).all():
            points = _filled(points)
        target = np.asarray(arrays["target"][i], dtype=np.float64)
        raws.append(_Raw(int(i), arrays["flat_time"][rows], unit * points @ axes.T, unit * axes @ target))
    return raws


def _axes(words: str) -> Floats:
    """Our axes from those of the recording, a matrix (3, 3)."""
    if "y up" in words:  # Unity: x right, y up, z forward, left-handed
        return np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    if "z up" in words:  # x right, y forward
        return np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    raise ValueError(f"axes are described with 'y up' or 'z up', found {words!r}")


def _filled(points: Floats) -> Floats:
    """Frames without a value are bridged by a straight line. Raises ValueError if a point is lost in all frames."""
    flat = points.reshape(len(points), -1).copy()
    frames = np.arange(len(flat))
    for column in flat.T:
        finite = np.isfinite(column)
        if not finite.any():
            raise ValueError("a point is lost in all frames of a movement that is marked as usable")
        column[~finite] = np.interp(frames[~finite], frames[finite], column[finite])
    return flat.reshape(points.shape)


def _chain_of(names: Sequence[str]) -> tuple[int, ...]:
    for chain in ARM_CHAINS:
        if all(name in names for name in chain):
            return tuple(names.index(name) for name in chain)
    raise ValueError(f"points of the arm are {' or '.join(map(str, ARM_CHAINS))}, found {tuple(names)}")


def _index_of(names: Sequence[str], choices: Sequence[str]) -> int:
    for name in choices:
        if name in names:
            return list(names).index(name)
    raise ValueError(f"one of the points {', '.join(choices)} is needed, found {tuple(names)}")


def _facing(own: list[_Raw], hands: list[str], shoulder: int, sternum: int | None) -> Floats:
    """Turns the laboratory's frame about the vertical so that the person looks along x. Shape (3, 3).

    From the line between both shoulders; a person with recordings of one arm only is turned by quarters of a circle.
    """
    if sternum is None:
        return np.eye(3)
    first = np.array([raw.points[:5, shoulder].mean(axis=0) for raw in own])
    starts = {hand: first[np.array(hands) == hand].mean(axis=0) for hand in set(hands)}
    if len(starts) == 2:
        leftward = starts["L"] - starts["R"]
        angle = float(np.arctan2(-leftward[0], leftward[1]))
    else:
        ((hand, start),) = starts.items()
        middle = np.mean([raw.points[:5, sternum].mean(axis=0) for raw in own], axis=0)
        leftward = (start - middle) if hand == "L" else (middle - start)
        angle = float(np.round(np.arctan2(-leftward[0], leftward[1]) / (np.pi / 2)) * np.pi / 2)
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])


def _arm_length(own: list[_Raw], chain: tuple[int, ...]) -> float:
    """Sum of the median lengths of the arm's links over all frames of the person, m."""
    points = np.concatenate([raw.points for raw in own])
    return chain_length([points[:, number] for number in chain])


def _in_body_frame(
    raw: _Raw, arrays: dict[str, Any], hand: str, scale: float, shoulder: int, tip: int, target_id: int, rate_hz: float
) -> RecordedMovement:
    first, end = (int(frame) for frame in arrays["segment"][raw.index])
    mirror = np.array([1.0, -1.0 if hand == "L" else 1.0, 1.0])
    origin = raw.points[first : first + 3, shoulder].mean(axis=0)
    points = (raw.points - origin) * mirror * scale
    times = raw.times - raw.times[0]
    grid = np.arange(0.0, times[-1] + 1e-9, 1.0 / rate_hz)
    uniform = at_times(grid, times, points.reshape(len(points), -1))

    def frames(pair: Any) -> tuple[int, int]:
        begin = round(float(times[pair[0]]) * rate_hz)
        return begin, min(len(uniform), max(begin + 2, round(float(times[min(pair[1], len(times)) - 1]) * rate_hz) + 1))

    grasp = arrays["segment_grasp"][raw.index] if "segment_grasp" in arrays else (-1, -1)
    segment = frames((first, end))
    return RecordedMovement(
        action=str(arrays["action"][raw.index]),
        subject=int(arrays["subject"][raw.index]),
        hand=hand,
        repetition=int(arrays["repetition"][raw.index]),
        target_id=target_id,
        points=uniform,
        target=(raw.target - origin) * mirror * scale,
        segment=segment,
        grasp=frames(grasp) if grasp[0] >= 0 else None,
        onset=onset_of(uniform.reshape(len(uniform), -1, 3)[:, tip] / scale, segment[1], rate_hz),
        shoulder=shoulder,
    )


def onset_of(fingertip: Floats, end: int, rate_hz: float) -> int:
    """First frame of a fingertip (T, 3), m, above 3 cm/s before its first above 15 cm/s; frames from `end` are ignored.

    One absolute rule for all kinds of movement: a threshold relative to the movement's own peak would reveal its kind.
    """
    path = fingertip[:end]
    width = max(1, round(0.04 * rate_hz))  # differences over 80 ms: below that the cameras' noise dominates
    later = path[np.minimum(np.arange(len(path)) + width, len(path) - 1)]
    earlier = path[np.maximum(np.arange(len(path)) - width, 0)]
    speed = np.linalg.norm(later - earlier, axis=1) * rate_hz / (2.0 * width)
    fast = int(np.argmax(speed > FAST)) if (speed > FAST).any() else int(np.argmax(speed))
    slow = np.flatnonzero(speed[: fast + 1] <= SLOW)
    return int(slow[-1]) + 1 if slow.size and slow[-1] < fast else (0 if not slow.size else fast)


def _target_ids(arrays: dict[str, Any]) -> Ints:
    """Numbers of the targets; without the array target_id equal targets have equal numbers."""
    if "target_id" in arrays:
        return np.asarray(arrays["target_id"], dtype=np.int64)
    targets = np.nan_to_num(np.asarray(arrays["target"], dtype=np.float64))
    _, numbers = np.unique(np.round(targets, 6), axis=0, return_inverse=True)
    return np.asarray(numbers, dtype=np.int64).reshape(-1)
