"""What the page shows, put together from the nodes' messages."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from numpy.testing import assert_allclose

from paramove.bus import topics
from paramove.bus.topics import Topic
from paramove.dashboard.live_picture import LivePicture, NodeTable
from paramove.dashboard.robot_shape import RobotShape
from paramove.msgs.action_estimate_pb2 import ActionEstimate, Location
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.node_status_pb2 import NodeStatus
from paramove.msgs.plane_calibration_pb2 import PlaneCalibration
from paramove.msgs.relocation_pb2 import RelocationStatus
from paramove.robots import SurfaceParameters
from tests.dashboard import scene
from tests.robots.hoap3.movements import HOAP3

STOP = {"progress": "not asked", "sentence": ""}
NOW_NS = 2_000_000_000


def picture(*said: tuple[Topic, Any]) -> LivePicture:
    made = LivePicture(HOAP3, "a title", SurfaceParameters(), wall_s=lambda: 10.0)
    for message in scene.heard(list(said)):
        made.handle(message)
    return made


def sections(*said: tuple[Topic, Any]) -> dict[str, Any]:
    return picture(*said).changes(NOW_NS, STOP)


def test_the_middle_of_a_run_is_shown() -> None:
    shown = sections(*scene.messages())
    assert shown["page"]["title"] == "a title"
    assert shown["stage"] == {"stage": "apply", "step": "relocating", "grasps": 5, "retries": 0}
    assert shown["words"][-1]["sentence"] == scene.SENTENCE
    assert shown["safety"] == {"state": "armed", "faults": [], "refused": 0}
    assert shown["pointed"] == "green"
    assert [item["name"] for item in shown["tracked"]["items"]] == ["yellow", "green", "blue", "hand"]
    assert len(shown["tracked"]["items"][-1]["outline"]) == 4
    goal = shown["goal"]
    assert (goal["kind"], goal["object"], goal["phase"], goal["ended"]) == ("relocate", "green", "carry", False)
    assert goal["from"] == [0.171, -0.078, -0.098]


def test_a_tracked_arm_is_drawn_with_its_ball() -> None:
    outline = ImageAnnotations()
    line = outline.points.add()
    line.outline_color.g = 1.0
    for x, y in ((10.04, 20.0), (30.0, 40.0)):
        line.points.add(x=x, y=y)
    ball = outline.circles.add(diameter=9.0)
    ball.position.x, ball.position.y = 50.0, 60.0
    ball.fill_color.r = 2.0  # no such colour
    assert sections((topics.ACTION_OUTLINE, outline))["arm"] == {
        "lines": [{"points": [[10.0, 20.0], [30.0, 40.0]], "closed": False, "colour": "rgb(0 255 0)"}],
        "balls": [{"place": [50.0, 60.0], "diameter": 9.0, "colour": "rgb(255 0 0)"}],
    }


def test_objects_are_where_the_robot_believes_them() -> None:
    objects = sections(*scene.messages())["objects"]
    assert objects["green"]["state"] == "in the robot's hand"
    assert objects["green"]["place"] is None
    assert objects["green"]["rule"]["place"] == [0.131, 0.018]
    assert objects["blue"]["state"] == "in an opening"
    assert objects["blue"]["place"] == [0.13, 0.072]
    assert objects["yellow"]["rule"] is None
    u, v = scene.PLACES["yellow"]
    plane = scene.PlaneHomography.fit(scene.IMAGE_POINTS, scene.CORNERS, -0.109)
    assert_allclose(objects["yellow"]["place"], plane.plane_from_image(u, v), rtol=0, atol=1e-4)


def test_objects_are_drawn_as_they_were_seen() -> None:
    block = Gesture(kind=Gesture.KIND_RESTED, object="green", width_m=0.028, height_m=0.0275, turn_rad=0.4)
    round_one = Gesture(kind=Gesture.KIND_RESTED, object="blue", width_m=0.022, height_m=0.05)
    gone = Gesture(kind=Gesture.KIND_VANISHED, object="blue")
    unknown = Gesture(kind=Gesture.KIND_RESTED, object="yellow")
    lying = Gesture(kind=Gesture.KIND_RESTED, object="red", width_m=0.02, height_m=0.02, turn_rad=2.0, length_m=0.03)
    found = sections(*((topics.GESTURES, one) for one in (block, round_one, gone, unknown, lying)))["objects"]
    assert (found["red"]["state"], found["red"]["size"]["length"]) == ("lies", 0.03)
    assert found["green"]["size"] == {"width": 0.028, "height": 0.0275, "turn": 0.4, "length": 0.0}
    assert found["blue"]["size"] == {"width": 0.022, "height": 0.05, "turn": None, "length": 0.0}
    assert found["yellow"]["size"] is None


def test_what_vanishes_beside_the_surface_is_not_in_an_opening() -> None:
    gone = Gesture(kind=Gesture.KIND_VANISHED, object="blue", located=True, x=0.5, y=0.0)
    found = sections((topics.GESTURES, gone))["objects"]["blue"]
    assert (found["state"], found["place"]) == ("not in view", None)


def test_before_the_calibration_an_object_is_where_the_robot_put_it() -> None:
    done = RelocationStatus(goal_id="goal-9", state=RelocationStatus.STATE_SUCCEEDED)
    shown = sections((topics.RELOCATION_GOAL, scene.goal()), (topics.RELOCATION_STATUS, done))
    assert shown["objects"]["green"]["place"] == [0.131, 0.018]
    assert [(item["object"], item["result"], item["attempt"]) for item in shown["results"]] == [
        ("green", "succeeded", 2)
    ]


def test_an_object_that_the_robot_put_away_unseen_is_where_it_put_it() -> None:
    """The hand hides how it goes in: it vanished on the way, and nobody has seen it since."""
    done = RelocationStatus(goal_id="goal-9", state=RelocationStatus.STATE_SUCCEEDED)
    stood = Gesture(kind=Gesture.KIND_RESTED, object="green", located=True, x=0.171, y=-0.078)
    gone = Gesture(kind=Gesture.KIND_VANISHED, object="green")
    said = [(topics.GESTURES, stood), (topics.RELOCATION_GOAL, scene.goal()), (topics.GESTURES, gone)]
    said.append((topics.RELOCATION_STATUS, done))
    green = sections(*said)["objects"]["green"]
    assert (green["state"], green["place"]) == ("in an opening", [0.131, 0.018])
    green = sections(*said, (topics.GESTURES, stood))["objects"]["green"]
    assert (green["state"], green["place"]) == ("stands", [0.171, -0.078])


def test_a_goal_ends_once_however_often_it_is_said() -> None:
    done = RelocationStatus(goal_id="goal-9", state=RelocationStatus.STATE_FAILED, reason="nothing was felt")
    other = RelocationStatus(goal_id="goal-8", state=RelocationStatus.STATE_SUCCEEDED)
    said = [
        (topics.RELOCATION_GOAL, scene.goal()),
        *[(topics.RELOCATION_STATUS, done)] * 3,
        (topics.RELOCATION_STATUS, other),
    ]
    (result,) = sections(*said)["results"]
    assert (result["result"], result["reason"]) == ("failed", "nothing was felt")


def test_only_changes_are_given() -> None:
    made = picture(*scene.messages())
    made.changes(NOW_NS, STOP)
    assert made.changes(NOW_NS, STOP) == {}
    assert made.changes(NOW_NS + 1_000_000_000, STOP) == {"clock": 3.0}
    assert made.changes(NOW_NS + 1_000_000_000, {"progress": "asked", "sentence": ""}).keys() == {"stop"}


def test_an_image_is_given_once() -> None:
    made = picture((topics.CAMERA_IMAGE, scene.image()))
    assert made.image() == scene.image().data
    assert made.image() is None


def test_pointing_is_shown_for_a_while() -> None:
    made = picture((topics.GESTURES, Gesture(kind=Gesture.KIND_POINTED_AT, object="green")))
    assert made.changes(NOW_NS, STOP)["pointed"] == "green"
    assert made.changes(10 * NOW_NS, STOP)["pointed"] == ""


BROKEN = [
    PlaneCalibration(),
    PlaneCalibration(plane_from_image=[float("nan")] * 9),
    PlaneCalibration(plane_from_image=[0.0] * 9),
    PlaneCalibration(plane_from_image=[1.0, 0, 0, 0, 1, 0, 0, 0, 1]),
]


@pytest.mark.parametrize("plane", BROKEN)
def test_a_calibration_that_cannot_be_used_breaks_nothing(plane: PlaneCalibration) -> None:
    json.dumps(sections((topics.CALIBRATION_PLANE, plane), (topics.OBJECTS_TRACKED, scene.tracked())), allow_nan=False)


def test_numbers_that_are_not_finite_become_nothing() -> None:
    tracked = scene.tracked()
    for item in tracked.objects:
        item.left_px = item.u_px = float("nan")
    joints = scene.messages()[-4][1]
    for joint in joints.joints:
        joint.position = float("inf")
    said = [*scene.messages(), (topics.OBJECTS_TRACKED, tracked), (topics.ARM_JOINT_STATES, joints)]
    json.dumps(sections(*said), allow_nan=False)


def test_the_robots_gripper_is_where_its_kinematics_say() -> None:
    shape = RobotShape(HOAP3.model_path, dict(zip(HOAP3.joint_names, HOAP3.base_pose, strict=True)))
    arm = HOAP3.arms["right"]
    expected = arm.kinematics.forward(HOAP3.base_pose[arm.indices]).gripper
    found = shape.site("right_gripper") - shape.site("right_shoulder")
    assert_allclose(found, expected, rtol=0, atol=1e-9)
    before = shape.poses()
    shape.move({"right_elbow": -1.5, "nothing": 1.0, "right_wrist": float("nan")})
    moved = [old != new for old, new in zip(before, shape.poses(), strict=True)]
    assert 0 < sum(moved) < len(moved) / 2
    assert {part["type"] for part in shape.parts()} == {"box", "capsule", "cylinder", "ellipsoid"}
    assert max(part["body"] for part in shape.parts()) == len(before) - 1
    assert_allclose(np.linalg.norm([pose[3:] for pose in before], axis=1), 1.0, rtol=0, atol=1e-4)


def test_nodes_and_their_restarts() -> None:
    table = NodeTable()
    table.handle(scene.status("camera", processed=10, processing_seconds=0.1), 1.0)
    table.handle(scene.status("camera", processed=30, processing_seconds=0.3), 2.0)
    table.handle(scene.status("arm_driver", NodeStatus.STATE_FAILED, "it broke"), 2.0)
    driver, camera = table.section(5.2)
    assert (camera["ms"], camera["restarts"], camera["silent_s"]) == (10.0, 0, 3)
    assert (driver["name"], driver["state"], driver["sentence"], driver["ms"]) == (
        "arm_driver",
        "failed",
        "it broke",
        None,
    )
    table.handle(scene.status("camera", processed=2, pid=8), 6.0)
    assert table.section(6.0)[1]["restarts"] == 1
    assert table.section(6.0)[1]["ms"] == 10.0


def test_where_a_person_points_is_a_sentence() -> None:
    estimate = ActionEstimate(pointed=Location(x=0.223, y=-0.045, x_deviation=0.012, y_deviation=0.008))
    assert sections((topics.ACTION_ESTIMATE, estimate))["action"] == ""
    estimate.actions.add(action="pointing", probability=0.9)
    estimate.actions.add(action="reaching", probability=0.1)
    said = sections((topics.ACTION_ESTIMATE, estimate))["action"]
    assert said == "pointing: 22 cm forward, 4 cm to the right, ± 1.2 cm"
    estimate.pointed.x_deviation = 0.3
    assert "22 cm" not in sections((topics.ACTION_ESTIMATE, estimate))["action"]
    estimate.detail = "the arm is lost"
    assert sections((topics.ACTION_ESTIMATE, estimate))["action"] == "the arm is lost"
