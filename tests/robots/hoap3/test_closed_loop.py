"""Driver, stream, emulated firmware and physics together: an arm that arrives, and one that loses its driver."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from paramove.msgs.joint_trajectory_pb2 import TrajectoryStatus
from paramove.robots.hoap3.firmware import Firmware
from paramove.robots.streaming.driver import DriverOutput
from paramove.robots.streaming.stream import StreamBatch, StreamState
from tests.robots.hoap3.movements import HOAP3
from tests.robots.hoap3.test_firmware import MODEL, QPOS, QVEL
from tests.robots.streaming.fake_robot import FakeRobot, Rig

GOAL = {"right_shoulder_pitch": 30.0, "right_shoulder_roll": -30.0, "right_elbow": -60.0, "right_fingers": 20.0}


class PhysicalRobot(FakeRobot):
    """As the simulator is to do it: play a frame, compute torques, step 1 ms."""

    def __init__(self) -> None:
        super().__init__()
        self.data = mujoco.MjData(MODEL)
        self.data.qpos[QPOS] = HOAP3.base_pose
        self.firmware = Firmware(HOAP3)
        self.firmware.reset(HOAP3.base_pose)
        self.fastest = np.zeros(28)

    def play(self, milliseconds: int = 67) -> None:
        for _ in range(milliseconds):
            frame = self.reader.play()
            self.played.append(frame)
            self.data.ctrl[:] = self.firmware.step(frame, self.data.qpos[QPOS], self.data.qvel[QVEL])
            mujoco.mj_step(MODEL, self.data)
            self.fastest = np.maximum(self.fastest, np.abs(self.data.qvel[QVEL]))

    def state(self, now_ns: int) -> StreamState:
        units = HOAP3.units
        measured = np.rint(units.zero_counts + units.counts_per_rad * self.data.qpos[QPOS]).astype(np.int16)
        return self.reader.state(measured, now_ns)


def moving_rig() -> tuple[Rig, PhysicalRobot]:
    rig, robot = Rig(), PhysicalRobot()
    rig.robot = robot
    rig.tick()
    rig.arm()
    rig.send("reach", GOAL, duration_s=1.2)
    return rig, robot


def test_the_arm_arrives_within_a_third_of_a_degree() -> None:
    rig, robot = moving_rig()
    rig.run_until_rest()
    assert rig.statuses[-1].state == TrajectoryStatus.STATE_SUCCEEDED, rig.statuses[-1].reason
    arm = HOAP3.indices([joint for joint in GOAL if joint != "right_fingers"])
    goal = np.deg2rad([degrees for joint, degrees in GOAL.items() if joint != "right_fingers"])
    np.testing.assert_allclose(robot.data.qpos[QPOS[arm]], goal, rtol=0, atol=np.deg2rad(0.3))
    assert (robot.fastest < HOAP3.velocity).all()


def test_without_a_driver_the_arm_comes_to_rest_by_itself() -> None:
    rig, robot = moving_rig()
    for tick in range(24):
        rig.tick(driver_runs=tick < 7)
    assert robot.reader.at_rest
    geared = QVEL[HOAP3.velocity_loop]
    assert np.abs(robot.data.qvel[geared]).max() < np.deg2rad(0.5)
    off = robot.data.qpos[QPOS] - HOAP3.units.to_radians(robot.reader.target)
    assert np.abs(off[HOAP3.velocity_loop]).max() < np.deg2rad(0.3)


class SlowRig(Rig):
    """Its driver's batches reach the robot after it has played on, and so many ticks late besides."""

    def __init__(self, ticks_late: int) -> None:
        super().__init__()
        self.ticks_late = ticks_late
        self._on_the_way: list[StreamBatch | None] = []

    def tick(self, *, lose: bool = False, driver_runs: bool = True) -> DriverOutput | None:
        output = super().tick(lose=True, driver_runs=driver_runs)
        self._on_the_way.append(output.stream if output is not None and driver_runs and not lose else None)
        if len(self._on_the_way) > self.ticks_late:
            batch = self._on_the_way.pop(0)
            if batch is not None:
                self.robot.reader.offer(batch)
        return output


@pytest.mark.parametrize(("late", "arrives"), [(0, True), (1, True), (5, False)])
def test_batches_that_come_late_make_the_guard_longer(late: int, arrives: bool) -> None:
    rig = SlowRig(late)
    rig.tick()
    rig.arm()
    rig.send("reach", GOAL, duration_s=1.2)
    rig.run_until_rest()
    assert (rig.statuses[-1].state == TrajectoryStatus.STATE_SUCCEEDED) == arrives, rig.statuses[-1].reason
    assert rig.robot.reader.rejected_batches <= 1 or late > 0
