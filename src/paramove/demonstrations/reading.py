"""The segments of labels.yaml cut out of their recordings; faults are reported with their lines."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from paramove.demonstrations.gaps import PointGap, fill_gaps
from paramove.demonstrations.labels import Labels, LabelsError, Segment
from paramove.demonstrations.movement import DemonstrationError, Movement
from paramove.demonstrations.pose_recording import BILLION, PoseRecording, read_poses
from paramove.documents import DocumentError, Floats, nearest, raise_any


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
        self._recordings: dict[str, _Filled | None] = {}
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
        wrong = self._out_of_range(segment, recording.poses)
        if wrong:
            self.findings.append(self._labels.error(index, wrong))
            return None
        chosen = recording.frames(segment)
        wrong = _too_few(segment, chosen, recording.poses) or _open_gaps(segment, chosen, recording, self._max_gap)
        if wrong:
            self.findings.append(self._labels.error(index, wrong))
            return None
        self._remark(index, segment, chosen, recording)
        return self._cut(index, segment, chosen, recording)

    @property
    def _max_gap(self) -> float:
        return self._labels.file.max_gap

    def _read(self, index: int, segment: Segment) -> _Filled | None:
        folder = self._labels.path.parent
        path = folder / segment.recording
        if not path.is_file() and not path.with_name(path.name + ".part").is_file():
            there = sorted(one.name for one in folder.glob("*.mcap"))
            message = f"there is no recording {segment.recording} in {folder}; {nearest(segment.recording, there)}"
            self.findings.append(self._labels.error(index, message, "recording"))
            return None
        try:
            poses = read_poses(path)
            return _Filled(self._with_points(poses, segment.recording), self._max_gap)
        except DemonstrationError as error:
            self.findings.append(self._labels.error(index, str(error), "recording"))
            return None

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

    def _out_of_range(self, segment: Segment, poses: PoseRecording) -> str:
        time = poses.time
        frame_s = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
        if segment.end <= time[-1] + frame_s:
            return ""
        return (
            f"{_words(segment)} ends after its recording, which covers 0 to {time[-1]:.6g} s: correct start and end"
            f", or, if {segment.recording} was cut off, see `paramove recover`"
        )

    def _remark(self, index: int, segment: Segment, chosen: NDArray[np.intp], recording: _Filled) -> None:
        inside = [gap for gap in recording.filled if gap.end > chosen[0] and gap.first <= chosen[-1]]
        if inside:
            location = f"{self._labels.path.name}:{self._labels.line(index)}"
            gaps = "; ".join(map(str, inside[:3])) + (f" and {len(inside) - 3} more" if len(inside) > 3 else "")
            self.remarks.append(f"{location}: {_words(segment)}: filled {gaps}")

    def _cut(self, index: int, segment: Segment, chosen: NDArray[np.intp], recording: _Filled) -> Movement:
        time_ns = recording.poses.time_ns[chosen]
        return Movement(
            time=(time_ns - time_ns[0]) / BILLION,
            positions=recording.positions[chosen],
            point_names=recording.poses.point_names,
            frame=recording.poses.frame,
            action=segment.action,
            theta=np.array(segment.theta, dtype=np.float64),
            parameter_names=tuple(self._labels.file.parameters),
            subject=segment.subject,
            repetition=segment.repetition,
            side=segment.side,
            recording=segment.recording,
            source=f"{self._labels.path}:{self._labels.line(index)}: {_words(segment)}",
        )


class _Filled:
    """A recording with its short gaps filled."""

    def __init__(self, poses: PoseRecording, max_gap: float) -> None:
        self.poses = poses
        self.positions: Floats
        self.positions, self.filled, self.open = fill_gaps(poses.time, poses.positions, poses.point_names, max_gap)

    def frames(self, segment: Segment) -> NDArray[np.intp]:
        """Frames of a segment, both ends included."""
        since = self.poses.time_ns - self.poses.time_ns[0]
        inside = (since >= round(segment.start * BILLION)) & (since <= round(segment.end * BILLION))
        return np.flatnonzero(inside)


def _words(segment: Segment) -> str:
    return f"{segment.recording}, {segment.start:g} to {segment.end:g} s"


def _too_few(segment: Segment, chosen: NDArray[np.intp], poses: PoseRecording) -> str:
    if len(chosen) > 1:
        return ""
    rate = (len(poses.time) - 1) / poses.time[-1] if len(poses.time) > 1 else 0.0
    return (
        f"{_words(segment)} holds {len(chosen)} frame{'' if len(chosen) == 1 else 's'} of {len(poses.time)} "
        f"(about {rate:.3g} Hz); a movement has at least 2: make it longer"
    )


def _open_gaps(segment: Segment, chosen: NDArray[np.intp], recording: _Filled, max_gap: float) -> str:
    inside: list[PointGap] = [gap for gap in recording.open if gap.end > chosen[0] and gap.first <= chosen[-1]]
    if not inside:
        return ""
    gaps: str = "; ".join(map(str, inside[:4])) + (f" and {len(inside) - 4} more" if len(inside) > 4 else "")
    return (
        f"{_words(segment)}: lost for longer than max_gap ({max_gap:g} s): {gaps}, counted from the beginning of the "
        "recording. Leave the point out with `points`, shorten the segment, or raise max_gap"
    )
