"""HOAP-3's side of the wire without physics: joints are where they are commanded, unless a test holds one."""

from __future__ import annotations

import numpy as np

from paramove.msgs.joint_trajectory_pb2 import JointTrajectory, TrajectoryPoint, TrajectoryStatus
from paramove.msgs.safety_state_pb2 import ArmRequest
from paramove.robots.streaming.driver import ArmDriver, DriverOutput
from paramove.robots.streaming.stream import StreamBatch, StreamReader, StreamState
from paramove.safety.gate_io import State
from tests.robots.hoap3.movements import HOAP3

TICK_NS = 66_666_667


class FakeRobot:
    """Plays 67 frames a tick and keeps all that it played."""

    def __init__(self) -> None:
        self.reader = StreamReader(HOAP3, HOAP3.units.to_counts(HOAP3.base_pose))
        self.played: list[np.ndarray] = []
        self.held_joints: dict[int, int] = {}

    def play(self, milliseconds: int = 67) -> None:
        self.played += [self.reader.play() for _ in range(milliseconds)]

    def state(self, now_ns: int) -> StreamState:
        counts = self.reader.target.copy()
        for joint, count in self.held_joints.items():
            counts[joint] = count
        return self.reader.state(counts, now_ns)


class Rig:
    """A driver and a robot in lockstep: state, tick, batch, 67 ms, …"""

    def __init__(self, no_program: str = "it is real") -> None:
        self.robot = FakeRobot()
        self.driver = ArmDriver(HOAP3, no_program=lambda: no_program)
        self.now_ns = 1_000_000_000
        self.statuses: list[TrajectoryStatus] = []
        self.output: DriverOutput | None = None

    def tick(self, *, lose: bool = False, driver_runs: bool = True) -> DriverOutput | None:
        self.now_ns += TICK_NS
        batch: StreamBatch | None = None
        if driver_runs:
            self.driver.on_robot_state(self.robot.state(self.now_ns), self.now_ns)
            self.output = self.driver.tick(self.now_ns)
            self.statuses += self.output.statuses
            batch = self.output.stream
        if batch is not None and not lose:
            self.robot.reader.offer(batch)
        self.robot.play()
        return self.output

    def arm(self, armed: bool = True, by_person: bool = True) -> None:
        request = ArmRequest(source="test", armed=armed, by_person=by_person)
        self.driver.on_arm_request(request, self.now_ns + 1)
        self.tick()

    def send(self, name: str, goal_deg: dict[str, float], duration_s: float = 1.0, start_deg: float = 0.0) -> None:
        self.driver.on_trajectory(trajectory(name, goal_deg, duration_s, start_deg), self.now_ns)

    def run_until_rest(self, limit: int = 200) -> None:
        for _ in range(limit):
            self.tick()
            if self.statuses and self.statuses[-1].state in (
                TrajectoryStatus.STATE_SUCCEEDED,
                TrajectoryStatus.STATE_STOPPED,
            ):
                return
        raise AssertionError("the trajectory did not end")


def armed() -> Rig:
    rig = Rig()
    rig.tick()
    rig.arm()
    assert rig.driver.state is State.ARMED
    return rig


def trajectory(name: str, goal_deg: dict[str, float], duration_s: float, start_deg: float = 0.0) -> JointTrajectory:
    """From the base pose to the goal, dense points 10 ms apart; `start_deg` shifts all points but the goal."""
    joints = list(goal_deg)
    start = HOAP3.base_pose[HOAP3.indices(joints)] + np.deg2rad(start_deg)
    goal = np.deg2rad([goal_deg[joint] for joint in joints])
    message = JointTrajectory(id=name, joints=joints)
    times = np.linspace(0.0, duration_s, round(duration_s * 100) + 1)
    for time in times:
        u = time / duration_s
        point = start + (10 * u**3 - 15 * u**4 + 6 * u**5) * (goal - start)
        message.points.append(TrajectoryPoint(time_s=time, position_rad=point))
    return message
