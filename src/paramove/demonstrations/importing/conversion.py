"""From a file's unit, axes and point names to metres, x forward, y left, z up, and the names of the body points."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from paramove.demonstrations import DemonstrationError, Take, position_in_theta, recording_name
from paramove.demonstrations.importing.checking import RawTake, about_leaps, checked, extent
from paramove.documents import Floats, closest, nearest, read_document

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001}
UNIT_WORDS = {
    "meter": "m",
    "metre": "m",
    "centimeter": "cm",
    "centimetre": "cm",
    "millimeter": "mm",
    "millimetre": "mm",
}
"""How files write units, without a plural's s, in small letters."""
FRAME = "laboratory"
UNLABELLED = "*"
"""Begin of the names that C3D files have for markers that nobody has named, such as `*110`."""

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
class ImportOptions:
    """Properties that a file does not define, or that replace the file's.

    Attributes:
        unit: "m", "cm" or "mm"; None: the file's.
        axes: "z_up", "y_up" or the directions of x, y, z, such as "right,up,forward"; None: the file's.
        points: Name of a body point -> names in the file, of which the mean is taken; None: all, with their names.
        rate_hz: Frame rate; None: the file's.
        zeros_are_lost: Whether a point at exactly (0, 0, 0) was lost in that frame.
        repeats_are_lost: Whether a point that repeats its position exactly, while others move, was lost.
        subject: Whose points are taken if several persons have points of one name, as in `Ann:index` and `Ben:index`.
    """

    unit: str | None = None
    axes: str | None = None
    points: Mapping[str, tuple[str, ...]] | None = None
    rate_hz: float | None = None
    zeros_are_lost: bool = True
    repeats_are_lost: bool = True
    subject: str = ""


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


def converted(raw: RawTake, options: ImportOptions, file: Path | str) -> tuple[Take, tuple[str, ...]]:
    """A take in metres, x forward, y left, z up, with the requested points, checked; and remarks on what was assumed.

    Raises DemonstrationError if the unit, the rate or a point is not known, or the take cannot be used (`checked`).
    """
    unit = options.unit or _unit(raw.unit)
    if unit is None:
        raise DemonstrationError(f"{file} does not define its unit; give --unit {', '.join(METRES)}")
    if unit not in METRES:
        raise DemonstrationError(f"{file}: the unit is '{unit}'; give --unit {', '.join(METRES)} to define it")
    take = checked(
        raw,
        file,
        rate_hz=options.rate_hz,
        zeros_are_lost=options.zeros_are_lost,
        repeats_are_lost=options.repeats_are_lost,
    )
    matrix = axes_matrix(options.axes or raw.axes or "z_up") * METRES[unit]
    chosen, names = chosen_points(take, options.points, options.subject, file)
    labels = tuple(replace(label, theta=_theta(label.theta, raw.parameter_names, matrix)) for label in take.labels)
    positions = chosen @ matrix.T
    remarks = take.remarks
    if options.axes is None and not raw.axes_are_known:
        remarks += (_assumed(raw.axes or "z_up", positions, file),)
    time: Floats = np.asarray(take.time)
    remarks += tuple(about_leaps(time, positions, names, file))
    return Take(recording_name(raw.name), time, positions, names, FRAME, labels), remarks


def _unit(word: str | None) -> str | None:
    """A file's unit as this program calls it; one that it does not know as it is."""
    if word is None:
        return None
    small = word.strip().casefold()
    return UNIT_WORDS.get(small.removesuffix("s"), small if small in METRES else word)


def _assumed(axes: str, positions: Floats, file: Path | str) -> str:
    """What was assumed of the axes, with the extent that follows: a person sees which way is up."""
    up = axes_matrix(axes)[2]
    letter = "xyz"[int(np.argmax(np.abs(up)))]
    sign = "-" if up.min() < -0.5 else ""
    return (
        f"{file}: the file does not define its axes; its {sign}{letter} is taken as up ({axes}; --axes changes it): "
        f"{extent(positions)}, z up"
    )


