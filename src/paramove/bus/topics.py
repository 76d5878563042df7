"""The one table of topics: name, message type, rate, profile, frame, whether recorded.

A node names its topics from here (`topics.CAMERA_IMAGE`); nothing else spells a topic name. A workspace adds its own by
a file (see `topic_table`), which are named in the same way: `lamp/state` is `topics.LAMP_STATE`.
"""

from __future__ import annotations

import enum
import re
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from paramove.documents import InputError, nearest
from paramove.msgs.action_estimate_pb2 import ActionEstimate
from paramove.msgs.arm_pose_pb2 import ArmPose
from paramove.msgs.body_key_points_pb2 import BodyKeyPoints
from paramove.msgs.clock_pb2 import Clock
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.hoap3_wire_pb2 import Hoap3State, StreamBatch
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory, TrajectoryStatus
from paramove.msgs.motor_status_pb2 import MotorStatus
from paramove.msgs.node_status_pb2 import NodeStatus
from paramove.msgs.parameters_pb2 import ParameterRequest
from paramove.msgs.plane_calibration_pb2 import PlaneCalibration
from paramove.msgs.relocation_pb2 import RelocationGoal, RelocationStatus
from paramove.msgs.rule_pb2 import ApplicationStage, Rules, Speech
from paramove.msgs.safety_state_pb2 import ArmRequest, LinkState, SafetyState, StopRequest
from paramove.msgs.tracked_objects_pb2 import TrackedObjects
from paramove.msgs.truth_pb2 import TruthArm, TruthLayout, TruthState
from paramove.workspace import Workspace

_OF_PERSONS = frozenset(kind.DESCRIPTOR.full_name for kind in (ArmRequest, StopRequest))
_OF_NODES = frozenset(kind.DESCRIPTOR.full_name for kind in (Clock, LinkState, NodeStatus))
RESERVED_TYPES = _OF_PERSONS | _OF_NODES
"""Types of messages on which it depends who may arm and stop, and what time it is: for topics of the library alone."""
_STATUS_PREFIX = "status/"
_TRUTH_PREFIX = "truth/"


class Profile(enum.Enum):
    """How a topic treats a message that a later one follows."""

    LATEST = "latest"  # only the latest message is of use; the reader drops older ones
    QUEUE = "queue"  # every message counts
    LATCHED = "latched"  # every message counts and a late joiner gets the latest one


