"""The one check between every reader of motion capture and a demonstration set: times, losses, doubtful content.

A reader yields a `RawTake`: what is in the file, and what the file says about it. `checked` decides what of it can be
true: the unit of its times, frames that are missing, and points that were lost.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from paramove.demonstrations import (
    MAX_RATE_HZ,
    MIN_RATE_HZ,
    DemonstrationError,
    Label,
    bursts,
    frame_ranges,
    is_plausible,
    longer_step,
    missing_frames,
    period_of,
    runs,
)
from paramove.documents import Floats, Ints

MAX_FRAMES = 1_000_000
"""Of a take: four and a half hours at 60 Hz."""
LONGEST_S = 1e7
SHORTEST_S = 1e-9
"""Between two frames: times are written in whole nanoseconds."""
TIME_UNITS = {"seconds": 1.0, "milliseconds": 1e-3, "microseconds": 1e-6, "nanoseconds": 1e-9}
FILLED_HOLE_S = 2.0
"""No loss that is longer can be interpolated; a longer hole gets a lost frame at both ends only."""
FROZEN_FRAMES = 3
"""So many equal positions, to the last bit, of a point that moves."""
FAR = 10.0
"""How much longer steps to a position that stands for none are than the longest of the point's other steps."""
ALL_AXES = slice(0, 3)
COORDINATES = {"": ALL_AXES, **{f"{axis} of ": slice(number, number + 1) for number, axis in enumerate("xyz")}}
"""What may stand for none, before the name of its point: the position, or one coordinate."""
MOST_PLACEHOLDERS = 4
"""Different ones of a point."""
QUANTA = 2.5
"""Steps of so many of the smallest steps in the data are movement, not rounding."""
JUMP = 1.5
"""A point that was at rest starts with smaller steps; one that was frozen jumps to where it has got meanwhile."""
FASTEST_M_S = 20.0
"""No hand moves faster in a gesture, a reach or a throw."""
OTHER_RATE = 0.05
"""A rate that differs from that of the times by a larger fraction contradicts them."""
STOP = 0.5
"""A point that comes to rest gets slower; one that freezes had at least this fraction of the speed before."""


@dataclass(frozen=True)
class RawTake:
    """Frames that were captured one after the other, in the unit, axes and names of their file.

    Attributes:
        name: For the recording that it becomes a part of.
        time: Shape (T,); None if the file has neither times nor a rate.
        positions: Shape (T, P, 3), in the file's unit and axes; NaN where a point was lost.
        point_names: Of the P points, as the file has them.
        unit: "m", "cm", "mm"; None if the file does not define it.
        axes: Directions of x, y, z as `axes_matrix` takes them; None if the file does not define it.
        axes_are_known: Whether `axes` is what the file says; else it is a convention of its kind.
        labels: The file's labels of movements; positions in theta are in the file's unit and axes.
        parameter_names: Of theta.
        time_unit_s: Of `time`; None if the file does not define it: seconds, unless another unit fits.
        frame_numbers: Shape (T,), if the file counts its frames; None if not.
        faults: Name of a point -> why it cannot be used. It matters only if the point is requested.
        remarks: On what the reader left out or assumed.
        part: Which of several takes of its file it is, for messages.
    """

    name: str
    time: Floats | None
    positions: Floats
    point_names: tuple[str, ...]
    unit: str | None = None
    axes: str | None = None
    axes_are_known: bool = False
    labels: tuple[Label, ...] = ()
    parameter_names: tuple[str, ...] = ()
    time_unit_s: float | None = None
    frame_numbers: Floats | None = None
    faults: Mapping[str, str] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    part: str = ""


def check_length(n_frames: float, source: Path | str) -> None:
    """Raises DemonstrationError for more frames than a take may have; readers ask before they read them."""
    if n_frames > MAX_FRAMES:
        raise DemonstrationError(
            f"{source} has {n_frames:.0f} frames; a take has at most {MAX_FRAMES}: cut it into its movements, or "
            "export it at a lower rate"
        )


