"""Bus messages of a tracked arm: estimate, pose, outline in the image, and a ball where the arm points."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from numpy.typing import ArrayLike
from pydantic import BaseModel, ConfigDict

from paramove.cameras import WORLD_FRAME
from paramove.documents import Floats
from paramove.msgs.action_estimate_pb2 import ActionEstimate, ActionParameter, Location
from paramove.msgs.arm_pose_pb2 import ArmPose
from paramove.observation import (
    BENT_POSE_POINTS,
    GREEN,
    HAND,
    add_circle,
    line_in_image,
    line_in_scene,
    opaque,
    pose_message,
)

if TYPE_CHECKING:
    from paramove.action_space.video_tracker import TrackedState

NAMES_IN_MESSAGES = {"shoulder": "shoulder", "elbow": "elbow", "hand": "index", "wrist": "wrist"}


UNCERTAIN_M = 0.10
"""Deviation of a target from which on its certainty is 0 and its ball is red (figure 6.10)."""

BALL_M = 0.03
"""Diameter of that ball."""


class TablePose(BaseModel):
    """Pose of the table frame, in which cameras and person were measured, in another frame, such as a robot's.

    Attributes:
        frame: Name of the other frame.
        x, y, z: Of the table frame's origin there, m.
        yaw: Angle from its x axis to the table's, about z, rad.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    frame: str = WORLD_FRAME
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    yaw: float = 0.0

    def frame_from_table(self, points: Floats) -> Floats:
        """Points (..., 3), m, of the table frame in this one."""
        return np.asarray(points @ self._rotation.T + np.array([self.x, self.y, self.z]))

    def deviations(self, along_table: Floats) -> Floats:
        """Deviations (3,), m, along the table's axes, along the axes of this frame."""
        return np.asarray(np.sqrt(self._rotation**2 @ along_table**2))

    @property
    def _rotation(self) -> Floats:
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


AT_TABLE = TablePose()


def certainty(deviation: ArrayLike) -> float:
    """0 to 1 of a target with these deviations along x, y, z in m."""
    maximum = float(np.max(np.asarray(deviation, dtype=np.float64)))
    return float(np.clip(1.0 - maximum / UNCERTAIN_M, 0.0, 1.0))


def ball_colour(certain: float) -> tuple[float, float, float]:
    """Red over yellow to green, each 0 to 1."""
    return min(1.0, 2.0 * (1.0 - certain)), min(1.0, 2.0 * certain), 0.1


def messages_of(
    state: TrackedState, parameter_names: Mapping[str, Sequence[str]], particles: int, table: TablePose = AT_TABLE
) -> tuple[ActionEstimate, ArmPose, ImageAnnotations, SceneUpdate]:
    """All that is published of a state."""
    estimate = estimate_message(state, parameter_names, particles, table)
    return estimate, arm_pose_message(state), outline_message(state), scene_message(state, table)


def estimate_message(
    state: TrackedState,
    parameter_names: Mapping[str, Sequence[str]],
    particles: int,
    table: TablePose = AT_TABLE,
) -> ActionEstimate:
    """The whole estimate, with positions in the frame of `table`. `parameter_names` of each action."""
    estimate = state.estimate
    message = ActionEstimate(
        frame=table.frame,
        progress=estimate.tau_histogram.sum(axis=0),
        effective_sample_size=estimate.effective_sample_size,
        particles=particles,
        views=state.n_views,
        lost=estimate.lost,
        degraded=estimate.degraded,
        detail=estimate.detail,
        hand=_location(estimate.pose[HAND], np.sqrt(np.diagonal(estimate.covariance)[HAND]), table),
        pointed=_location(state.pointed, state.pointed_deviation, table),
    )
    message.captured.FromNanoseconds(state.captured_ns)
    for name, probability in estimate.actions.items():
        action = message.actions.add(action=name, probability=probability)
        if name in estimate.theta:
            theta = estimate.theta[name]
            action.parameters.extend(
                ActionParameter(name=one, mean=mean, deviation=deviation, covariance=row)
                for one, mean, deviation, row in zip(
                    parameter_names[name], theta.mean, theta.deviations, theta.covariance, strict=True
                )
            )
    if estimate.target is not None:
        target = estimate.target
        message.target.number, message.target.action = target.number, target.action
        message.target.arrived.FromNanoseconds(state.captured_ns - round((estimate.time_s - target.time_s) * 1e9))
        message.target.location.CopyFrom(_location(target.place, state.target_deviation, table))
    return message


def arm_pose_message(state: TrackedState) -> ArmPose:
    """The estimated arm; its hand is the tip of the index finger. With the wrist if its action models it."""
    points = state.estimate.pose.reshape(-1, 3)
    names = (NAMES_IN_MESSAGES[name] for name in BENT_POSE_POINTS[: len(points)])
    return pose_message(state.captured_ns, dict(zip(names, points, strict=True)))


def outline_message(state: TrackedState) -> ImageAnnotations:
    """The outline of the estimated arm and the ball where it points, in the first camera's image."""
    colour = (1.0, 0.3, 0.2) if state.estimate.lost else GREEN
    message = line_in_image(state.captured_ns, state.outline, colour, closed=True)
    if np.isfinite(state.ball).all():
        add_circle(message, state.ball, 9.0, ball_colour(certainty(state.pointed_deviation)))
    return message


def scene_message(state: TrackedState, table: TablePose = AT_TABLE) -> SceneUpdate:
    """The estimated arm as lines and the ball where it points, in the frame of `table`."""
    arm = table.frame_from_table(state.estimate.pose[:9].reshape(3, 3))
    message = line_in_scene(state.captured_ns, "target", arm, table.frame)
    add_ball(message.entities[0], table.frame_from_table(state.pointed), certainty(state.pointed_deviation))
    return message


def add_ball(entity: SceneEntity, position: Floats, certain: float) -> None:
    """Adds the ball where an arm points, (3,), m: green where that is certain, red where it is not."""
    ball = entity.spheres.add(color=opaque(ball_colour(certain)))
    ball.pose.position.x, ball.pose.position.y, ball.pose.position.z = position
    ball.pose.orientation.w = 1.0
    ball.size.x = ball.size.y = ball.size.z = BALL_M


def _location(position: Floats, deviation: Floats, table: TablePose) -> Location:
    x, y, z = table.frame_from_table(position)
    along_x, along_y, along_z = table.deviations(deviation)
    return Location(x=x, y=y, z=z, x_deviation=along_x, y_deviation=along_y, z_deviation=along_z)