@dataclass(frozen=True)
class Topic:
    """One row of the table.

    Attributes:
        name: Parts of lower-case letters, digits and `_`, joined by `/`.
        type: Protobuf class of the message.
        rate_hz: Nominal rate; None where messages come with events.
        profile: See `Profile`.
        frame: Coordinate frame of spatial content; "" where there is none or the message has it.
        recorded: Whether the recorder stores it.
        max_bytes: Largest payload; a larger one is rejected by the publisher and by every subscriber.
        limit_hz: At most so many a second are of use where messages come with events: a subscriber drops the excess
            undecoded, and cuts off a publisher that goes on (see `paramove.bus.budget`). None: no limit.
        max_points: Most points of a trajectory: a subscriber counts them before it decodes them, which would take it
            many times as long. None: no limit.
    """

    name: str
    type: type[Any]
    rate_hz: float | None
    profile: Profile
    frame: str = ""
    recorded: bool = False
    max_bytes: int = 2**16
    limit_hz: float | None = None
    max_points: int | None = None

    @cached_property
    def type_name(self) -> str:
        """Full protobuf name of the message type."""
        return str(self.type.DESCRIPTOR.full_name)

    @property
    def truth(self) -> bool:
        """Whether only the simulator and evaluators may know the topic's folder."""
        return self.name.startswith(_TRUTH_PREFIX)

    @property
    def reserved_for(self) -> str:
        """Who alone publishes such a topic, for a message; "" where a program outside of a run may, too.

        By the names of topic and type: a recording, and a workspace, may have classes of their own.
        """
        if self.type_name in _OF_PERSONS:
            return "persons: paramove arm enable, paramove arm estop"
        if self.truth or self.name.startswith(_STATUS_PREFIX) or self.type_name in _OF_NODES:
            return "nodes of the run"
        return ""

    @cached_property
    def is_request(self) -> bool:
        """Whether it carries requests to stop or to arm, which count whatever time their sender has written into them.

        Their subscribers read no number of them. How old a request to arm is, the envelope has.
        """
        return self.type in (StopRequest, ArmRequest)

    @cached_property
    def has_checked_numbers(self) -> bool:
        """Whether a message with unsound numbers is rejected by its subscribers.

        The thousands of numbers of a trajectory are checked by an arm's driver, in slices between which a stop acts.
        """
        return not self.is_request and self.type is not JointTrajectory

    @property
    def is_image(self) -> bool:
        """Whether a message carries pixels, so that its queue is short and its size limit high."""
        return self.type in (RawImage, CompressedImage)

    @property
    def by_ring(self) -> bool:
        """Whether large messages go by shared memory, in which a reader that is slow by a second loses some."""
        return self.is_image and self.profile is Profile.LATEST and not self.recorded

    @property
    def budget_hz(self) -> float | None:
        """Nominal rate by the messages' own publish times, which a subscriber enforces; None where there is none.

        The clock makes that time, and a status follows the wall clock also in simulated time.
        """
        return None if self.type in (Clock, NodeStatus) else self.rate_hz or self.limit_hz

    @property
    def is_urgent(self) -> bool:
        """Whether its messages overtake all others in a process: what stops an arm, and what keeps it going."""
        return self.type in (StopRequest, ArmRequest, LinkState)

    @property
    def is_stop(self) -> bool:
        """Whether it carries requests to stop, which overtake the other urgent ones too."""
        return self.type is StopRequest

    @property
    def high_water_mark(self) -> int:
        """Queue size of the subscriber; when it is full the latest message is dropped (and counted as lost)."""
        return 60 if self.is_image or self.limit_hz else 1000

    @property
    def publisher_high_water_mark(self) -> int:
        """Queue size of the publisher for each subscriber. Few images: they take the publisher's memory."""
        return 6 if self.is_image else self.high_water_mark


_LATEST, _QUEUE, _LATCHED = Profile.LATEST, Profile.QUEUE, Profile.LATCHED
IMAGE_BYTES = 2**24
_MOVEMENT_BYTES = 2**20