def checked(
    raw: RawTake,
    file: Path | str,
    *,
    rate_hz: float | None = None,
    zeros_are_lost: bool = True,
    repeats_are_lost: bool = True,
) -> RawTake:
    """The take with times in seconds from 0, a frame for each that is missing, and NaN wherever a point was lost.

    Args:
        raw: As read.
        file: For messages.
        rate_hz: Frame rate that replaces the file's times; frame numbers still count.
        zeros_are_lost: Whether a point at exactly (0, 0, 0) was lost in that frame.
        repeats_are_lost: Whether a point was lost that repeats its position exactly while others move (`frozen`).

    Raises DemonstrationError for times that cannot be those of frames, or do not increase.
    """
    check_length(len(raw.positions), file)
    remarks = list(raw.remarks)
    time, about_time = _seconds(raw, rate_hz, file)
    remarks += about_time
    positions = raw.positions.copy()
    positions[~np.isfinite(positions).all(axis=-1)] = np.nan
    if zeros_are_lost:
        for path in positions.swapaxes(0, 1):
            path[zeros(path)] = np.nan
    if repeats_are_lost:
        remarks += _mark_repeats(positions, raw.point_names, file)
    take = replace(raw, time=time, time_unit_s=1.0, positions=positions)
    remarks += _about_bursts(time, file)
    with_all, about_holes = _with_missing_frames(take, file)
    return replace(with_all, remarks=(*remarks, *about_holes))


def _mark_repeats(positions: Floats, names: Sequence[str], file: Path | str) -> list[str]:
    """Sets positions (T, P, 3) that stand for none, or repeat the last one known, to NaN; remarks on them."""
    remarks = []
    for name, path in zip(names, positions.swapaxes(0, 1), strict=True):
        for what, axes in COORDINATES.items():
            marked = placeholders(path, axes)
            path[marked] = np.nan
            if marked.any():
                remarks.append(
                    f"{file}: {what}{name} is at one position far from all others in frames {frame_ranges(marked)}: "
                    "lost there (--repeats-are-places: it was there)"
                )
    stalled = stalls(positions)
    if stalled.any():
        remarks.append(
            f"{file}: all points repeat their positions exactly in frames {frame_ranges(stalled)}, and jump "
            "afterwards: did the capture stand still?"
        )
    repeated = frozen(positions)
    positions[repeated] = np.nan
    for name, marked in zip(names, repeated.T, strict=True):
        if marked.any():
            remarks.append(
                f"{file}: {name} repeats its position exactly while others move, in frames {frame_ranges(marked)}: "
                "lost there (--repeats-are-places: it rested)"
            )
    return remarks


# Time -------------------------------------------------------------------------------------------------------------


def _seconds(raw: RawTake, rate_hz: float | None, file: Path | str) -> tuple[Floats, list[str]]:
    """Times from 0, s, and remarks about them."""
    count = len(raw.positions)
    if rate_hz is not None or raw.time is None:
        if rate_hz is None:
            raise DemonstrationError(f"{file} has neither times nor a frame rate; give --rate")
        return _at_rate(raw, rate_hz, file)
    if not count:
        return np.zeros(0), []
    time = raw.time - raw.time[0]
    _check_increasing(raw.time, time, raw.time_unit_s or SHORTEST_S, file)
    unit_s, remarks = _time_unit(time, raw.time_unit_s, file)
    seconds = time * unit_s
    if not seconds[-1] < LONGEST_S or not (np.diff(seconds) > SHORTEST_S).all():
        raise DemonstrationError(
            f"{file}: its times go from {raw.time[0]:g} to {raw.time[-1]:g}; expected at most {LONGEST_S:g} s, and a "
            "nanosecond between frames: correct them, or give --rate to count frames instead"
        )
    return seconds, remarks + _contradiction(raw, seconds, file)


