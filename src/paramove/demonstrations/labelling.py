"""Labels for recordings: movements detected by their speed, checked against the recording before they are written."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from paramove.demonstrations.gaps import fill_gaps
from paramove.demonstrations.labels import FILE_NAME, LabelsFile, Segment, append_segments, load_labels, write_labels
from paramove.demonstrations.movement import TARGET_NAMES, DemonstrationError, Movement, at_times
from paramove.demonstrations.pose_recording import read_poses
from paramove.demonstrations.reading import fault_in_recording
from paramove.demonstrations.timing import FINGERTIP, fast_parts, speeds
from paramove.documents import Floats, nearest


def movements_by_speed(
    time: Floats, positions: Floats, point_names: tuple[str, ...], point: str = FINGERTIP, max_gap: float = 0.1
) -> list[tuple[int, int]]:
    """Movements of one point: first frame and one past the last of each.

    Each begins with the first frame above 3 cm/s before the point exceeds 15 cm/s, and ends with the first frame at 3
    cm/s or less after. A movement and its return with a rest between them are two movements.

    Raises DemonstrationError if there is no such point, or it is valid in fewer than two frames.
    """
    if point not in point_names:
        raise DemonstrationError(f"there is no point '{point}' to find movements by; {nearest(point, point_names)}")
    filled, _, _ = fill_gaps(time, positions, point_names, max_gap)
    path = filled[:, point_names.index(point)]
    valid = np.isfinite(path).all(axis=1)
    if valid.sum() < 2:
        raise DemonstrationError(f"{point} is valid in {valid.sum()} frames; no movement can be detected from it")
    whole = at_times(time, time[valid], path[valid])
    movement = Movement(time - time[0], whole[:, None, :], (point,), "", "any", np.zeros(0))
    return [(first, min(end + 1, len(time))) for first, end in fast_parts(speeds(movement, point))]


def next_repetition(there: Sequence[Segment], segment: Segment) -> int:
    """One more than the highest of the same action, parameters, person and arm; 0 if there is none."""
    same = [
        one.repetition
        for one in there
        if (one.action, one.theta, one.subject, one.side)
        == (segment.action, segment.theta, segment.subject, segment.side)
    ]
    return max(same, default=-1) + 1


def label(folder: Path, segments: Sequence[Segment], parameter_names: Sequence[str] | None = None) -> None:
    """Adds segments to labels.yaml of a folder, which is made where there is none.

    Args:
        folder: With the recordings.
        segments: All are added, or none.
        parameter_names: For a new labels.yaml; None: as it is there, or target_x, target_y, target_z for three values.

    Raises DemonstrationError if a segment is not within its recording, or contradicts labels.yaml.
    """
    recordings = {name: read_poses(folder / name) for name in dict.fromkeys(one.recording for one in segments)}
    for segment in segments:
        if segment.end <= segment.start:
            raise DemonstrationError(f"{segment}: the end is not after the start")
        fault = fault_in_recording(segment, recordings[segment.recording])
        if fault:
            raise DemonstrationError(fault)
    file = folder / FILE_NAME
    if not file.exists():
        write_labels(file, LabelsFile(parameters=list(_names(segments, parameter_names))))
        try:
            append_segments(file, segments)
        except DemonstrationError:
            file.unlink()
            raise
        return
    has = load_labels(file).file.parameters
    if parameter_names is not None and list(parameter_names) != has:
        raise DemonstrationError(f"{file} has the parameters ({', '.join(has)}); a set has the same in all")
    append_segments(file, segments)


def _names(segments: Sequence[Segment], given: Sequence[str] | None) -> Sequence[str]:
    if given is not None:
        return given
    count = len(segments[0].theta) if segments else 0
    if count == 3:
        return TARGET_NAMES
    return [f"parameter_{number}" for number in range(1, count + 1)]
