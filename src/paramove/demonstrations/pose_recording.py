"""Recordings of arm poses: MCAP files with the topic human/arm_pose, read into arrays and written from them."""

from __future__ import annotations

import contextlib
from array import array
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from paramove.bus import HUMAN_ARM_POSE
from paramove.demonstrations.movement import DemonstrationError
from paramove.documents import Floats, Ints
from paramove.msgs.arm_pose_pb2 import ArmPose
from paramove.recording import RecordingWriter, read

BILLION = 1_000_000_000
MAX_EMPTY = 2_000_000
MAX_RATIO = 20
"""Maximum ratio of entries in the table of points to valid positions, above `MAX_EMPTY` entries."""


@dataclass(frozen=True)
class PoseRecording:
    """Poses over time.

    Attributes:
        time_ns: Capture times, increasing. Shape (T,), ns.
        positions: Shape (T, P, 3), m, in `frame`; NaN where a point was not detected.
        point_names: Of the P points, in the order in which they first occur.
        frame: Coordinate frame.
    """

    time_ns: Ints
    positions: Floats
    point_names: tuple[str, ...]
    frame: str

    @property
    def time(self) -> Floats:
        """Capture times from that of the first pose. Shape (T,), s."""
        return (self.time_ns - self.time_ns[:1]) / BILLION


def read_poses(path: Path) -> PoseRecording:
    """All poses of a recording; of one that was never finished (ending `.part`), those that are there.

    Raises DemonstrationError if there is no such file or no pose in it, or if times or frames contradict each other.
    """
    part = path.with_name(path.name + ".part")
    file = path if path.is_file() or not part.is_file() else part
    times, columns, frames = array("q"), dict[str, int](), set()
    valid_rows, valid_columns, valid_positions = array("q"), array("q"), array("d")
    with contextlib.suppress(FileNotFoundError):
        for recorded in read(file, [HUMAN_ARM_POSE.name], DemonstrationError):
            for point in recorded.message.points:
                valid_rows.append(len(times))
                valid_columns.append(columns.setdefault(point.name, len(columns)))
                valid_positions.extend((point.x, point.y, point.z))
            captured_ns = recorded.message.captured.ToNanoseconds()
            if not 0 <= captured_ns < 2**63:
                raise DemonstrationError(f"{file}: pose {len(times)} was captured at {captured_ns / 1e9:g} s: damaged")
            times.append(captured_ns)
            frames.add(recorded.message.frame)
            if len(times) * len(columns) > max(MAX_EMPTY, MAX_RATIO * len(valid_rows)):
                raise DemonstrationError(
                    f"{file}: {len(columns)} names of points in {len(times)} poses, of which a pose has "
                    f"{len(valid_rows) / len(times):.1f}; expected poses of the same points"
                )
    if not times:
        raise _nothing(file)
    time_ns = np.array(times)
    backwards = np.flatnonzero(np.diff(time_ns) <= 0)
    if backwards.size:
        first = int(backwards[0])
        raise DemonstrationError(
            f"{file}: pose {first + 1} was captured at {time_ns[first + 1] / 1e9:.6f} s, not after pose {first} at "
            f"{time_ns[first] / 1e9:.6f} s; two sources published {HUMAN_ARM_POSE.name}: record them separately"
        )
    if len(frames) > 1:
        raise DemonstrationError(
            f"{file}: poses in different frames: {', '.join(sorted(frames))}; record them separately"
        )
    positions = np.full((len(times), len(columns), 3), np.nan)
    positions[np.array(valid_rows), np.array(valid_columns)] = np.array(valid_positions).reshape(-1, 3)
    return PoseRecording(time_ns, positions, tuple(columns), frames.pop())


def _nothing(file: Path) -> DemonstrationError:
    if not file.is_file():
        return DemonstrationError(f"there is no recording {file}", missing=True)
    with file.open("rb") as content:
        begin = content.read(8)
    if begin != b"\x89MCAP0\r\n":
        return DemonstrationError(f"{file} is no MCAP recording; `paramove demos import` makes one of other files")
    return DemonstrationError(
        f"{file} holds no pose on {HUMAN_ARM_POSE.name} that can be read; "
        f"if it is damaged, try `paramove recover {file}`"
    )


def write_poses(path: Path, recording: PoseRecording, library: str) -> None:
    """Writes a recording; a point without a finite position is left out of its pose.

    Raises RecordingExistsError if there is such a file.
    """
    finite: NDArray[np.bool_] = np.asarray(np.isfinite(recording.positions).all(axis=-1))
    with RecordingWriter(path, library) as writer:
        for number, at in enumerate(recording.time_ns.tolist()):
            pose = ArmPose(frame=recording.frame)
            pose.captured.FromNanoseconds(at)
            for name, position, valid in zip(
                recording.point_names, recording.positions[number].tolist(), finite[number].tolist(), strict=True
            ):
                if valid:
                    pose.points.add(name=name, x=position[0], y=position[1], z=position[2])
            writer.write(HUMAN_ARM_POSE.name, pose, at, at, number + 1)
