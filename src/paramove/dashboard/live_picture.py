"""Content of the page: handles messages of a running application and gives the changed sections."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.PointsAnnotation_pb2 import PointsAnnotation
from pydantic import BaseModel, ConfigDict

from paramove.bus import Bus, Received, nodes_in, topics
from paramove.dashboard.arms import Arms, gate_section
from paramove.dashboard.estimates import Estimates
from paramove.dashboard.robot_shape import RobotShape, rounded
from paramove.msgs.node_status_pb2 import NodeStatus
from paramove.robots import AROUND_SERVO_ARM, RobotDescription, SurfaceParameters, WorkingSurface

SIDE = "right"
"""Of a humanoid's arm that works."""


def subscribe_to_nodes(bus: Bus) -> None:
    """Subscribes to the status of every node that has published one in the bus's folder."""
    for node in nodes_in(bus.settings.folder):
        bus.subscribe(topics.status(node))


@dataclass
class _Node:
    status: NodeStatus
    received_s: float
    restarts: int = 0
    processing_ms: float | None = None  # mean of the messages between its last two statuses


class NodeTable:
    """Latest status of each node. Times are of the monotonic wall clock, s."""

    def __init__(self) -> None:
        self._nodes: dict[str, _Node] = {}

    def handle(self, status: NodeStatus, now_s: float) -> None:
        """Handles a node's status; a new process id means that it was restarted."""
        before = self._nodes.get(status.node)
        node = _Node(status, now_s)
        if before is not None:
            node.restarts = before.restarts + (status.pid != before.status.pid)
            node.processing_ms = before.processing_ms
            handled = status.processed - before.status.processed
            if status.pid == before.status.pid and handled > 0:
                node.processing_ms = 1e3 * (status.processing_seconds - before.status.processing_seconds) / handled
        self._nodes[status.node] = node

    def section(self, now_s: float) -> list[dict[str, Any]]:
        """One row for each node that has ever published its status, by name."""
        return [
            {
                "name": name,
                "state": NodeStatus.State.Name(node.status.state).removeprefix("STATE_").lower(),
                "sentence": node.status.detail,
                "ms": None if node.processing_ms is None else round(node.processing_ms, 1),
                "lost": sum(count.lost for count in node.status.received),
                "restarts": node.restarts,
                "silent_s": round(now_s - node.received_s),
            }
            for name, node in sorted(self._nodes.items())
        ]