CLOCK = Topic("clock", Clock, 15, _QUEUE)
CAMERA_IMAGE_RAW = Topic("camera/image_raw", RawImage, 15, _LATEST, "camera_optical", max_bytes=IMAGE_BYTES)
CAMERA_IMAGE = Topic(
    "camera/image", CompressedImage, 15, _LATEST, "camera_optical", recorded=True, max_bytes=IMAGE_BYTES
)
CAMERA_IMAGES_RAW = tuple(replace(CAMERA_IMAGE_RAW, name=f"camera_{number}/image_raw") for number in range(1, 5))
CAMERA_IMAGES = tuple(replace(CAMERA_IMAGE, name=f"camera_{number}/image") for number in range(1, 5))
"""Of the calibrated cameras that look at a person."""
CAMERA_KEY_POINTS = tuple(
    Topic(f"camera_{number}/key_points", BodyKeyPoints, 15, _QUEUE, f"camera_{number}", recorded=True)
    for number in range(1, 5)
)
"""Arms of the person in these images."""
OBJECTS_TRACKED = Topic("objects/tracked", TrackedObjects, 15, _QUEUE, "camera_optical", recorded=True)
GESTURES = Topic("gestures", Gesture, None, _QUEUE, recorded=True)
GESTURES_SCENE = Topic("gestures/scene", SceneUpdate, 15, _QUEUE, "table", recorded=True)
CALIBRATION_PLANE = Topic("calibration/plane", PlaneCalibration, None, _LATCHED, "right_shoulder", recorded=True)
HUMAN_ARM_POSE = Topic("human/arm_pose", ArmPose, None, _QUEUE, recorded=True)
ACTION_ESTIMATE = Topic("action/estimate", ActionEstimate, 15, _QUEUE, "table", recorded=True)
ACTION_OUTLINE = Topic("action/outline", ImageAnnotations, 15, _QUEUE, "camera_1", recorded=True)
ACTION_SCENE = Topic("action/scene", SceneUpdate, 15, _QUEUE, "table", recorded=True)
RULES = Topic("rules", Rules, None, _LATCHED, "right_shoulder", recorded=True)
APPLICATION_STAGE = Topic("application/stage", ApplicationStage, 1, _LATCHED, recorded=True)
SPEECH = Topic("speech", Speech, None, _QUEUE, recorded=True)
RELOCATION_GOAL = Topic("relocation/goal", RelocationGoal, None, _QUEUE, "right_shoulder", recorded=True)
RELOCATION_STATUS = Topic("relocation/status", RelocationStatus, None, _QUEUE, recorded=True)
ARM_TRAJECTORY = Topic(
    "arm/trajectory",
    JointTrajectory,
    None,
    _QUEUE,
    recorded=True,
    max_bytes=_MOVEMENT_BYTES,
    limit_hz=20,
    max_points=20_000,
)
ARM_TRAJECTORY_STATUS = Topic("arm/trajectory_status", TrajectoryStatus, None, _QUEUE, recorded=True)
ARM_JOINT_STATES = Topic("arm/joint_states", JointStates, 15, _QUEUE, recorded=True)
ARM_JOINT_STATES_FAST = Topic("arm/joint_states/fast", JointStates, 100, _QUEUE, recorded=True)
"""At the rate of the loop that moves the arm."""
ARM_MOTORS = Topic("arm/motors", MotorStatus, 1, _QUEUE, recorded=True)
ARM_SAFETY = Topic("arm/safety", SafetyState, 15, _LATCHED, recorded=True)
OPERATOR_ARM = Topic("operator/arm", ArmRequest, None, _LATCHED, recorded=True)
OPERATOR_ARM_AT_START = replace(OPERATOR_ARM, name="operator/arm_at_start")
"""From a program, for an emulated robot: the publisher of `operator/arm` is a person's terminal."""
OPERATOR_STOP = Topic("operator/stop", StopRequest, None, _LATCHED, recorded=True)
OPERATOR_ESTOP = replace(OPERATOR_STOP, name="operator/estop")
"""From a terminal: a topic has one publisher, and that of `operator/stop` may be the live page."""
OPERATOR_ARM_AWAY = replace(OPERATOR_ARM, name="operator/arm_away", recorded=False)
OPERATOR_STOP_AWAY = replace(OPERATOR_STOP, name="operator/stop_away", recorded=False)
"""From persons at other hosts, by this host's relay; recorded under the names that they have there."""
PARAMETERS_SET = Topic("parameters/set", ParameterRequest, None, _QUEUE, recorded=True, limit_hz=20)
"""From persons and programs outside of a run, to all nodes whose parameters may change while they run."""
HOSTS_LINK = Topic("hosts/link", LinkState, 100, _QUEUE)
WIRE_HOAP3_STREAM = Topic("wire/hoap3/stream", StreamBatch, None, _QUEUE, recorded=True, max_bytes=_MOVEMENT_BYTES)
WIRE_HOAP3_STATE = Topic("wire/hoap3/state", Hoap3State, 15, _QUEUE, recorded=True)
TRUTH_LAYOUT = Topic("truth/layout", TruthLayout, None, _LATCHED, "world")
TRUTH_STATE = Topic("truth/state", TruthState, 15, _QUEUE, "world")
TRUTH_ARM = Topic("truth/arm", TruthArm, 15, _QUEUE, "table")
TRUTH_VIEW = Topic("truth/view", RawImage, 15, _LATEST, "view", max_bytes=IMAGE_BYTES)

