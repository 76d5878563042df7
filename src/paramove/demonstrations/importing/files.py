"""One file of motion capture, of any kind, as takes for a demonstration set."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from paramove.demonstrations import (
    DemonstrationError,
    Label,
    Take,
    fill_gaps,
    gaps_in_words,
    gaps_within,
    movements_by_speed,
    recording_name,
)
from paramove.demonstrations.importing.bvh import read_bvh
from paramove.demonstrations.importing.c3d import read_c3d
from paramove.demonstrations.importing.checking import RawTake
from paramove.demonstrations.importing.conversion import ImportOptions, converted
from paramove.demonstrations.importing.csv_file import read_csv
from paramove.demonstrations.importing.npz import read_npz

READERS: dict[str, Callable[[Path], list[RawTake]]] = {
    ".c3d": read_c3d,
    ".bvh": read_bvh,
    ".csv": read_csv,
    ".tsv": read_csv,
    ".npz": read_npz,
}
SUFFIXES = tuple(READERS)


@dataclass(frozen=True)
class Imported:
    """The content of a file.

    Attributes:
        takes: In metres, x forward, y left, z up.
        parameter_names: Of theta, as the file has them; () if it has no labels.
        remarks: What was left out or will be filled.
        rejected: Labelled movements in which a point is lost for too long; they are not among the labels.
    """

    takes: tuple[Take, ...]
    parameter_names: tuple[str, ...]
    remarks: tuple[str, ...]
    rejected: tuple[str, ...]


def import_file(
    path: Path,
    options: ImportOptions,
    label: Label | None = None,
    max_gap: float = 0.1,
    name: str | None = None,
    find: str | None = None,
) -> Imported:
    """Reads a file and checks its labelled movements for lost points.

    Args:
        path: Of one of `SUFFIXES`.
        options: Properties that the file does not define.
        label: For a file without labels; its `end` may be 0 for the last frame. None: it is left unlabelled.
        max_gap: s; maximum time for which a point may be lost in a labelled movement.
        name: Begin of the recordings' names; None: the file's.
        find: Body point; every movement of it gets the label, instead of the whole take.

    Raises DemonstrationError if the file is missing, damaged or of no known kind.
    """
    if not path.is_file():
        raise DemonstrationError(f"there is no file {path}", missing=True)
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise DemonstrationError(f"{path}: files of motion capture end in {', '.join(SUFFIXES)}")
    raws = reader(path)
    takes, rejected = [], []
    remarks: dict[str, None] = {}  # many takes of a file may have the same
    for raw in raws:
        source = f"{path}, {raw.part}" if raw.part else str(path)
        take, about = converted(raw, options, source)
        if name is not None:
            take = replace(take, recording=recording_name(name + raw.name.removeprefix(path.stem)))
        if not take.labels and label is not None:
            take = replace(take, labels=_labels(take, label, find, max_gap, source))
        accepted, about_gaps, new_rejected = _without_long_gaps(take, source, max_gap)
        takes.append(accepted)
        remarks |= dict.fromkeys([*about, *about_gaps])
        rejected += new_rejected
    return Imported(tuple(takes), raws[0].parameter_names, tuple(remarks), tuple(rejected))


def _labels(take: Take, label: Label, find: str | None, max_gap: float, path: str) -> tuple[Label, ...]:
    """The label for the whole take, or for each movement that is detected in it."""
    if find is None:
        return (replace(label, end=label.end or len(take.time)),)
    try:
        movements = movements_by_speed(take.time, take.positions, take.point_names, find, max_gap)
    except DemonstrationError as error:
        raise DemonstrationError(f"{path}: {error}") from error
    if not movements:
        raise DemonstrationError(f"{path}: {find} never exceeds 15 cm/s; is the unit right?")
    return tuple(replace(label, first=first, end=end) for first, end in movements)


def _without_long_gaps(take: Take, path: str, max_gap: float) -> tuple[Take, list[str], list[str]]:
    """The take with the labels of those movements in which no point is lost for too long; remarks; rejected ones."""
    _, filled, left = fill_gaps(take.time, take.positions, take.point_names, max_gap)
    labels, remarks, rejected = [], [], []
    for label in take.labels:
        what = f"{path}: {label.action}, frames {label.first}-{label.end - 1}"
        if not 0 <= label.first < label.end - 1 <= len(take.time) - 1:
            rejected.append(f"{what}: the file has frames 0-{len(take.time) - 1}, and a movement has at least 2")
            continue
        open_gaps = gaps_within(left, label.first, label.end)
        if open_gaps:
            always = [gap.point for gap in open_gaps if gap.end - gap.first == len(take.time)]
            hint = (
                f" {', '.join(always)} is lost in all frames: name those that are needed with --point; or is it "
                "(0, 0, 0) on purpose (--zeros-are-places)?"
                if always
                else ""
            )
            rejected.append(f"{what}: lost for longer than {max_gap:g} s: {gaps_in_words(open_gaps)}.{hint}")
            continue
        shut = gaps_within(filled, label.first, label.end)
        if shut:
            remarks.append(f"{what}: filled {gaps_in_words(shut)}")
        labels.append(label)
    if not np.isfinite(take.positions).any():
        rejected.append(f"{path}: all points are lost in all frames")
    return replace(take, labels=tuple(labels)), remarks, rejected
