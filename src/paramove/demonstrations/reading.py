"""The segments of labels.yaml cut out of their recordings; faults are reported with their lines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from paramove.demonstrations.frame_times import longest_hole
from paramove.demonstrations.gaps import PointGap, fill_gaps, gaps_in_words, gaps_within
from paramove.demonstrations.labels import Labels, LabelsError, Segment
from paramove.demonstrations.movement import DemonstrationError, Movement
from paramove.demonstrations.pose_recording import BILLION, PoseRecording, read_poses
from paramove.documents import DocumentError, nearest, raise_any

TIME_TOLERANCE_S = 1e-6
"""Times of recordings are whole nanoseconds, and sums of them are rounded."""


def read_movements(labels: Labels) -> tuple[list[Movement], list[str]]:
    """The movements of all segments, and remarks about gaps that were filled.

    Raises LabelsError with every segment that cannot be used.
    """
    reader = _Reader(labels)
    movements = [reader.movement(index, segment) for index, segment in enumerate(labels.file.segments)]
    try:
        raise_any(reader.findings)
    except DocumentError as error:
        raise LabelsError(error) from error
    return [movement for movement in movements if movement is not None], reader.remarks


class _Reader:
    """Reads each recording once and collects the faults."""

    def __init__(self, labels: Labels) -> None:
        self.findings: list[DocumentError] = []
        self.remarks: list[str] = []
        self._labels = labels
        self._recordings: dict[str, tuple[PoseRecording, list[PointGap], list[PointGap]] | None] = {}
        self._points: tuple[str, ...] = tuple(labels.file.points or ())
        self._pattern = ""
        """Name of the recording whose points and frame the others must have."""

    def movement(self, index: int, segment: Segment) -> Movement | None:
        """The movement of a segment; None, and a finding, if there is none."""
        if segment.recording not in self._recordings:
            self._recordings[segment.recording] = self._read(index, segment)
        recording = self._recordings[segment.recording]
        if recording is None:
            return None
        poses, filled, left = recording
        fault = fault_in_recording(segment, poses)
        if fault:
            self.findings.append(self._labels.error(index, fault))
            return None
        chosen = _frames(segment, poses)
        hole_s = longest_hole(poses.time[chosen])
        if hole_s > self._labels.file.max_gap + TIME_TOLERANCE_S:
            message = (
                f"{segment}: no pose at all for {hole_s:.3g} s, longer than max_gap ({self._labels.file.max_gap:g} s). "
                "Shorten the segment, or raise max_gap"
            )
            self.findings.append(self._labels.error(index, message))
            return None
        inside = gaps_within(left, chosen[0], chosen[-1] + 1)
        if inside:
            message = (
                f"{segment}: lost for longer than max_gap ({self._labels.file.max_gap:g} s): {gaps_in_words(inside)}, "
                "counted from the beginning of the recording. Leave the point out with `points`, shorten the segment, "
                "or raise max_gap"
            )
            self.findings.append(self._labels.error(index, message))
            return None
        inside = gaps_within(filled, chosen[0], chosen[-1] + 1)
        if inside:
            location = f"{self._labels.path.name}:{self._labels.line(index)}"
            self.remarks.append(f"{location}: {segment}: filled {gaps_in_words(inside, 3)}")
        return self._cut(index, segment, chosen, poses)

    def _read(self, index: int, segment: Segment) -> tuple[PoseRecording, list[PointGap], list[PointGap]] | None:
        """The recording with its short gaps filled, these gaps, and those that are too long."""
        folder = self._labels.path.parent
        path = folder / segment.recording
        if not path.is_file() and not path.with_name(path.name + ".part").is_file():
            there = sorted(one.name for one in folder.glob("*.mcap"))
            message = f"there is no recording {segment.recording} in {folder}; {nearest(segment.recording, there)}"
            self.findings.append(self._labels.error(index, message, "recording"))
            return None
        try:
            poses = self._with_points(read_poses(path), segment.recording)
        except DemonstrationError as error:
            self.findings.append(self._labels.error(index, str(error), "recording"))
            return None
        positions, filled, left = fill_gaps(poses.time, poses.positions, poses.point_names, self._labels.file.max_gap)
        return replace(poses, positions=positions), filled, left

    def _with_points(self, poses: PoseRecording, name: str) -> PoseRecording:
        """The points that the set has, in its order; raises DemonstrationError if the recording has others."""
        expected = self._points or poses.point_names
        missing = [point for point in expected if point not in poses.point_names]
        more = [] if self._labels.file.points else [point for point in poses.point_names if point not in expected]
        if missing or more:
            of = "`points` of labels.yaml names" if self._labels.file.points else f"{self._pattern} has"
            raise DemonstrationError(
                f"{name} has the points {', '.join(poses.point_names)}; {of} {', '.join(expected)}. "
                "Import it again with names for its points, or choose with `points` in labels.yaml what all have"
            )
        self._points, self._pattern = expected, self._pattern or name
        order = [poses.point_names.index(point) for point in expected]
        return PoseRecording(poses.time_ns, poses.positions[:, order], expected, poses.frame)

    def _cut(self, index: int, segment: Segment, chosen: NDArray[np.intp], poses: PoseRecording) -> Movement:
        time_ns = poses.time_ns[chosen]
        return Movement(
            time=(time_ns - time_ns[0]) / BILLION,
            positions=poses.positions[chosen],
            point_names=poses.point_names,
            frame=poses.frame,
            action=segment.action,
            theta=np.array(segment.theta, dtype=np.float64),
            parameter_names=tuple(self._labels.file.parameters),
            subject=segment.subject,
            repetition=segment.repetition,
            side=segment.side,
            recording=segment.recording,
            source=f"{self._labels.path}:{self._labels.line(index)}: {segment}",
        )


def fault_in_recording(segment: Segment, poses: PoseRecording) -> str:
    """Why a segment is no movement of its recording; "" if it is one."""
    time = poses.time
    frame_s = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    if segment.end > time[-1] + frame_s:
        return (
            f"{segment} ends after its recording, which covers 0 to {time[-1]:.6g} s: correct start and end"
            f", or, if {segment.recording} was cut off, see `paramove recover`"
        )
    count = len(_frames(segment, poses))
    if count > 1:
        return ""
    rate = (len(time) - 1) / time[-1] if len(time) > 1 else 0.0
    return (
        f"{segment} holds {count} frame{'' if count == 1 else 's'} of {len(time)} "
        f"(about {rate:.3g} Hz); a movement has at least 2: make it longer"
    )


def _frames(segment: Segment, poses: PoseRecording) -> NDArray[np.intp]:
    """Frames of a segment, both ends included."""
    since = poses.time_ns - poses.time_ns[0]
    return np.flatnonzero((since >= round(segment.start * BILLION)) & (since <= round(segment.end * BILLION)))
