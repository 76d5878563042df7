"""One trajectory while the robot plays it: which rows come next, whether the stream has failed, when it is done."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from paramove.documents import Floats
from paramove.robots import RobotDescription
from paramove.robots.streaming.robot_report import RobotReport
from paramove.robots.streaming.stream import Playing
from paramove.safety import Fault

START_TIMEOUT_S = 0.5
SETTLE_TIMEOUT_S = 1.0
GEARED_TOLERANCE = float(np.deg2rad(1.0))
SERVO_TOLERANCE = float(np.deg2rad(3.0))  # two units of the wrist
STILL = float(np.deg2rad(8.0))  # rad/s; a servo's unit in one camera period is 15 deg/s or more


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
        if report.epoch != epoch:
            return 0.0
        return float(np.clip(report.next_index - self.start_index, 0, len(self.rows) - 1)) * self.dt_s

    def fault(self, report: RobotReport, epoch: int, now_ns: int) -> Fault | None:
        """What is wrong with the stream: it never began, ran out or was lost; None if it is all right."""
        begun = report.epoch == epoch and report.next_index > self.start_index
        if not begun:
            if now_ns - self.begun_ns < START_TIMEOUT_S * 1e9:
                return None
            why = f"; the robot reports: {report.rejection}" if report.rejection else ""
            return Fault("stream_not_begun", "", f"nothing was played within {START_TIMEOUT_S:g} s{why}")
        ran_out = report.at_rest or report.playing == Playing.STOP_RAMP
        if not ran_out or report.next_index >= self.end_index:
            return None
        progress = f"{report.next_index - self.start_index} of {len(self.rows) - 1} rows"
        why = f"; the robot reports: {report.rejection}" if report.rejection else ""
        return Fault("stream_under_run", "", f"the robot ran out of rows after {progress} and stops{why}; arm again")

    def ending(self, report: RobotReport, epoch: int, now_ns: int, description: RobotDescription) -> str | None:
        """None while it lasts, "" once the robot has played all rows and arrived, else why it failed."""
        if report.epoch != epoch or report.next_index < self.end_index or not report.at_rest:
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
