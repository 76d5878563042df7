"""A run of relocation by pointing of a few seconds, made up: pointings, goals, and where an object stood."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations

from paramove.action_space.messages import TablePose
from paramove.bus import topics
from paramove.cameras.frames import Frame, encode
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.relocation_pb2 import Position, RelocationGoal, RelocationStatus
from paramove.msgs.rule_pb2 import ApplicationStage, Speech
from paramove.msgs.truth_pb2 import TruthArm, TruthBody, TruthLayout, TruthState
from paramove.recording.writer import RecordingWriter

PERIOD_NS = 66_666_667
EVERY_S = 10.0
SHOULDER = np.array([-0.035, -0.11, 0.125])
TABLE = TablePose(frame="right_shoulder", x=0.15, y=-0.1, z=-0.134, yaw=2.4)
LYING = (0.7071068, 0.0, 0.0, 0.7071068)
SUCCEEDED = RelocationStatus.STATE_SUCCEEDED


@dataclass(frozen=True)
class Put:
    """What happens at one place; x, y in the shoulder frame, m.

    Attributes:
        pointed: Where the person points; None: nobody does.
        recognised: What the robot understands.
        final: Where the object ends. `lying`: it has fallen. `by_person`: it is held by the person.
        state: How the goal ends.
    """

    pointed: tuple[float, float] | None = (0.16, 0.0)
    recognised: tuple[float, float] = (0.163, 0.004)
    final: tuple[float, float] = (0.164, 0.004)
    lying: bool = False
    by_person: bool = False
    state: int = SUCCEEDED
    certainty: float = 0.9


GOOD = Put()
"""Recognised 5 mm beside, put 1 mm beside that, 5.657 mm in all."""
REJECTED = replace(GOOD, state=RelocationStatus.STATE_REJECTED)


def write_run(folder, puts, done=True, with_table=True, view=False):
    """Writes recording and truth of a run in which one place follows the other every ten seconds."""
    folder.mkdir(parents=True, exist_ok=True)
    _write_truth(folder, puts, with_table, view)
    said = [item for number, put in enumerate(puts) for item in _said(number, put)]
    end_ns = round(EVERY_S * len(puts) * 1e9)
    stage = ApplicationStage.STAGE_DONE if done else ApplicationStage.STAGE_APPLY
    said.append((topics.APPLICATION_STAGE, end_ns, ApplicationStage(stage=stage)))
    for number in range(round(EVERY_S * len(puts) * 1e9) // PERIOD_NS):
        now_ns = number * PERIOD_NS
        said.append((topics.ACTION_OUTLINE, now_ns, _outline(now_ns)))
        picture = np.full((24, 32, 3), 90 + number % 50, dtype=np.uint8)
        said.append((topics.CAMERA_IMAGES[0], now_ns, encode(Frame(picture, now_ns, number))))
    with RecordingWriter(folder / "recording.mcap", "test") as recording:
        for number, (topic, time_ns, message) in enumerate(sorted(said, key=lambda item: item[1]), start=1):
            recording.write(topic.name, message, time_ns, time_ns, number)
    return folder


def _said(number, put):
    """Asked at 1 s, recognised at 3 s, ended at 8 s of this place's ten seconds."""
    begin_s = EVERY_S * number
    gesture = Gesture(kind=Gesture.KIND_POINTED_AT, located=True, frame="right_shoulder", confidence=put.certainty)
    gesture.x, gesture.y = put.recognised
    goal = RelocationGoal(id=f"g-{number}", kind=RelocationGoal.KIND_PLACE_HELD, object="yellow")
    goal.to.CopyFrom(Position(x=put.recognised[0], y=put.recognised[1], z=-0.098))
    status = RelocationStatus(goal_id=goal.id, state=put.state, reason="it slipped" if put.state != SUCCEEDED else "")
    asks = Speech(request=Speech.REQUEST_POINT_AT_PLACE, text="Please point.")
    moments = (
        (topics.SPEECH, 1.0, asks),
        (topics.GESTURES, 3.0, gesture),
        (topics.RELOCATION_GOAL, 4.0, goal),
        (topics.RELOCATION_STATUS, 8.0, status),
    )
    return [(topic, round((begin_s + after_s) * 1e9), message) for topic, after_s, message in moments]


def _outline(now_ns):
    message = ImageAnnotations()
    message.timestamp.FromNanoseconds(now_ns)
    circle = message.circles.add(diameter=5.0)
    circle.position.x, circle.position.y = 16.0, 12.0
    return message


def _write_truth(folder, puts, with_table, view):
    layout = TruthLayout(seed=7, world_from_shoulder=SHOULDER.tolist(), surface_z=-0.134 + SHOULDER[2])
    if with_table:
        pose = np.eye(4)
        origin = TABLE.frame_from_table(np.zeros(3))
        pose[:3, :3] = (TABLE.frame_from_table(np.eye(3)) - origin).T
        pose[:3, 3] = origin + SHOULDER
        layout.world_from_table.extend(pose.ravel().tolist())
    with RecordingWriter(folder / "truth.mcap", "test") as truth:
        truth.write("truth/layout", layout, 0, 0, 1)
        for number in range(round(EVERY_S * len(puts) * 1e9) // PERIOD_NS + 1):
            now_ns = number * PERIOD_NS
            at = min(int(now_ns * 1e-9 / EVERY_S), len(puts) - 1)
            in_s = now_ns * 1e-9 - EVERY_S * at
            truth.write("truth/state", _state(now_ns, puts[at], in_s), now_ns, now_ns, number + 1)
            truth.write("truth/arm", _arm(now_ns, puts[at], at + 1, in_s), now_ns, now_ns, number + 1)
            if view:
                truth.write("truth/view", _view(now_ns), now_ns, now_ns, number + 1)


def _state(now_ns, put, in_s):
    x, y = put.final if in_s > 7.0 else (0.13, -0.12)
    point = np.array([x, y, -0.109]) + SHOULDER
    body = TruthBody(name="yellow", x=point[0], y=point[1], z=point[2], last_touched_by="robot")
    body.quaternion_xyzw.extend(LYING if put.lying else (0.0, 0.0, 0.0, 1.0))
    body.held_by_instructor = put.by_person
    message = TruthState(time_ns=now_ns, gripper=[0.0] * 3, gripper_commanded=[0.0] * 3, unwanted_contacts=1)
    message.objects.append(body)
    return message


def _arm(now_ns, put, performance, in_s):
    message = TruthArm(time_ns=now_ns)
    if put.pointed is not None and 1.5 <= in_s <= 4.0:
        inverse = np.linalg.inv(TABLE.frame_from_table(np.eye(3)) - TABLE.frame_from_table(np.zeros(3)))
        place = (np.array([*put.pointed, -0.064]) - TABLE.frame_from_table(np.zeros(3))) @ inverse
        message.action, message.performance, message.at_target = "pointing", performance, 2.5 <= in_s <= 3.5
        message.target.x, message.target.y, message.target.z = place
    return message


def _view(now_ns):
    picture = encode(Frame(np.full((24, 32, 3), 60, dtype=np.uint8), now_ns, 0))
    return CompressedImage(timestamp=picture.timestamp, data=picture.data, format="jpeg")