def _at_rate(raw: RawTake, rate_hz: float, file: Path | str) -> tuple[Floats, list[str]]:
    """Times of frames at a rate that was given, by their numbers where the file has them."""
    numbers, remarks = _counted(raw, file)
    if numbers is None:
        remarks += _against_times(raw, rate_hz, file)
    time: Floats = (np.arange(len(raw.positions)) if numbers is None else numbers) / rate_hz
    if len(time) and not time[-1] < LONGEST_S:
        raise DemonstrationError(f"{file}: {len(time)} frames at {rate_hz:g} Hz end after {time[-1]:g} s; check --rate")
    if not is_plausible(rate_hz):
        remarks.append(f"{file}: {rate_hz:g} frames a second are unusual; expected {MIN_RATE_HZ:g} to {MAX_RATE_HZ:g}")
    return time, remarks


def _against_times(raw: RawTake, rate_hz: float, file: Path | str) -> list[str]:
    """What the file's times say against frames at a rate that was given."""
    if raw.time is None or len(raw.time) < 3 or not (np.diff(raw.time) > 0.0).all():
        return []
    time = raw.time - raw.time[0]
    missing = missing_frames(time)
    if missing.any():
        first = int(np.flatnonzero(missing)[0])
        return [
            f"{file}: by its times {missing.sum()} frames are missing, the first after row {first + 1}; at the given "
            "rate its rows follow each other without a hole: leave the rate out to use the times"
        ]
    units = [raw.time_unit_s] if raw.time_unit_s else _fitting_units(time)
    rates = [1.0 / (period_of(time) * unit_s) for unit_s in units]
    if not rates or any(abs(one / rate_hz - 1.0) <= OTHER_RATE for one in rates):
        return []
    return [f"{file}: its times mean {rates[0]:.4g} frames a second; the given {rate_hz:g} are used"]


def _check_increasing(as_read: Floats, time: Floats, unit_s: float, file: Path | str) -> None:
    bad = np.flatnonzero(~(np.diff(time) * unit_s > 0.0) | ~np.isfinite(time[1:]))
    if bad.size:
        frame = int(bad[0]) + 1
        raise DemonstrationError(
            f"{file}: the time of frame {frame} is {as_read[frame]:g}, not after {as_read[frame - 1]:g}; "
            "correct it, or give --rate to count frames instead"
        )


def _time_unit(time: Floats, declared_s: float | None, file: Path | str) -> tuple[float, list[str]]:
    """Unit of times that increase from 0, in s: as the file declares it, else the one with a plausible rate.

    Raises DemonstrationError with the unit that would fit if the declared one does not.
    """
    if len(time) < 2:
        return declared_s or 1.0, []
    if declared_s is None and (np.diff(time) == 1.0).all():
        raise DemonstrationError(
            f"{file}: its times count 0, 1, 2: if these are frame numbers, give --rate; if they are milliseconds, name "
            "them time_ms"
        )
    fitting = _fitting_units(time)
    seconds = declared_s or 1.0
    if seconds in fitting:
        return seconds, []
    rate_hz = 1.0 / (period_of(time) * seconds)
    found = f"{file}: its times mean {rate_hz:.4g} frames a second; expected {MIN_RATE_HZ:g} to {MAX_RATE_HZ:g}"
    names = [name for name, unit_s in TIME_UNITS.items() if unit_s in fitting]
    if len(names) == 1 and declared_s is None:
        unit_s = fitting[0]
        return unit_s, [
            f"{file}: its times are taken as {names[0]} ({1.0 / (period_of(time) * unit_s):.4g} frames a second), as "
            f"seconds would mean {rate_hz:.4g}"
        ]
    hint = f"as {' or '.join(names)} they would fit: name their unit" if names else "correct them"
    raise DemonstrationError(f"{found}; {hint}, or give --rate")


def _fitting_units(time: Floats) -> list[float]:
    """Units in which both the period and the longer steps mean a plausible rate; the period alone where none does."""
    usual = period_of(time)
    longer = longer_step(time)
    fits = [unit_s for unit_s in TIME_UNITS.values() if is_plausible(1.0 / (usual * unit_s))]
    both = [unit_s for unit_s in fits if is_plausible(1.0 / (longer * unit_s))]
    return both or fits