LIBRARY: tuple[Topic, ...] = tuple(
    topic
    for value in list(globals().values())
    for topic in (value if isinstance(value, tuple) else (value,))
    if isinstance(topic, Topic)
)
"""Every topic of the library but the status topics, which exist once per node: see `status`."""
_own_by_folder: dict[Path, tuple[Topic, ...]] = {}
_LIBRARY_BY_NAME = {topic.name: topic for topic in LIBRARY}
TOPICS: tuple[Topic, ...]
"""These, and then those of the workspace that the current folder belongs to, read when they are first needed."""
RECORDED: tuple[Topic, ...]
"""Those of `TOPICS` that the recorder stores."""
STEREO_IMAGES_RAW = CAMERA_IMAGES_RAW[:2]
"""Images of two cameras, for tracking an arm."""
BY_RELAYS = (OPERATOR_ARM_AWAY, OPERATOR_STOP_AWAY, HOSTS_LINK)
"""Published in runs on several hosts only."""
PERSONS_STOPS = (OPERATOR_STOP, OPERATOR_ESTOP)
"""A person's stops."""
AWAY = {OPERATOR_ARM.name: OPERATOR_ARM_AWAY, **{topic.name: OPERATOR_STOP_AWAY for topic in PERSONS_STOPS}}
"""What persons request at other hosts -> how it is published here, where persons have the topic for themselves."""
ARMINGS = (OPERATOR_ARM, OPERATOR_ARM_AT_START, OPERATOR_ARM_AWAY)
"""Arming requests: a driver subscribes to all of them."""
STOPS = (*PERSONS_STOPS, OPERATOR_STOP_AWAY)
"""Stops: a driver subscribes to all of them."""
SHARED = frozenset(topic.name for topic in (CLOCK, PARAMETERS_SET, HOSTS_LINK, *STOPS))
"""Topics that a run has once, as the statuses: one stop stops all its arms. All others exist once in each namespace."""

OWN_TABLE = "msgs/topics.yaml"
"""File of a workspace with topics of its own; see `topic_table`."""
NAME = r"[a-z0-9_]+(/[a-z0-9_]+)*"
_NAME = re.compile(NAME)


def is_name(name: str) -> bool:
    """Whether a topic may be called so: parts of lower-case letters, digits and `_`, joined by `/`."""
    return _NAME.fullmatch(name) is not None


def status(node: str) -> Topic:
    """Topic of the status of the node called `node`.

    Raises ValueError if the name has other characters than lower-case letters, digits and `_`.
    """
    name = _STATUS_PREFIX + node
    if not _NAME.fullmatch(name) or "/" in node:
        raise ValueError(f"node name {node!r}: expected lower-case letters, digits and '_' only")
    return Topic(name, NodeStatus, 1, _LATCHED, recorded=True)


def name_in(namespace: str, name: str) -> str:
    """Name on the bus of a topic that a node in a namespace calls `name`; "" is the run itself.

    `left/arm/safety` for `arm/safety`, `truth/left/state` for `truth/state`; statuses and the topics of `SHARED` are
    called the same in all namespaces.
    """
    if not namespace or name in SHARED or name.startswith(_STATUS_PREFIX):
        return name
    if name.startswith(_TRUTH_PREFIX):
        return f"{_TRUTH_PREFIX}{namespace}/{name.removeprefix(_TRUTH_PREFIX)}"
    return f"{namespace}/{name}"


def name_on_bus(name: str, remaps: Mapping[str, str], namespace: str) -> str:
    """Name on the bus of a topic that a node calls `name`: that of its remaps, or else that in its namespace."""
    return remaps[name] if name in remaps else name_in(namespace, name)


def topic_in(namespace: str, topic: Topic) -> Topic:
    """The topic as a program outside of that namespace names it: the same row where it has the same name there."""
    name = name_in(namespace, topic.name)
    return topic if name == topic.name else replace(topic, name=name)


def in_all(namespaces: Iterable[str], rows: Iterable[Topic]) -> tuple[Topic, ...]:
    """The topics of the run itself and those of each namespace, each once."""
    rows = tuple(rows)
    named = [topic_in(namespace, topic) for namespace in ("", *namespaces) for topic in rows]
    return tuple({topic.name: topic for topic in named}.values())


def split_name(name: str) -> tuple[str, str]:
    """Namespace of a name on the bus, "" for none, and the name in it: the reverse of `name_in`."""
    if name.startswith(_STATUS_PREFIX) or _row(name) is not None:
        return "", name
    truth = _TRUTH_PREFIX if name.startswith(_TRUTH_PREFIX) else ""
    namespace, _, rest = name.removeprefix(truth).partition("/")
    return (namespace, truth + rest) if rest else ("", name)


