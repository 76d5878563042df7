"""NPZ files: one take as plain arrays, or many labelled movements in one file.

One take: `positions` (T, P, 3) or (T, 3 P); `points`, names; `time` (T,), s, or `rate_hz` or `fps`; `unit`; `axes`.

Many: `flat` (frames, 3 P), `flat_time`, `offsets` (movements + 1,), `points`, `unit`, `axes`, and for each movement
`action`, `target` (3,), `subject`, `repetition`, `segment` (first frame, one past the last), `ok`, `reason`; `hand`.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from paramove.demonstrations import TARGET_NAMES, DemonstrationError, Label, Side
from paramove.demonstrations.importing.checking import RawTake, check_length
from paramove.documents import Floats, read_arrays

SIDES: dict[str, Side] = {"L": "left", "R": "right", "left": "left", "right": "right"}
Arrays = dict[str, Any]


def read_npz(path: Path) -> list[RawTake]:
    """Takes; the first has remarks on movements that are left out: those marked as not ok, and those without a target.

    Raises DemonstrationError for arrays that are missing or do not fit together.
    """
    arrays = read_arrays(path, raising=DemonstrationError)
    try:
        return _many(path, arrays) if "flat" in arrays else [_one(path, arrays)]
    except KeyError as error:
        there = ", ".join(sorted(arrays))
        raise DemonstrationError(f"{path}: the array {error} is missing; there are {there}") from error
    except (IndexError, ValueError, TypeError, ArithmeticError) as error:
        if isinstance(error, DemonstrationError):
            raise
        raise DemonstrationError(f"{path}: its arrays do not fit together: {error}") from error


def _one(path: Path, arrays: Arrays) -> RawTake:
    names = tuple(str(name) for name in np.atleast_1d(arrays["points"]))
    positions = np.asarray(arrays["positions"], dtype=np.float64)
    shape = (len(names), 3)
    if positions.shape[1:] not in (shape, (3 * len(names),)):
        raise DemonstrationError(
            f"{path}: positions have shape {positions.shape}; {len(names)} points need (T, {len(names)}, 3)"
            + ("; transpose(0, 2, 1) turns them" if positions.shape[1:] == shape[::-1] else "")
        )
    check_length(len(positions), path)
    rate = next((float(arrays[key]) for key in ("rate_hz", "fps") if key in arrays), None)
    if rate is not None and not 0.0 < rate < np.inf:
        raise DemonstrationError(f"{path}: a frame rate above 0 expected, found {rate:g}")
    time = np.asarray(arrays["time"], dtype=np.float64) if "time" in arrays else None
    unit_s = None
    if time is None and rate is not None:
        time = np.arange(len(positions)) / rate
        unit_s = 1.0
    if time is not None and time.shape != (len(positions),):
        raise DemonstrationError(f"{path}: {len(positions)} frames have times of shape {time.shape}")
    unit, axes = (str(arrays[key]) if key in arrays else None for key in ("unit", "axes"))
    return RawTake(
        path.stem,
        time,
        positions.reshape(len(positions), -1, 3),
        names,
        unit,
        axes,
        axes_are_known=axes is not None,
        time_unit_s=unit_s,
    )


def _many(path: Path, arrays: Arrays) -> list[RawTake]:
    names = tuple(str(name) for name in arrays["points"])
    flat = np.asarray(arrays["flat"], dtype=np.float64).reshape(len(arrays["flat_time"]), len(names), 3)
    offsets = np.concatenate([[0], arrays["offsets"].astype(int), [len(flat)]])
    if (np.diff(offsets) < 0).any() or len(offsets) < len(arrays["action"]) + 3:
        raise DemonstrationError(f"{path}: expected offsets of each movement, increasing, up to {len(flat)} frames")
    offsets = offsets[1:-1]
    without = 0
    takes: list[RawTake] = []
    left_out = []
    for number in range(len(arrays["action"])):
        if not arrays["ok"][number]:
            left_out.append(f"{number} ({arrays['reason'][number] or 'not ok'})")
        elif not np.isfinite(arrays["target"][number]).all():
            without += 1
        else:
            inside = slice(int(offsets[number]), int(offsets[number + 1]))
            takes.append(_take(path, arrays, number, flat[inside], names))
    remarks = [f"{path}: left out because the file marks them: movements {', '.join(left_out)}"] if left_out else []
    if without:
        remarks.append(f"{path}: left out {without} movements that have no target")
    if not takes:
        raise DemonstrationError(f"{path} has no movement that is ok and has a target")
    return [replace(takes[0], remarks=tuple(remarks)), *takes[1:]]


def _take(path: Path, arrays: Arrays, number: int, positions: Floats, names: tuple[str, ...]) -> RawTake:
    begin, end = int(arrays["offsets"][number]), int(arrays["offsets"][number + 1])
    time = np.asarray(arrays["flat_time"][begin:end], dtype=np.float64)
    first, last = (int(frame) for frame in arrays["segment"][number])
    if not 0 <= first < last - 1 <= len(time) - 1:
        raise DemonstrationError(
            f"{path}: movement {number} has the segment {first} to {last} of {len(time)} frames; "
            "expected its first frame and one past its last"
        )
    subject = str(arrays["subject"][number])
    label = Label(
        first,
        last,
        str(arrays["action"][number]),
        tuple(float(value) for value in arrays["target"][number]),
        subject,
        int(arrays["repetition"][number]),
        SIDES[str(arrays["hand"][number])] if "hand" in arrays else "right",
    )
    unit, axes = str(arrays["unit"]), str(arrays["axes"])
    return RawTake(
        f"{path.stem}_subject_{subject}",
        time,
        positions,
        names,
        unit,
        axes,
        axes_are_known=True,
        labels=(label,),
        parameter_names=TARGET_NAMES,
        part=f"movement {number}",
    )