def _counted(raw: RawTake, file: Path | str) -> tuple[Floats | None, list[str]]:
    """Frame numbers from 0 in steps of one; None if the file has none that count frames."""
    if raw.frame_numbers is None or len(raw.frame_numbers) < 2:
        return None, []
    numbers = raw.frame_numbers - raw.frame_numbers[0]
    steps = np.diff(numbers)
    bad = np.flatnonzero(~(steps >= 1.0) | (np.rint(numbers[1:]) != numbers[1:]))
    if bad.size:
        frame = int(bad[0]) + 1
        raise DemonstrationError(
            f"{file}: frame number {raw.frame_numbers[frame]:g} follows {raw.frame_numbers[frame - 1]:g}; expected "
            "whole numbers that increase: correct them, or remove the column"
        )
    stride = float(np.median(steps))
    if stride == 1.0 or (np.mod(steps, stride) != 0.0).any():
        return numbers, []
    return numbers / stride, [f"{file}: its frame numbers count in steps of {stride:g}; --rate is that of its rows"]


def _contradiction(raw: RawTake, time: Floats, file: Path | str) -> list[str]:
    """A remark where frame numbers skip frames though times do not."""
    if raw.frame_numbers is None or len(time) < 2:
        return []
    steps = np.diff(raw.frame_numbers)
    if not np.isfinite(steps).all() or not (steps >= 1.0).all():
        return []
    skipped = np.rint(steps / np.median(steps)) - 1.0
    hidden = np.flatnonzero((skipped > 0.0) & (missing_frames(time) == 0))
    if not hidden.size:
        return []
    return [
        f"{file}: {skipped[hidden].sum():.0f} frame numbers are missing, the first after "
        f"{raw.frame_numbers[hidden[0]]:g}, though its times go on; the times are used"
    ]


def _about_bursts(time: Floats, file: Path | str) -> list[str]:
    late = bursts(time)
    if not late.any():
        return []
    shortest = float(np.diff(time).min())
    return [
        f"{file}: the times of frames {frame_ranges(late)} are doubtful, only {shortest:.2g} s after the frame before "
        f"(others: {period_of(time):.3g} s); movements are interpolated without overshoot"
    ]


def _with_missing_frames(take: RawTake, file: Path | str) -> tuple[RawTake, list[str]]:
    """The take with lost points in each frame that is missing, as if the file had it with empty cells."""
    time: Floats = np.asarray(take.time)
    if len(time) < 2:
        return take, []
    missing = missing_frames(time)
    holes = np.flatnonzero(missing)
    if not holes.size:
        return take, []
    period = period_of(time)
    new = np.where(missing * period > FILLED_HOLE_S, 2, missing)
    if new.sum() > len(time):
        raise DemonstrationError(
            f"{file}: more frames are missing ({missing.sum()}) than there are ({len(time)}) at {1 / period:.4g} "
            "frames a second: correct its times, or give --rate to count frames instead"
        )
    at: Ints = np.arange(len(time)) + np.concatenate([[0], np.cumsum(new)])
    all_time = np.empty(len(time) + int(new.sum()))
    positions = np.full((len(all_time), *take.positions.shape[1:]), np.nan)
    all_time[at] = time
    positions[at] = take.positions
    for hole in holes.tolist():
        before, after = time[hole], time[hole + 1]
        inside = slice(at[hole] + 1, at[hole + 1])
        if new[hole] == missing[hole]:
            all_time[inside] = np.linspace(before, after, new[hole] + 2)[1:-1]
        else:
            all_time[inside] = [before + period, after - period]
    labels = tuple(
        replace(label, first=int(at[label.first]), end=int(at[label.end - 1]) + 1)
        if 0 <= label.first < label.end <= len(at)
        else label
        for label in take.labels
    )
    longest = int(holes[np.argmax(missing[holes])])
    remark = (
        f"{file}: {missing.sum()} frames are missing, the most after {time[longest]:.4g} s "
        f"({missing[longest] * period:.3g} s): they count as frames in which all points are lost"
    )
    return replace(take, time=all_time, positions=positions, labels=labels), [remark]


# Loss -------------------------------------------------------------------------------------------------------------


