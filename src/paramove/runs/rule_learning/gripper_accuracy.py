"""Accuracy of the gripper when it grasps and when it places (thesis 5.2.7: within 2 mm of the target).

Commanded: the target against forward kinematics of the commanded integer joint units. Physical: the gripper in the
world against the commanded one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from paramove.bus import topics
from paramove.documents import Floats
from paramove.motion import RelocationOptions
from paramove.robots import RobotDescription
from paramove.runs.recorded_run import RecordedRun
from paramove.runs.relocations import Motion, Relocation


@dataclass(frozen=True, eq=False)
class GripperSample:
    """The gripper at rest, closing or opening the hand.

    Attributes:
        goal_id, object, stage: Of the goal.
        kind: "grasp" or "place".
        time_s: In the run's time.
        target, commanded, gripper: Where the gripper should be, was sent to, and was, each [3], m, shoulder frame.
    """

    goal_id: str
    object: str
    stage: str
    kind: str
    time_s: float
    target: Floats
    commanded: Floats
    gripper: Floats

    @property
    def commanded_error_mm(self) -> float:
        """Distance of the commanded gripper from its target."""
        return 1e3 * float(np.linalg.norm(self.commanded - self.target))

    @property
    def physical_error_mm(self) -> float:
        """Distance of the gripper from the commanded one."""
        return 1e3 * float(np.linalg.norm(self.gripper - self.commanded))


class CommandedGripper:
    """The gripper of the commanded joint units over the run.

    Args:
        run: With `wire/hoap3/state`.
        robot: Whose units and kinematics.
    """

    def __init__(self, run: RecordedRun, robot: RobotDescription, side: str = "right") -> None:
        arm = robot.arm(side)
        states = [r for r in run.received(topics.WIRE_HOAP3_STATE) if len(r.message.target_counts) == robot.n_joints]
        self.time_s = np.array([run.captured_s(r.message) for r in states])
        counts = np.array([list(r.message.target_counts) for r in states]).reshape(-1, robot.n_joints)
        self.angles = robot.units.to_radians(counts)[:, arm.indices]
        points = arm.kinematics.forward(self.angles)
        self.gripper, self.elbow = points.gripper, points.elbow

    def at(self, time_s: float) -> tuple[Floats, Floats]:
        """Gripper and elbow [3] nearest to a time."""
        index = int(np.abs(self.time_s - time_s).argmin())
        return self.gripper[index], self.elbow[index]


def gripper_samples(
    run: RecordedRun, relocations: list[Relocation], motions: list[Motion], commanded: CommandedGripper
) -> list[GripperSample]:
    """Every grasp and every placing that the arm reached."""
    by_id = {relocation.goal.id: relocation for relocation in relocations}
    samples = []
    for motion in motions:
        relocation = by_id.get(motion.goal_id)
        if relocation is None or not commanded.time_s.size:
            continue
        phases = {"grasp": "grasp"} | ({"release": "place"} if "place" in motion.phases else {})
        for phase, kind in phases.items():
            middle = motion.middle_of(phase)
            if middle is None:
                continue
            time_s = motion.begun_s + middle
            gripper, elbow = commanded.at(time_s)
            target = place_target(relocation) if kind == "place" else grasp_target(relocation.source, gripper, elbow)
            gripper_in_world = run.truth.gripper[run.truth.at(time_s)]
            goal = relocation.goal
            samples.append(
                GripperSample(goal.id, goal.object, relocation.stage, kind, time_s, target, gripper, gripper_in_world)
            )
    return samples


def grasp_target(source: Floats, gripper: Floats, elbow: Floats) -> Floats:
    """Where the gripper closes: next to the object's position, to the right of the forearm (thesis 5.2.5)."""
    forward = (gripper - elbow) * [1.0, 1.0, 0.0]
    forward /= np.linalg.norm(forward)
    right = np.array([forward[1], -forward[0], 0.0])
    return np.asarray(source + RelocationOptions().grasp_aside * right)


def place_target(relocation: Relocation) -> Floats:
    """Where the gripper opens: a little above the target."""
    return np.asarray(relocation.target + np.array([0.0, 0.0, RelocationOptions().release_height]))