def _theta(theta: tuple[float, ...], names: tuple[str, ...], matrix: Floats) -> tuple[float, ...]:
    values = np.array(theta, dtype=np.float64)
    position = position_in_theta(names)
    if position is not None:
        values[position] = matrix @ values[position]
    return tuple(values.tolist())


def chosen_points(
    take: RawTake, requested: Mapping[str, tuple[str, ...]] | None, subject: str, file: Path | str
) -> tuple[Floats, tuple[str, ...]]:
    """Body points out of a file's points: each the mean of one or several; lost where one of them is.

    A file's name may be given without what stands before its last ':' (`Anna:RWRA`); then all come from one person, the
    subject if there are several. Raises DemonstrationError with the names there are, with all that are meant if several
    are, and for points that cannot be used. Points that are not requested do not matter.
    """
    if requested is None:
        named = [name for name in take.point_names if name and not name.startswith(UNLABELLED)]
        of_subject = [name for name in named if subject and _person(name) == subject.casefold()]
        requested = {name: (name,) for name in of_subject or named}
    numbers: dict[str, int] = {}
    for point, names in requested.items():
        for source in names:
            numbers[source] = _number(source, point, take.point_names, subject, file)
    found = {source: take.point_names[number] for source, number in numbers.items()}
    _reject_mixed_persons([name for source, name in found.items() if name != source], file)
    for number in numbers.values():
        if take.point_names[number] in take.faults:
            raise DemonstrationError(take.faults[take.point_names[number]])
    columns = [
        take.positions[:, [numbers[name] for name in names]].mean(axis=1)
        if len(names) > 1
        else take.positions[:, numbers[names[0]]]
        for names in requested.values()
    ]
    if not columns:
        raise DemonstrationError(f"{file} has no point with a name")
    return np.stack(columns, axis=1), tuple(requested)


def _number(source: str, point: str, names: Sequence[str], subject: str, file: Path | str) -> int:
    """Number of the one point of a file that is meant by a name for a body point."""
    whole = [number for number, name in enumerate(names) if name == source]
    short = [number for number, name in enumerate(names) if name.rpartition(":")[2] == source]
    of_subject = [number for number in short if subject and _person(names[number]) == subject.casefold()]
    if ":" not in source and subject and subject.casefold() in map(_person, names):
        candidates = of_subject
    else:
        candidates = whole or short
    if not candidates:
        ends = [name.rpartition(":")[2] for name in names]
        hint = "".join(f"; did you mean '{one}'?" for one in closest(source, ends))
        raise DemonstrationError(f"{file} has no point '{source}' for {point}{hint} It has {', '.join(names)}")
    if len(candidates) > 1:
        there = ", ".join(f"{names[number]} (point {number + 1})" for number in candidates)
        raise DemonstrationError(
            f"{file}: '{source}' may be {there}; give the whole name with --point, or the person with --subject, or "
            "different names to the points"
        )
    return candidates[0]


def _person(name: str) -> str:
    """What stands before the last ':' of a point's name."""
    return name.rpartition(":")[0].casefold()


def _reject_mixed_persons(names: Sequence[str], file: Path | str) -> None:
    """Raises DemonstrationError if points whose short names were given belong to several persons."""
    of_person = {_person(name): name for name in names}
    if len(of_person) > 1:
        raise DemonstrationError(
            f"{file}: the requested points are of several persons: {', '.join(names)}; give whole names with --point"
        )


def _as_list(value: object) -> object:
    return [value] if isinstance(value, str) else value


class MappingFile(BaseModel):
    """A mapping file: how to read the files of one laboratory."""

    model_config = ConfigDict(extra="forbid", strict=True)

    unit: Literal["m", "cm", "mm"] | None = None
    axes: str | None = None
    rate: Annotated[float, Field(gt=0.0)] | None = None
    zeros_are_lost: bool = True
    repeats_are_lost: bool = True
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
    return ImportOptions(
        mapping.unit, mapping.axes, points, mapping.rate, mapping.zeros_are_lost, mapping.repeats_are_lost
    )