def zeros(path: Floats) -> NDArray[np.bool_]:
    """Where a point was lost that is exactly at (0, 0, 0). Shapes (T, 3) -> (T,).

    Coordinates may begin at the first position, or pass the origin: there it is for one frame, and the steps to it are
    as all others.
    """
    at_zero: NDArray[np.bool_] = (path == 0.0).all(axis=1)
    elsewhere = np.isfinite(path).all(axis=1) & ~at_zero
    steps = np.abs(np.diff(path, axis=0)).max(axis=1, initial=0.0)
    crossing = (at_zero[1:] & elsewhere[:-1]) | (elsewhere[1:] & at_zero[:-1])
    others = steps[elsewhere[1:] & elsewhere[:-1]]
    lasts = (at_zero[1:] & at_zero[:-1]).any()
    if crossing.any() and not lasts and others.size and steps[crossing].max() <= JUMP * np.percentile(others, 90):
        return np.zeros_like(at_zero)
    return at_zero


def placeholders(path: Floats, axes: slice = ALL_AXES) -> NDArray[np.bool_]:
    """Where a point has a position that stands for none, such as (-1, -1, -1). Shapes (T, 3) -> (T,).

    That is one position, to the last bit, in several frames, into and out of which every step is `FAR` times as long as
    the longest of all other steps from frame to frame. A point that rests is reached and left smoothly.

    Args:
        path: Of the point; NaN where it is lost already.
        axes: Whose coordinates stand for none: all, or one, such as the depth of a camera.
    """
    marked: NDArray[np.bool_] = np.zeros(len(path), dtype=np.bool_)
    if len(path) < 2:
        return marked
    known = np.isfinite(path).all(axis=1)
    steps = np.abs(np.diff(path, axis=0)).max(axis=1)
    for _ in range(MOST_PLACEHOLDERS):
        places = known & ~marked
        longest = int(np.argmax(np.where(places[1:] & places[:-1], steps, 0.0)))
        ends = [places & (path[:, axes] == path[frame, axes]).all(axis=1) for frame in (longest, longest + 1)]
        far = [inside for inside in ends if inside.sum() > 1 and _is_far(inside, places & ~inside, steps)]
        if not far:
            break
        marked |= min(far, key=np.count_nonzero)
    return marked


def _is_far(inside: NDArray[np.bool_], others: NDArray[np.bool_], steps: Floats) -> bool:
    """Whether all steps between frames at one position and others are far longer than those between the others."""
    crossing = (inside[1:] & others[:-1]) | (others[1:] & inside[:-1])
    usual = float(steps[others[1:] & others[:-1]].max(initial=0.0))
    return bool(crossing.any() and usual > 0.0 and steps[crossing].min() > FAR * usual)


def stalls(positions: Floats) -> NDArray[np.bool_]:
    """Frames in which all points only repeat their positions, and after which one jumps. Shapes (T, P, 3) -> (T,)."""
    stalled: NDArray[np.bool_] = np.zeros(len(positions), dtype=np.bool_)
    same = np.zeros_like(stalled)
    same[1:] = (positions[1:] == positions[:-1]).all(axis=(1, 2))  # NaN equals nothing
    found = [(first, end) for first, end in runs(same) if end - first >= FROZEN_FRAMES - 1 and end < len(positions)]
    for path in positions.swapaxes(0, 1) if found else ():
        valid = np.flatnonzero(np.isfinite(path[:, 0]))
        noise = QUANTA * _smallest_step(path)
        for first, end in found:
            stalled[first:end] |= _is_frozen(path, valid, first, end, noise)
    return stalled


