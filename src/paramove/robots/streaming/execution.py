"""What the robot reports, in radians, and one trajectory while the robot plays it.

Which rows come next, whether the stream has failed, when it is done.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates

from paramove.documents import Floats
from paramove.robots import JointRangeError, RobotDescription
from paramove.robots.streaming.stream import Playing, StreamState
from paramove.safety import Fault, Measured

START_TIMEOUT_S = 0.5
SETTLE_TIMEOUT_S = 1.0
GEARED_TOLERANCE = float(np.deg2rad(1.0))
SERVO_TOLERANCE = float(np.deg2rad(3.0))  # two units of the wrist
STILL = float(np.deg2rad(8.0))  # rad/s; a servo's unit in one camera period is 15 deg/s or more


@dataclass(frozen=True, eq=False)
class RobotReport:
    """One report. Arrays [J], rad or rad/s; `velocities` are differences to the report before."""

    captured_ns: int
    stream: StreamState
    positions: Floats
    commanded: Floats
    velocities: Floats

    @classmethod
    def of(
        cls, state: StreamState, captured_ns: int, description: RobotDescription, before: RobotReport | None
    ) -> RobotReport | None:
        """In radians; None if the counts are not those of this robot: they are not replaced by invented ones."""
        units = description.units
        try:
            positions = units.to_radians(state.counts)
            # A robot that does not report its targets is taken to hold its position.
            commanded = units.to_radians(state.target_counts) if len(state.target_counts) else positions
        except JointRangeError:
            return None
        velocities = np.zeros(description.n_joints)
        if before is not None and captured_ns > before.captured_ns:
            velocities = (positions - before.positions) / ((captured_ns - before.captured_ns) * 1e-9)
        return cls(captured_ns, state, positions, commanded, velocities)

    @property
    def at_rest(self) -> bool:
        """Whether the robot plays nothing."""
        return self.stream.playing in (Playing.NOTHING, Playing.HELD)

    def next_index(self, epoch: int) -> int:
        """Of the row to be played next; of another epoch no row counts as played."""
        return self.stream.next_index if self.stream.epoch == epoch else 0

    def measured(self, epoch: int) -> Measured:
        """As input of the safety gate, which serves the stream of this epoch."""
        return Measured(self.captured_ns, self.positions, self.commanded, self.at_rest, self.next_index(epoch))

    def joint_states(self, names: Sequence[str]) -> JointStates:
        """As the standard message, all joints, rad and rad/s."""
        message = JointStates()
        message.timestamp.FromNanoseconds(self.captured_ns)
        for name, position, velocity in zip(names, self.positions, self.velocities, strict=True):
            message.joints.append(JointState(name=name, position=position, velocity=velocity))
        return message


@dataclass(eq=False)
class Execution:
    """Rows [N, J] in rad of an accepted trajectory; row 0 is the pose before it, row i has the index start + i - 1."""

    trajectory_id: str
    rows: Floats
    dt_s: float
    start_index: int
    begun_ns: int
    played_ns: int | None = None

    @property
    def duration_s(self) -> float:
        """From the first row to the last."""
        return (len(self.rows) - 1) * self.dt_s

    @property
    def end_index(self) -> int:
        """Index after the last row."""
        return self.start_index + len(self.rows) - 1

    def window(self, next_index: int, guard: int, cover: int, ahead: int) -> tuple[Floats, Floats, int]:
        """Rows to send now, those after them for the stop ramp, and the first one's index.

        Rows from `next_index` up to the guard are left alone, for they may be played before this batch arrives.
        """
        first = self.start_index
        if next_index > self.start_index:
            first = min(next_index + guard, self.end_index)
        offset = first - self.start_index + 1
        last = offset + cover + (guard if first == self.start_index else 0)
        return self.rows[offset:last], self.rows[last : last + ahead], first

    def time_s(self, report: RobotReport, epoch: int) -> float:
        """How far along the trajectory the robot is."""
        return float(np.clip(report.next_index(epoch) - self.start_index, 0, len(self.rows) - 1)) * self.dt_s

    def fault(self, report: RobotReport, epoch: int, now_ns: int) -> Fault | None:
        """What is wrong with the stream: it never began, ran out or was lost; None if it is all right."""
        next_index, rejection = report.next_index(epoch), report.stream.rejection
        why = f"; the robot reports: {rejection}" if rejection else ""
        if next_index <= self.start_index:
            if now_ns - self.begun_ns < START_TIMEOUT_S * 1e9:
                return None
            return Fault("stream_not_begun", "", f"nothing was played within {START_TIMEOUT_S:g} s{why}")
        ran_out = report.at_rest or report.stream.playing == Playing.STOP_RAMP
        if not ran_out or next_index >= self.end_index:
            return None
        progress = f"{next_index - self.start_index} of {len(self.rows) - 1} rows"
        return Fault("stream_under_run", "", f"the robot ran out of rows after {progress} and stops{why}; arm again")

    def ending(self, report: RobotReport, epoch: int, now_ns: int, description: RobotDescription) -> str | None:
        """None while it lasts, "" once the robot has played all rows and arrived, else why it failed."""
        played = report.stream.epoch == epoch and report.stream.next_index >= self.end_index
        if not played or not report.at_rest:
            return None
        if self.played_ns is None:
            self.played_ns = report.captured_ns
        away = np.abs(report.positions - self.rows[-1])
        arrived = away <= np.where(description.velocity_loop, GEARED_TOLERANCE, SERVO_TOLERANCE)
        for gripper in description.gripper_indices:
            # Fingers that hold something never arrive; it is enough that they rest.
            arrived[gripper] |= bool(abs(report.velocities[gripper]) < STILL)
        if arrived.all():
            return ""
        if now_ns - self.played_ns < SETTLE_TIMEOUT_S * 1e9:
            return None
        worst = int(np.argmax(np.where(arrived, 0.0, away)))
        return (
            f"joint {description.joint_names[worst]} is {np.rad2deg(away[worst]):.2f} deg from its target "
            f"{SETTLE_TIMEOUT_S:g} s after the end"
        )
