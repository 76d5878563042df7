"""From a file's unit, axes and point names to metres, x forward, y left, z up, and the names of the body points."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from paramove.demonstrations import DemonstrationError, Label, Take, position_in_theta, recording_name
from paramove.documents import Floats, closest, nearest, read_document

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001}
FRAME = "laboratory"
LONGEST_S = 1e7
SHORTEST_S = 1e-9
"""Between two frames: times are written in whole nanoseconds."""

DIRECTIONS = {
    "forward": (1.0, 0.0, 0.0),
    "backward": (-1.0, 0.0, 0.0),
    "left": (0.0, 1.0, 0.0),
    "right": (0.0, -1.0, 0.0),
    "up": (0.0, 0.0, 1.0),
    "down": (0.0, 0.0, -1.0),
}
PRESETS = {"z_up": "forward,left,up", "y_up": "left,up,forward"}
"""z_up: x forward, y left (Vicon, Qualisys). y_up: x left, z forward (BVH, OptiTrack)."""


@dataclass(frozen=True)
class RawTake:
    """Frames that were captured one after the other, in the unit, axes and names of their file.

    Attributes:
        name: For the recording that it becomes a part of.
        time: Shape (T,), s; None if the file has neither times nor a rate.
        positions: Shape (T, P, 3), in the file's unit and axes; NaN where a point was lost.
        point_names: Of the P points, as the file has them.
        unit: "m", "cm", "mm"; None if the file does not define it.
        axes: Directions of x, y, z as `axes_matrix` takes them; None if the file does not define it.
        labels: The file's labels of movements; positions in theta are in the file's unit and axes.
        parameter_names: Of theta.
    """

    name: str
    time: Floats | None
    positions: Floats
    point_names: tuple[str, ...]
    unit: str | None = None
    axes: str | None = None
    labels: tuple[Label, ...] = ()
    parameter_names: tuple[str, ...] = ()


@dataclass(frozen=True)
class ImportOptions:
    """Properties that a file does not define, or that replace the file's.

    Attributes:
        unit: "m", "cm" or "mm"; None: the file's.
        axes: "z_up", "y_up" or the directions of x, y, z, such as "right,up,forward"; None: the file's.
        points: Name of a body point -> names in the file, of which the mean is taken; None: all, with their names.
        rate_hz: Frame rate; None: the file's.
        zeros_are_lost: Whether a point at exactly (0, 0, 0) was lost in that frame.
    """

    unit: str | None = None
    axes: str | None = None
    points: Mapping[str, tuple[str, ...]] | None = None
    rate_hz: float | None = None
    zeros_are_lost: bool = True


def axes_matrix(axes: str) -> Floats:
    """Matrix from a file's axes to x forward, y left, z up. Shape (3, 3), a permutation with signs.

    Takes "z_up", "y_up", three directions ("right,up,forward") or text with them ("x right, y up, z forward").
    A left-handed file is converted too. Raises DemonstrationError with the accepted values.
    """
    text = PRESETS.get(axes, axes)
    if text == axes:
        loose = re.search(r"\b([yz]) up\b", axes)
        words = re.findall(r"\b(?:[xyz] )?(" + "|".join(DIRECTIONS) + r")\b", axes)
        text = ",".join(words) if len(words) == 3 else PRESETS[f"{loose[1]}_up"] if loose else axes
    names = [name.strip() for name in text.split(",")]
    columns = [DIRECTIONS.get(name, (0.0, 0.0, 0.0)) for name in names]
    matrix: Floats = np.array(columns).T
    if matrix.shape != (3, 3) or abs(abs(np.linalg.det(matrix)) - 1.0) > 0.5:
        raise DemonstrationError(
            f"axes '{axes}': expected {', '.join(PRESETS)}, or the directions of the file's x, y and z, "
            f"such as right,up,forward, out of {', '.join(DIRECTIONS)}, each axis once"
        )
    return matrix


def converted(raw: RawTake, options: ImportOptions, file: Path) -> Take:
    """A take in metres, x forward, y left, z up, with the requested points.

    Raises DemonstrationError if the unit, the rate or a point is not known.
    """
    unit = options.unit or raw.unit
    if unit is None:
        raise DemonstrationError(f"{file} does not define its unit; give --unit {', '.join(METRES)}")
    if unit not in METRES:
        raise DemonstrationError(f"{file}: the unit is '{unit}'; give --unit {', '.join(METRES)} to define it")
    matrix = axes_matrix(options.axes or raw.axes or "z_up") * METRES[unit]
    positions = raw.positions.copy()
    if options.zeros_are_lost:
        positions[(positions == 0.0).all(axis=-1)] = np.nan
    positions, names = chosen_points(positions, raw.point_names, options.points, file)
    labels = tuple(replace(label, theta=_theta(label.theta, raw.parameter_names, matrix)) for label in raw.labels)
    return Take(recording_name(raw.name), _time(raw, options, file), positions @ matrix.T, names, FRAME, labels)


def _theta(theta: tuple[float, ...], names: tuple[str, ...], matrix: Floats) -> tuple[float, ...]:
    values = np.array(theta, dtype=np.float64)
    position = position_in_theta(names)
    if position is not None:
        values[position] = matrix @ values[position]
    return tuple(values.tolist())


def _time(raw: RawTake, options: ImportOptions, file: Path) -> Floats:
    if options.rate_hz is not None:
        return np.arange(len(raw.positions)) / options.rate_hz
    if raw.time is None:
        raise DemonstrationError(f"{file} has neither times nor a frame rate; give --rate")
    if len(raw.time) and not np.ptp(raw.time) < LONGEST_S:
        raise DemonstrationError(
            f"{file}: its times go from {raw.time[0]:g} to {raw.time[-1]:g} s; expected seconds, at most {LONGEST_S:g}"
        )
    bad = np.flatnonzero(~(np.diff(raw.time) > SHORTEST_S))
    if bad.size:
        frame = int(bad[0]) + 1
        raise DemonstrationError(
            f"{file}: the time of frame {frame} is {raw.time[frame]:g} s, not after {raw.time[frame - 1]:g} s; "
            "correct it, or give --rate to count frames instead"
        )
    return raw.time


def chosen_points(
    positions: Floats, names: Sequence[str], requested: Mapping[str, tuple[str, ...]] | None, file: Path
) -> tuple[Floats, tuple[str, ...]]:
    """Body points out of a file's points: each the mean of one or several; lost where one of them is.

    A file's name may be given without what stands before its last ':' (`Anna:RWRA`). Raises DemonstrationError with
    the names there are.
    """
    if requested is None:
        return positions, tuple(names)
    short = {name.rpartition(":")[2]: number for number, name in enumerate(names)}
    full = {name: number for number, name in enumerate(names)}
    columns = []
    for point, sources in requested.items():
        unknown = [source for source in sources if source not in full and source not in short]
        if unknown:
            hint = "".join(f"; did you mean '{one}'?" for one in closest(unknown[0], short))
            raise DemonstrationError(f"{file} has no point '{unknown[0]}' for {point}{hint} It has {', '.join(names)}")
        numbers = [full.get(source, short.get(source, 0)) for source in sources]
        columns.append(positions[:, numbers].mean(axis=1) if len(numbers) > 1 else positions[:, numbers[0]])
    return np.stack(columns, axis=1), tuple(requested)


def _as_list(value: object) -> object:
    return [value] if isinstance(value, str) else value


class MappingFile(BaseModel):
    """A mapping file: how to read the files of one laboratory."""

    model_config = ConfigDict(extra="forbid", strict=True)

    unit: Literal["m", "cm", "mm"] | None = None
    axes: str | None = None
    rate: Annotated[float, Field(gt=0.0)] | None = None
    zeros_are_lost: bool = True
    points: dict[str, Annotated[list[str], BeforeValidator(_as_list), Field(min_length=1)]] | None = None


def read_mapping_file(path: Path) -> ImportOptions:
    """Options of a mapping file; raises DemonstrationError with file:line:column of the fault."""
    document = read_document(path, "mapping file", DemonstrationError, "it has lines such as points: {index: RFIN}")
    try:
        mapping = MappingFile.model_validate(document.data)
    except ValidationError as error:
        first = error.errors()[0]
        keys = tuple(str(part) for part in first["loc"])
        known = nearest(keys[-1], MappingFile.model_fields) if first["type"] == "extra_forbidden" else first["msg"]
        raise DemonstrationError(f"{document.position(keys)}: {'.'.join(keys)}: {known}") from error
    if mapping.axes is not None:
        axes_matrix(mapping.axes)
    points = None if mapping.points is None else {name: tuple(sources) for name, sources in mapping.points.items()}
    return ImportOptions(mapping.unit, mapping.axes, points, mapping.rate, mapping.zeros_are_lost)
