"""Writes demonstration sets: takes of motion capture become recordings, their labels become labels.yaml."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from paramove.demonstrations.labels import FILE_NAME, LabelsFile, Segment, append_segments, load_labels, write_labels
from paramove.demonstrations.movement import DemonstrationError, Movement, Side
from paramove.demonstrations.pose_recording import BILLION, PoseRecording, write_poses
from paramove.documents import Floats, checked_name, findings

LIBRARY = "paramove demonstrations"
BETWEEN_NS = 2 * BILLION
"""Between takes that share a recording; no loss of points is filled across it."""


@dataclass(frozen=True)
class Label:
    """The label of a part of a take: the frames from `first` to before `end`."""

    first: int
    end: int
    action: str
    theta: tuple[float, ...] = ()
    subject: str = ""
    repetition: int = 0
    side: Side = "right"

    @classmethod
    def of(cls, movement: Movement) -> Label:
        """The label of a whole movement."""
        theta = tuple(movement.theta.tolist())
        return cls(0, len(movement.time), movement.action, theta, movement.subject, movement.repetition, movement.side)


@dataclass(frozen=True)
class Take:
    """Frames that were captured one after the other.

    Attributes:
        recording: Name of the recording that it becomes, or becomes a part of.
        time: Shape (T,), s, increasing.
        positions: Shape (T, P, 3), m; NaN where a point was lost.
        point_names: Of the P points.
        frame: Coordinate frame.
        labels: Of the segments.
    """

    recording: str
    time: Floats
    positions: Floats
    point_names: tuple[str, ...]
    frame: str
    labels: tuple[Label, ...] = ()


def recording_name(text: str) -> str:
    """A name of a recording made of any text: letters, digits, '_' and '-', and the ending."""
    return (re.sub(r"[^A-Za-z0-9_-]+", "_", text.removesuffix(".mcap")).strip("_") or "recording") + ".mcap"


def write_set(
    folder: Path,
    takes: Sequence[Take],
    parameter_names: Sequence[str] = (),
    description: str = "",
    max_gap: float = LabelsFile.model_fields["max_gap"].default,
    *,
    add: bool = False,
) -> None:
    """Writes recordings and labels; with `add` to an existing set, whose labels.yaml keeps its comments.

    Raises DemonstrationError if there is a set or a recording already, if parameters differ from those of the set, or
    if the name of a recording or an action cannot be that of a file.
    """
    there = (folder / FILE_NAME).exists()
    _reject(folder, takes, parameter_names, there, add)
    names = dict.fromkeys(take.recording for take in takes)
    recordings = {name: _together([take for take in takes if take.recording == name]) for name in names}
    folder.mkdir(parents=True, exist_ok=True)  # nothing is written before everything is checked
    segments: list[Segment] = []
    for name, (together, its_segments) in recordings.items():
        write_poses(folder / name, together, LIBRARY)
        segments += its_segments
    if there:
        if segments:
            append_segments(folder / FILE_NAME, segments)
        return
    content = LabelsFile(
        description=description, parameters=list(parameter_names), max_gap=max_gap, segments=_in_order(takes, segments)
    )
    write_labels(folder / FILE_NAME, content)


def _reject(folder: Path, takes: Sequence[Take], parameter_names: Sequence[str], there: bool, add: bool) -> None:
    if not takes:
        raise DemonstrationError("there is no movement to write")
    if there and not add:
        raise DemonstrationError(f"{folder} holds a demonstration set already; choose another folder, or --add to it")
    if there and any(take.labels for take in takes):
        has = load_labels(folder / FILE_NAME).file.parameters
        if list(parameter_names) != has:
            raise DemonstrationError(
                f"{folder / FILE_NAME} has the parameters ({', '.join(has)}), not ({', '.join(parameter_names)}); "
                "a set has the same in all: give --parameters, or choose another folder"
            )
    labelled = [take for take in takes if take.labels]
    for take in labelled:
        if set(take.point_names) != set(labelled[0].point_names):
            raise DemonstrationError(
                f"{take.recording} has the points {', '.join(take.point_names)}, {labelled[0].recording} has "
                f"{', '.join(labelled[0].point_names)}; choose those that all have with --point or --mapping"
            )
    for name in {take.recording for take in takes}:
        checked_name(name, "recording", DemonstrationError)
        for file in (folder / name, folder / f"{name}.part"):
            if file.exists():
                raise DemonstrationError(f"{file} exists; recordings are never overwritten: give another --name")


def _together(takes: Sequence[Take]) -> tuple[PoseRecording, list[Segment]]:
    """One recording of several takes, one after the other, and the segments in it."""
    begin_ns, times, positions, segments = 0, [], [], list[Segment]()
    first = takes[0]
    for take in takes:
        if (take.point_names, take.frame) != (first.point_names, first.frame):
            raise DemonstrationError(f"takes of {take.recording} differ in points or frame; give them different names")
        time_ns = begin_ns + np.rint((take.time - take.time[0]) * BILLION).astype(np.int64)
        times.append(time_ns)
        positions.append(take.positions)
        for label in take.labels:
            start, end = (float(time_ns[frame] / BILLION) for frame in (label.first, label.end - 1))
            segments.append(_segment(take.recording, start, end, label))
        begin_ns = int(time_ns[-1]) + BETWEEN_NS
    return PoseRecording(np.concatenate(times), np.concatenate(positions), first.point_names, first.frame), segments


def _segment(recording: str, start: float, end: float, label: Label) -> Segment:
    try:
        return Segment(
            recording=recording,
            start=start,
            end=end,
            action=label.action,
            theta=list(label.theta),
            subject=label.subject,
            repetition=label.repetition,
            side=label.side,
        )
    except ValidationError as error:
        raise DemonstrationError(f"the label of {recording}, {start:g} to {end:g} s: {findings(error)}") from error


def _in_order(takes: Sequence[Take], segments: Sequence[Segment]) -> list[Segment]:
    """Segments in the order of the takes, though those of one recording were written together."""
    waiting: dict[str, list[Segment]] = {}
    for segment in segments:
        waiting.setdefault(segment.recording, []).append(segment)
    return [waiting[take.recording].pop(0) for take in takes for _ in take.labels]
