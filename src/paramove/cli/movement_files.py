"""Movements to be recognised, from whatever they lie in: a demonstration set, a recording, a file of motion capture."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from paramove.demonstrations.movement import DemonstrationError, Movement

if TYPE_CHECKING:
    from paramove.demonstrations.importing import ImportOptions
    from paramove.demonstrations.writing import Take

MAX_GAP_S = 0.1


def movements_of(path: Path, options: ImportOptions, find: str | None = None) -> list[Movement]:
    """All movements of a file or folder.

    Args:
        path: a demonstration set; a recording, whose labels beside it count; C3D, BVH, CSV or NPZ.
        options: what a file of motion capture does not tell.
        find: body point: every movement of it, by its speed. None: the labelled ones, else all frames as one.

    Raises DemonstrationError if nothing is there or it cannot be used.
    """
    from paramove.demonstrations.demonstration_set import DemonstrationSet
    from paramove.demonstrations.importing import import_file

    if path.is_dir():
        return list(DemonstrationSet.load(path))
    if path.suffix in (".mcap", ".part"):
        return _recorded(path, find)
    takes = import_file(path, options, max_gap=MAX_GAP_S)
    if takes.refused:
        raise DemonstrationError("; ".join(takes.refused))
    return [movement for take in takes.takes for movement in _of_take(take, takes.parameter_names, path, find)]


def _recorded(path: Path, find: str | None) -> list[Movement]:
    from paramove.demonstrations.demonstration_set import DemonstrationSet
    from paramove.demonstrations.labels import FILE_NAME
    from paramove.demonstrations.pose_recording import read_poses
    from paramove.demonstrations.writing import Take

    poses = read_poses(path)
    if find is None and (path.parent / FILE_NAME).is_file():
        labelled = [one for one in DemonstrationSet.load(path.parent) if one.recording == path.name]
        if labelled:
            return labelled
    take = Take(path.name, poses.time, poses.positions, poses.point_names, poses.frame)
    return list(_of_take(take, (), path, find))


def _of_take(take: Take, parameter_names: tuple[str, ...], path: Path, find: str | None) -> Iterator[Movement]:
    """Its labelled movements, those found by speed, or all of it."""
    from paramove.demonstrations.gaps import fill_gaps
    from paramove.demonstrations.labelling import movements_by_speed
    from paramove.demonstrations.writing import Label

    if find is not None:
        spans = movements_by_speed(take.time, take.positions, take.point_names, find, MAX_GAP_S)
        if not spans:
            raise DemonstrationError(f"{path}: {find} never exceeds 15 cm/s: no movement is found; is the unit right?")
        labels = [Label(first, end, "") for first, end in spans]
    else:
        labels = list(take.labels) or [Label(0, len(take.time), "")]
    filled, _, left = fill_gaps(take.time, take.positions, take.point_names, MAX_GAP_S)
    for label in labels:
        gaps = [gap for gap in left if gap.end > label.first and gap.first < label.end]
        if gaps:
            raise DemonstrationError(
                f"{path}: lost for longer than {MAX_GAP_S:g} s: {'; '.join(map(str, gaps[:4]))}; import it with "
                "`paramove demos import --max-gap`, or leave the point out with --point"
            )
        time = take.time[label.first : label.end]
        named = parameter_names if len(label.theta) == len(parameter_names) else ()
        yield Movement(
            time=time - time[:1],
            positions=filled[label.first : label.end],
            point_names=take.point_names,
            frame=take.frame,
            action=label.action,
            theta=np.array(label.theta if named else (), dtype=np.float64),
            parameter_names=named,
            subject=label.subject,
            side=label.side,
            recording=take.recording,
            source=f"{path}, {take.time[label.first]:.4g} to {take.time[label.end - 1]:.4g} s",
        )