OLD_NAMES = {f"{camera}/light": f"{camera}/image_raw" for camera in ("camera", *(f"camera_{n}" for n in range(1, 5)))}
"""Topics renamed since the last release; the old name is accepted for one release, with a warning."""
_OLD_CONSTANTS = {
    "CAMERA_LIGHT": "CAMERA_IMAGE_RAW", "CAMERA_LIGHTS": "CAMERA_IMAGES_RAW", "STEREO_LIGHTS": "STEREO_IMAGES_RAW",
}  # fmt: skip


def __getattr__(name: str) -> Any:
    """The tables with the workspace's topics, its topics by their names as constants, and renamed constants."""
    if name == "TOPICS":
        return LIBRARY + own()
    if name == "RECORDED":
        return tuple(topic for topic in LIBRARY + own() if topic.recorded)
    if name in _OLD_CONSTANTS:
        return globals()[_now_called(f"topics.{name}", _OLD_CONSTANTS[name])]
    if name.isupper():
        for topic in own():
            if constant_of(topic.name) == name:
                return topic
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def constant_of(name: str) -> str:
    """How a node calls a topic of this name: `LAMP_STATE` for `lamp/state`."""
    return name.replace("/", "_").upper()


def own() -> tuple[Topic, ...]:
    """Topics of the workspace that the current folder belongs to; raises as `topic_table.own_topics` does."""
    folder = Path.cwd()
    if folder not in _own_by_folder:
        from paramove.bus.topic_table import own_topics

        _own_by_folder[folder] = own_topics(Workspace.at(folder), _LIBRARY_BY_NAME)
    return _own_by_folder[folder]


def known() -> tuple[Topic, ...]:
    """The library's topics, and the workspace's where they have been read: for messages about faults."""
    return LIBRARY + sum(_own_by_folder.values(), ())


def present_names(text: str) -> str:
    """The text of a launch file with the names that its topics have now."""
    for old, new in OLD_NAMES.items():
        if re.search(rf"(?<![\w/]){old}(?![\w/])", text):
            text = re.sub(rf"(?<![\w/]){old}(?![\w/])", _now_called(f"topic {old}", new), text)
    return text


def _now_called(old: str, new: str) -> str:
    warnings.warn(f"{old} is called {new} now; the next release knows the new name only", FutureWarning, stacklevel=3)
    return new


class UnknownTopicError(InputError):
    """There is no topic of this name; the text names the nearest ones."""


def named(name: str | Topic) -> Topic:
    """As `by_name`, for a name that a person has written, or a row; raises UnknownTopicError, and what `own` raises.

    A slash before the name, which ROS writes, is left out.
    """
    if isinstance(name, Topic):
        return name
    if not isinstance(name, str):
        raise UnknownTopicError(f"expected the name of a topic, such as 'arm/joint_states', found {name!r:.80}")
    try:
        return by_name(name.removeprefix("/"))
    except InputError:  # of the workspace's table
        raise
    except (KeyError, ValueError) as error:
        raise UnknownTopicError(str(error.args[0])) from error


def by_name(name: str) -> Topic:
    """Topic of that name, former name or name in a namespace; raises KeyError that names the nearest topics."""
    topic = known_by(OLD_NAMES.get(name, name))
    if topic is None:
        names = (topic.name for topic in LIBRARY + own())
        raise KeyError(f"no topic {name!r} here; {nearest(name, names)}")
    return topic


def known_by(name: str) -> Topic | None:
    """Topic of that name, also in a namespace; None if there is none in any. Raises ValueError as `status` does."""
    if name.startswith(_STATUS_PREFIX):
        return status(name.removeprefix(_STATUS_PREFIX))
    topic = _row(name)
    if topic is not None:
        return topic
    namespace, local = split_name(name)
    topic = _row(local)
    if topic is None or not namespace or local in SHARED:
        return None
    return topic_in(namespace, topic)


def _row(name: str) -> Topic | None:
    """Row of the library's table, or else of the workspace's."""
    if name in _LIBRARY_BY_NAME:
        return _LIBRARY_BY_NAME[name]
    return next((topic for topic in own() if topic.name == name), None)