class Texts(BaseModel):
    """Words of the application.

    Attributes:
        stages: Names of the application's stages, in their order.
        belongs: Head of the column with the positions that the rules give.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    stages: tuple[str, ...] = ()
    belongs: str = "belongs at"


class LivePicture:
    """Sections of the page by name, as JSON values.

    Args:
        robot: Its shape, joints and base pose; None for a run without one.
        title: Of the page.
        surface: The working surface and the objects on it, where they are not the robot's.
        texts: Words of the application.
        begun_ns: When the run began, by the bus clock.
        has_arms: Whether arms are in namespaces.
        wall_s: Monotonic wall clock, for the age of the nodes' statuses.
    """

    def __init__(
        self,
        robot: RobotDescription | None,
        title: str,
        surface: SurfaceParameters,
        texts: Texts | None = None,
        *,
        begun_ns: int = 0,
        has_arms: bool = False,
        wall_s: Callable[[], float] = time.monotonic,
    ) -> None:
        drawn = None if robot is None else surface.of(robot, SIDE)
        self._robot = None if robot is None or drawn is None else _DrawnRobot(robot, drawn)
        around = drawn or AROUND_SERVO_ARM
        self._estimates = Estimates((around.x, around.y))
        self._nodes = NodeTable()
        self._wall_s = wall_s
        self._begun_ns = begun_ns
        self._given: dict[str, Any] = {}
        self._safety: dict[str, Any] = {}
        self._arms = Arms()
        self._arm: dict[str, Any] = {}
        self._image: bytes | None = None
        texts = texts or Texts()
        origin = "the right shoulder" if robot is None or robot.chain is None else "the arm's base"
        has_robot = robot is not None or has_arms
        self._page = {"title": title, "robot": has_robot, "origin": origin, **texts.model_dump()}
        estimates = self._estimates
        self._handlers: dict[str, Callable[[Any, float], None]] = {
            topics.APPLICATION_STAGE.name: estimates.on_stage,
            topics.SPEECH.name: estimates.on_speech,
            topics.RULES.name: estimates.on_rules,
            topics.CALIBRATION_PLANE.name: estimates.on_plane,
            topics.OBJECTS_TRACKED.name: estimates.on_tracked,
            topics.GESTURES.name: estimates.on_gesture,
            topics.ACTION_ESTIMATE.name: estimates.on_action,
            topics.RELOCATION_GOAL.name: estimates.on_goal,
            topics.RELOCATION_STATUS.name: estimates.on_goal_status,
        }

    def handle(self, received: Received) -> None:
        """Handles one message of any topic that the page uses."""
        namespace, name = topics.split_name(received.topic.name)
        if namespace:
            self._arms.handle(namespace, name, received)
        elif received.topic.name in self._handlers:
            self._handlers[received.topic.name](received.message, received.captured_ns * 1e-9)
        elif received.topic.name == topics.CAMERA_IMAGE.name:
            self._image = bytes(received.message.data)
        elif received.topic.name == topics.ACTION_OUTLINE.name:
            self._arm = _drawn_arm(received.message)
        elif received.topic.name == topics.ARM_JOINT_STATES.name and self._robot is not None:
            self._robot.joints = received.message
        elif received.topic.name == topics.ARM_SAFETY.name:
            self._safety = gate_section(received.message)
        elif received.topic.type is NodeStatus:
            self._nodes.handle(received.message, self._wall_s())

    def changes(self, now_ns: int, stop: dict[str, Any]) -> dict[str, Any]:
        """Sections that have changed since the last call.

        Args:
            now_ns: Time of the bus clock.
            stop: Progress of a person's stop.
        """
        sections = {
            "page": self._page,
            "clock": round(max(now_ns - self._begun_ns, 0) * 1e-9, 1),
            **self._estimates.sections(now_ns * 1e-9),
            **({} if self._robot is None else self._robot.sections()),
            "arm": self._arm,
            "safety": self._safety or self._arms.gate(),
            "arms": self._arms.section(now_ns * 1e-9),
            "stop": stop,
            "nodes": self._nodes.section(self._wall_s()),
        }
        sections = {name: _finite(content) for name, content in sections.items()}
        changed = {name: content for name, content in sections.items() if self._given.get(name) != content}
        self._given = sections
        return changed

    def image(self) -> bytes | None:
        """The latest image if there is one that was not given yet, JPEG."""
        image, self._image = self._image, None
        return image


class _DrawnRobot:
    """The robot and its surface, as the page draws them; `joints` is the latest message of its joints."""

    def __init__(self, robot: RobotDescription, surface: WorkingSurface) -> None:
        origin, self._gripper = _sites_of(robot)
        self._shape = RobotShape(robot.model_path, dict(zip(robot.joint_names, robot.base_pose, strict=True)))
        self.joints: Any = None
        self._world = {
            "parts": self._shape.parts(),
            "shoulder": rounded(self._shape.site(origin)),
            "surface": {"x": surface.x, "y": surface.y, "z": surface.z},
            "object": {"radius": surface.object_radius, "height": surface.object_height},
        }

    def sections(self) -> dict[str, Any]:
        """What stands still, and what moves."""
        if self.joints is not None:
            self._shape.move({joint.name: joint.position for joint in self.joints.joints})
            self.joints = None
        moving = {"poses": self._shape.poses(), "gripper": rounded(self._shape.site(self._gripper))}
        return {"world": self._world, "robot": moving}


def _sites_of(robot: RobotDescription) -> tuple[str, str]:
    """Sites of the origin of positions, the right shoulder or a servo arm's base, and of the gripper."""
    if robot.chain is not None:
        return robot.chain.sites.base, robot.chain.sites.end_effector
    sites = robot.arm(SIDE).sites
    return sites.shoulder, sites.gripper


def _drawn_arm(message: ImageAnnotations) -> dict[str, Any]:
    """Lines and balls in the image, px, each with its colour as the page's style sheet writes it."""
    return {
        "lines": [
            {
                "points": [[round(point.x, 1), round(point.y, 1)] for point in line.points],
                "closed": line.type == PointsAnnotation.LINE_LOOP,
                "colour": _css(line.outline_color),
            }
            for line in message.points
        ],
        "balls": [
            {
                "place": [round(ball.position.x, 1), round(ball.position.y, 1)],
                "diameter": ball.diameter,
                "colour": _css(ball.fill_color),
            }
            for ball in message.circles
        ],
    }


def _css(colour: Color) -> str:
    parts = (colour.r, colour.g, colour.b)
    return (
        "rgb(" + " ".join(str(round(255 * min(max(part, 0.0), 1.0))) if part == part else "0" for part in parts) + ")"
    )


def _finite(content: Any) -> Any:
    """The same with None for numbers that JSON does not have."""
    if isinstance(content, float):
        return content if math.isfinite(content) else None
    if isinstance(content, dict):
        return {key: _finite(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_finite(value) for value in content]
    return content
