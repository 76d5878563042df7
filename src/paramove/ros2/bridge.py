"""A run in ROS 2: publishers and subscriptions of one rclpy node, whose callbacks have a thread of their own."""

from __future__ import annotations

import contextlib
import json
import logging
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, TracebackType
from typing import Any, Self

from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from paramove.bus import BusFolderError, Received, TopicTakenError, topics
from paramove.client import LAST_STATES, NoMessageError, Run
from paramove.documents import InputError
from paramove.msgs.node_status_pb2 import NodeStatus
from paramove.msgs.relocation_pb2 import RelocationGoal, RelocationStatus
from paramove.msgs.safety_state_pb2 import SafetyState
from paramove.operator import stop_arms

NAME = "paramove"
STOP_TIMEOUT_S = 1.0
DIAGNOSTICS_PERIOD_NS = 1_000_000_000
QUEUE_LENGTH = 100
"""Messages that a slow subscriber of joint states may be behind: a second at 100 Hz."""

_log = logging.getLogger(__name__)


class MissingRos2Error(InputError):
    """rclpy, or one of the packages of ROS's messages, cannot be imported."""


class Ros2Bridge:
    """The topics of a run as those of ROS 2, while it is a context.

    | ROS 2 | type | from |
    |---|---|---|
    | `joint_states` | sensor_msgs/JointState | `arm/joint_states/fast` where it is published, else `arm/joint_states` |
    | `camera/image_raw/compressed` … | sensor_msgs/CompressedImage | `camera/image`, `camera_1/image` … |
    | `gestures/scene`, `action/scene` | visualization_msgs/MarkerArray | the same |
    | `/diagnostics` | diagnostic_msgs/DiagnosticArray | gates and nodes, every second and when a gate changes |
    | `/clock` | rosgraph_msgs/Clock | `clock`, where time is simulated |
    | `goal_pose`, to the run | geometry_msgs/PoseStamped | sent as a goal: the hand goes there |
    | `goal_status` | std_msgs/String | the goal's last state, as JSON |
    | `/stop`, to the run | std_msgs/Empty | stops all arms |

    What belongs to a namespace of the run is in that namespace in ROS. Stamps are the time of capture, by the system's
    clock, or simulated time. No message from ROS arms an arm.

    Args:
        folder: Of the run's bus.
        namespaces: Of the run; ("",) for none.
        is_simulated: Whether the run's time is simulated.
        domain_id: Of ROS; None takes ROS_DOMAIN_ID, else 0.
    """

    def __init__(
        self,
        folder: Path,
        namespaces: tuple[str, ...] = ("",),
        is_simulated: bool = False,
        domain_id: int | None = None,
    ) -> None:
        self._folder = folder
        self._is_simulated, self._domain_id = is_simulated, domain_id
        self._publishers: dict[str, Any] = {}
        self._gates: dict[str, SafetyState] = {}
        self._nodes: dict[str, NodeStatus] = {}
        self._has_fast: set[str] = set()
        self._diagnosed_ns = 0
        self._open = contextlib.ExitStack()
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._spin)
        self._runs = {namespace: Run(folder, f"{NAME}_ros2", namespace) for namespace in namespaces}
        self._goals: dict[str, RelocationGoal] = {}  # those that have not ended, by namespace
        self._accepted: set[str] = set()  # their ids, once they need not be repeated

    def __enter__(self) -> Self:
        """Joins ROS. Raises MissingRos2Error."""
        self._messages = _messages()
        import rclpy
        from geometry_msgs.msg import PoseStamped
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.signals import SignalHandlerOptions
        from std_msgs.msg import Empty

        self._context = rclpy.Context()
        # Ctrl-C is the launcher's: a handler of rclpy would shut the context down before this node ends in order.
        rclpy.init(context=self._context, domain_id=self._domain_id, signal_handler_options=SignalHandlerOptions.NO)
        self._node = rclpy.create_node(NAME, context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._node.create_subscription(Empty, "/stop", self._stop, 10)
        for namespace, run in self._runs.items():
            self._open.enter_context(run)
            self._node.create_subscription(
                PoseStamped, _in_ros(namespace, "goal_pose"), self._goal_taken_in(namespace), 10
            )
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ends.set()
        self._thread.join()
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()
        self._open.close()

    def handle(self, received: Received) -> None:
        """Publishes a message of the run to ROS; one of a topic without a counterpart there is left out."""
        namespace, name = topics.split_name(received.topic.name)
        message, stamp = received.message, self._stamp(received.captured_ns)
        if isinstance(message, JointStates):
            if name == topics.ARM_JOINT_STATES_FAST.name:
                self._has_fast.add(namespace)
            elif namespace in self._has_fast:
                return
            self._publish(_in_ros(namespace, "joint_states"), self._messages.joint_state(message, stamp), QUEUE_LENGTH)
        elif isinstance(message, CompressedImage):
            camera = name.partition("/")[0]
            ros_name = _in_ros(namespace, f"{camera}/image_raw/compressed")
            self._publish(ros_name, self._messages.image(message, stamp))
        elif isinstance(message, SceneUpdate):
            self._publish(_in_ros(namespace, name), self._messages.markers(message, stamp))
        elif isinstance(message, RelocationStatus):
            self._follow(namespace, message)
        elif isinstance(message, NodeStatus):
            self._nodes[message.node] = message
        elif isinstance(message, SafetyState):
            before = self._gates.get(received.topic.name)
            self._gates[received.topic.name] = message
            if before is None or before.state != message.state:
                self._diagnosed_ns = 0

    def tick(self, now_ns: int) -> None:
        """Publishes simulated time, goals that nobody has accepted yet, and the diagnostics where they are due."""
        for namespace, goal in list(self._goals.items()):
            if goal.id not in self._accepted:
                self._send(namespace, goal)
        if self._is_simulated:
            self._publish("/clock", self._messages.clock(now_ns))
        if not self._diagnosed_ns or now_ns - self._diagnosed_ns >= DIAGNOSTICS_PERIOD_NS:
            self._diagnosed_ns = now_ns
            gates = list(self._gates.items())
            found = self._messages.diagnostics(gates, self._nodes.values(), self._stamp(now_ns))
            self._publish("/diagnostics", found)

    def _stamp(self, time_ns: int) -> Any:
        """A time of the run as ROS has it: simulated, or by the system's clock."""
        offset_ns = 0 if self._is_simulated else time.time_ns() - time.monotonic_ns()
        return self._messages.time_of(time_ns + offset_ns)

    def _publish(self, name: str, message: Any, depth: int = 10) -> None:
        """On a topic of ROS, reliably, which suits subscribers of both kinds."""
        if name not in self._publishers:
            self._publishers[name] = self._node.create_publisher(type(message), name, depth)
        self._publishers[name].publish(message)

    def _spin(self) -> None:
        while not self._ends.is_set():
            self._executor.spin_once(timeout_sec=0.1)

    def _stop(self, _: Any) -> None:
        """Stops all arms at once; what the gates answer is among the diagnostics."""
        try:
            answers = stop_arms(self._folder, f"program {self._node.get_name()} of ROS 2", STOP_TIMEOUT_S)
        except (TopicTakenError, BusFolderError) as error:
            _log.error("a stop from ROS was not published: %s", error)
            return
        for namespace, answer in answers.items():
            if answer is None:
                _log.error("the gate of %s has not answered a stop from ROS", namespace or "the arm")

    def _goal_taken_in(self, namespace: str) -> Callable[[Any], None]:
        def take(pose: Any) -> None:
            if namespace in self._goals:
                self._publish_status(namespace, "REJECTED", "another goal is under way")
                return
            goal: RelocationGoal = self._messages.goal(pose)
            goal.id = f"{NAME}_ros2 {time.monotonic_ns()}"
            self._goals[namespace] = goal  # the next tick sends it

        return take

    def _send(self, namespace: str, goal: RelocationGoal) -> None:
        try:
            self._runs[namespace].publish(topics.RELOCATION_GOAL, goal, wait_s=0.0)
        except (TopicTakenError, NoMessageError, InputError) as error:
            del self._goals[namespace]
            self._publish_status(namespace, "REJECTED", str(error))

    def _follow(self, namespace: str, status: RelocationStatus) -> None:
        goal = self._goals.get(namespace)
        if goal is None or status.goal_id != goal.id:
            return
        self._accepted.add(goal.id)
        if status.state in LAST_STATES:
            del self._goals[namespace]
            self._accepted.remove(goal.id)
            self._publish_status(
                namespace, RelocationStatus.State.Name(status.state).removeprefix("STATE_"), status.reason
            )

    def _publish_status(self, namespace: str, state: str, reason: str) -> None:
        text = self._messages.text(json.dumps({"state": state, "reason": reason}))
        self._publish(_in_ros(namespace, "goal_status"), text)


def _messages() -> ModuleType:
    """The conversions, which import rclpy's messages."""
    try:
        from paramove.ros2 import conversion
    except ImportError as error:
        remedy = "pip install 'paramove[ros2]' (x86_64, Python 3.11 to 3.13), or source ROS 2 before you start"
        raise MissingRos2Error(f"ROS 2 cannot be imported ({error}): {remedy}") from error
    return conversion


def _in_ros(namespace: str, name: str) -> str:
    return f"/{namespace}/{name}" if namespace else f"/{name}"