def frozen(positions: Floats) -> NDArray[np.bool_]:
    """Where a point only repeats its last position although it moved. Shapes (T, P, 3) -> (T, P).

    A tracker that loses a point may repeat its last position, to the last bit. A point that rests does so as well in
    data that are rounded, so a run counts only if others move meanwhile and the point jumps after it, or is stopped at
    once and never moves again. The first frame of a run is a measurement.
    """
    lost: NDArray[np.bool_] = np.zeros(positions.shape[:2], dtype=np.bool_)
    if positions.shape[1] < 2 or len(positions) <= FROZEN_FRAMES:
        return lost
    same = np.zeros_like(lost)
    same[1:] = (positions[1:] == positions[:-1]).all(axis=-1)
    candidates = [
        [(first, end) for first, end in runs(marked) if end - first >= FROZEN_FRAMES - 1] for marked in same.T
    ]
    if not any(candidates):
        return lost
    quanta = np.array([_smallest_step(positions[:, point]) for point in range(positions.shape[1])])
    for point, found in enumerate(candidates):
        valid = np.flatnonzero(np.isfinite(positions[:, point, 0]))
        for first, end in found:
            if _is_frozen(positions[:, point], valid, first, end, QUANTA * quanta[point]) and _others_move(
                positions, point, first, end, QUANTA * quanta
            ):
                lost[first:end, point] = True
    return lost


def _smallest_step(path: Floats) -> float:
    """The smallest difference between coordinates that differ: of rounded data the unit of the last digit."""
    smallest = np.inf
    for values in path.T:
        steps = np.diff(np.unique(values[np.isfinite(values)]))
        if steps.size:
            smallest = min(smallest, float(steps.min()))
    return smallest if np.isfinite(smallest) else 0.0


def _distance(one: Floats, other: Floats) -> float:
    return float(np.abs(one - other).max())


def _is_frozen(path: Floats, valid: Ints, first: int, end: int, noise: float) -> bool:
    """Whether a point that keeps its position in frames first - 1 to before `end` did not rest there."""
    held = path[first]
    after = valid[np.searchsorted(valid, end) :][:2]
    if len(after) == 2:
        jump = _distance(path[after[0]], held)
        next_step = _distance(path[after[1]], path[after[0]]) / (after[1] - after[0])
        return bool(jump > max(noise, JUMP * next_step))
    before = valid[: np.searchsorted(valid, first - 1)][-2:]
    if len(before) < 2:
        return False
    last_step = _distance(held, path[before[1]]) / (first - 1 - before[1])
    step_before = _distance(path[before[1]], path[before[0]]) / (before[1] - before[0])
    return bool(last_step > max(noise, STOP * step_before))


def _others_move(positions: Floats, point: int, first: int, end: int, noise: Floats) -> bool:
    moved = np.abs(positions[first:end] - positions[first - 1]).max(axis=2, initial=0.0)
    moved[~np.isfinite(moved)] = 0.0
    moved[:, point] = 0.0
    return bool((moved.max(axis=0) > noise).any())


def about_leaps(time: Floats, positions: Floats, names: Sequence[str], file: Path | str) -> list[str]:
    """Remarks on points (T, P, 3), m, that move faster than any hand from one frame to the next."""
    if len(time) < 2:
        return []
    remarks = []
    lengths = np.linalg.norm(np.diff(positions, axis=0), axis=2)
    durations = np.maximum(np.diff(time), period_of(time))  # of frames in bursts the times are wrong, not the positions
    speeds = np.nan_to_num(lengths / durations[:, None])
    for name, of_point, speed in zip(names, lengths.T, speeds.T, strict=True):
        fast = np.flatnonzero(speed > FASTEST_M_S)
        if fast.size:
            worst = int(fast[np.argmax(speed[fast])])
            remarks.append(
                f"{file}: {name} moves {of_point[worst]:.3g} m from frame {worst} to frame {worst + 1} "
                f"({speed[worst]:.3g} m/s; {len(fast)} such steps): was it lost there, or is the unit or rate wrong?"
            )
    return remarks


def extent(positions: Floats) -> str:
    """From where to where points (T, P, 3) go in x, y and z, m, as text."""
    valid = positions[np.isfinite(positions).all(axis=-1)]
    if not len(valid):
        return "no point is ever there"
    low_high = zip("xyz", valid.min(axis=0).tolist(), valid.max(axis=0).tolist(), strict=True)
    return ", ".join(f"{axis} {low:.3g} to {high:.3g}" for axis, low, high in low_high) + " m"
