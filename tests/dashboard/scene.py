"""What the nodes say in the middle of a run: an image, three objects, two rules, a goal, the gate, some words."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates

from paramove.bus import topics
from paramove.bus.subscriber import Received
from paramove.bus.topics import Topic
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.node_status_pb2 import NodeStatus, TopicCount
from paramove.msgs.relocation_pb2 import Position, RelocationGoal, RelocationStatus
from paramove.msgs.rule_pb2 import ApplicationStage, Rule, Rules, Speech
from paramove.msgs.safety_state_pb2 import SafetyFault, SafetyState
from paramove.msgs.tracked_objects_pb2 import OutlinePoint, TrackedObject, TrackedObjects
from paramove.objects.homography import PlaneHomography

WIDTH, HEIGHT = 480, 360
ORANGE_BGR = (20, 120, 240)
PLACES = {"yellow": (240.0, 180.0), "green": (150.0, 200.0), "blue": (330.0, 190.0)}
IMAGE_POINTS = [(120.0, 250.0), (360.0, 250.0), (330.0, 150.0), (150.0, 150.0)]
CORNERS = [(0.135, 0.076), (0.135, -0.10), (0.19, -0.10), (0.19, 0.076)]
SENTENCE = "You point at green: it belongs to the opening at (13.1, 1.8) cm."


def image(colour_bgr: tuple[int, int, int] = ORANGE_BGR) -> CompressedImage:
    """An image of one colour."""
    encoded = cv2.imencode(".jpg", np.full((HEIGHT, WIDTH, 3), colour_bgr, np.uint8))[1]
    return CompressedImage(data=encoded.tobytes(), format="jpeg", frame_id="camera_optical")


def tracked() -> TrackedObjects:
    """Three objects and the hand."""
    message = TrackedObjects(frame="camera_optical", width_px=WIDTH, height_px=HEIGHT)
    for name, (u, v) in PLACES.items():
        message.objects.add(
            name=name,
            kind=TrackedObject.KIND_OBJECT,
            u_px=u,
            v_px=v,
            left_px=u - 10,
            top_px=v - 20,
            width_px=20,
            height_px=40,
        )
    hand = message.objects.add(name="hand", kind=TrackedObject.KIND_HAND, u_px=60, v_px=60, left_px=40, top_px=40)
    hand.width_px, hand.height_px = 40, 40
    hand.outline.extend(OutlinePoint(u_px=u, v_px=v) for u, v in ((40, 40), (80, 44), (76, 80), (44, 78)))
    return message


def status(node: str, state: NodeStatus.State = NodeStatus.STATE_READY, detail: str = "", **more: Any) -> NodeStatus:
    """What a node says of itself."""
    return NodeStatus(node=node, state=state, detail=detail, **{"pid": 7, **more})


def safety(state: SafetyState.State = SafetyState.STATE_ARMED, *faults: tuple[str, str]) -> SafetyState:
    """The gate's word; faults as code and sentence."""
    return SafetyState(state=state, faults=[SafetyFault(code=code, detail=detail) for code, detail in faults])


def goal() -> RelocationGoal:
    """Green from where it stands into its opening."""
    message = RelocationGoal(id="goal-9", kind=RelocationGoal.KIND_RELOCATE, object="green", attempt=2)
    getattr(message, "from").CopyFrom(Position(x=0.171, y=-0.078, z=-0.098))
    message.to.CopyFrom(Position(x=0.131, y=0.018, z=-0.098))
    return message


def messages() -> list[tuple[Topic, Any]]:
    """In the order in which they are said."""
    rules = Rules(frame="right_shoulder")
    rules.rules.extend([Rule(object="green", x=0.131, y=0.018, observations=1), Rule(object="blue", x=0.13, y=0.072)])
    joints = JointStates()
    joints.joints.add(name="right_shoulder_pitch", position=0.6)
    joints.joints.add(name="right_elbow", position=-1.0)
    joints.joints.add(name="no_such_joint", position=1.0)
    return [
        (topics.CAMERA_IMAGE, image()),
        (topics.OBJECTS_TRACKED, tracked()),
        (topics.CALIBRATION_PLANE, PlaneHomography.fit(IMAGE_POINTS, CORNERS, -0.109).to_message()),
        (topics.RULES, rules),
        *(
            (topics.GESTURES, Gesture(kind=Gesture.KIND_RESTED, object=name, located=True, x=0.16, y=0.0))
            for name in PLACES
        ),
        (topics.GESTURES, Gesture(kind=Gesture.KIND_VANISHED, object="blue", located=True, x=0.13, y=0.072)),
        (topics.GESTURES, Gesture(kind=Gesture.KIND_POINTED_AT, object="green", located=True)),
        (topics.APPLICATION_STAGE, ApplicationStage(stage=ApplicationStage.STAGE_APPLY, step="relocating", grasps=5)),
        (topics.SPEECH, Speech(text=SENTENCE)),
        (topics.RELOCATION_GOAL, goal()),
        (
            topics.RELOCATION_STATUS,
            RelocationStatus(goal_id="goal-9", state=RelocationStatus.STATE_EXECUTING, phase="carry", holding=True),
        ),
        (topics.ARM_JOINT_STATES, joints),
        (topics.ARM_SAFETY, safety()),
        (topics.status("camera"), status("camera", detail="frames from topic:camera/image_raw")),
        (
            topics.status("recognizer"),
            status(
                "recognizer", NodeStatus.STATE_DEGRADED, "calibration refused", received=[TopicCount(topic="x", lost=3)]
            ),
        ),
    ]


def heard(said: list[tuple[Topic, Any]], from_ns: int = 1_000_000_000) -> list[Received]:
    """The same as a bus hands it out, a millisecond apart."""
    return [
        Received(topic, message, from_ns + 1_000_000 * number, from_ns + 1_000_000 * number, number + 1)
        for number, (topic, message) in enumerate(said)
    ]
