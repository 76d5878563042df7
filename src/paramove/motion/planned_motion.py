"""A motion as it is planned: sizes of the relocation action, the path under construction, the finished motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paramove.documents import Floats
from paramove.motion.reaching_movement import ArmPoses
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory, TrajectoryPhase, TrajectoryPoint


@dataclass(frozen=True)
class RelocationOptions:
    """Sizes of the relocation action, m, s, m/s. Where the thesis gives a number it is named."""

    before: float = 0.03  # 3 cm before the object
    aside: float = 0.008  # thesis 1 cm to the right
    grasp_aside: float = 0.004  # thesis 1 cm; the gripper site already lies next to the forearm's axis
    release_aside: float = 0.006  # 0.6 cm
    lift: float = 0.048  # thesis 1.5 cm; this much clears standing objects
    entry_height: float = 0.048  # the synthesised approach ends and the retreat begins so far above the table target
    release_height: float = 0.001
    approach_duration: float = 3.0  # about 3 s
    retreat_duration: float = 2.6
    speed: float = 0.10
    careful_speed: float = 0.05
    finger_duration: float = 0.5
    settle_duration: float = 0.3
    work_opening: float = 0.75  # ξ while approaching and leaving an object
    offer_opening: float = 0.95  # ξ while waiting for an object from somebody's hand
    closed_opening: float = 0.02  # ξ of the hand that closes on an object, which stops it earlier
    work_slope: float = 0.25  # rad; the forearm's slope while it interacts, the same everywhere: objects stay upright
    level_states: int = 12  # over so many states the hand is levelled before, and let free after, the interaction
    limit_fraction: float = 0.85  # of the arm's operating velocity and acceleration, used at most
    reach_margin: float = 0.002  # the synthesised path keeps this much outside the smallest reach of the arm
    reach_width: float = 0.012  # and begins to be moved outward from twice so much on
    turn_smoothing: float = 0.15  # s, over which a turn of the elbow rises and falls
    blend_share: float = 0.45  # part of the approach over which the robot's own base pose fades into the movement
    raise_duration: float = 1.6  # from the base pose to where a movement begins that begins above the table
    sample_period: float = 0.005


@dataclass
class Path:
    """A path under construction: samples of pose, opening and level, and where phases begin."""

    period: float
    poses: list[ArmPoses] = field(default_factory=list)
    opening: list[Floats] = field(default_factory=list)
    level: list[Floats] = field(default_factory=list)
    holding: list[NDArray[np.bool_]] = field(default_factory=list)
    phases: list[tuple[str, float]] = field(default_factory=list)

    def add(
        self, name: str, poses: ArmPoses, opening: ArrayLike, level: ArrayLike = 1.0, holding: bool = False
    ) -> None:
        n = len(poses)
        start = self.period * sum(len(p) for p in self.poses)
        if not self.phases or self.phases[-1][0] != name:
            self.phases.append((name, start))
        self.poses.append(poses)
        self.opening.append(np.broadcast_to(np.asarray(opening, dtype=np.float64), n))
        self.level.append(np.broadcast_to(np.asarray(level, dtype=np.float64), n))
        self.holding.append(np.full(n, holding))

    @property
    def end(self) -> ArmPoses:
        return self.poses[-1][-1:]


@dataclass(frozen=True)
class Held:
    """An object in the gripper.

    Attributes:
        pitch: Of the hand when it grasped it, rad.
        width: Of the object, m.
        z: Where it was grasped, frame of the arm's base, m.
        lowered: How far below the goal that was, m.
    """

    pitch: float
    width: float
    z: float
    lowered: float


@dataclass(frozen=True)
class RestPose:
    """Where an arm rests between motions.

    Attributes:
        angles: Arm joints and gripper, [J + 1], rad.
        gripper: Position of the end effector, [3], m, frame of the arm's base.
        measured: Whether the angles were measured; otherwise they are the end of a planned motion.
        held: How it holds an object; None: not known, or nothing.
    """

    angles: Floats
    gripper: Floats
    measured: bool = False
    held: Held | None = None


@dataclass(frozen=True)
class PlannedMotion:
    """A motion from rest to rest, ready for the driver.

    Attributes:
        times: [K], s, from 0.
        angles: Arm joints and gripper, [K, J + 1], rad.
        gripper: Where the end effector shall be, [K, 3], m, frame of the arm's base.
        holding: Whether an object is held, [K].
        phases: Name and start of each phase.
        elbow_turn: Largest turn of the elbow for a joint limit, rad.
        held: See `RestPose`.
    """

    times: Floats
    angles: Floats
    gripper: Floats
    holding: NDArray[np.bool_]
    phases: tuple[tuple[str, float], ...]
    elbow_turn: float
    held: Held | None = None

    @property
    def end(self) -> RestPose:
        """Where it ends."""
        return RestPose(self.angles[-1], self.gripper[-1], held=self.held)


def motion_message(name: str, joints: Sequence[str], motion: PlannedMotion, now_ns: int) -> JointTrajectory:
    """The trajectory called `name` of these joints, in the order of the motion's angles."""
    message = JointTrajectory(id=name, joints=joints)
    message.captured.FromNanoseconds(now_ns)
    message.points.extend(
        TrajectoryPoint(time_s=t, position_rad=q) for t, q in zip(motion.times, motion.angles, strict=True)
    )
    message.phases.extend(TrajectoryPhase(name=name, start_s=start) for name, start in motion.phases)
    return message
