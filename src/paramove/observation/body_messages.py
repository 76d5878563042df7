"""Bus messages of the body tracker: arm pose, and the arm drawn in the first camera's image."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.PointsAnnotation_pb2 import PointsAnnotation
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from paramove.cameras import WORLD_FRAME, CalibratedCamera
from paramove.msgs.arm_pose_pb2 import ArmPose
from paramove.observation.body_tracking import BodyPoints

ALONG_THE_ARM = ("sternum", "shoulder", "elbow", "wrist", "knuckle", "index")
GREEN = (0.2, 1.0, 0.4)


def arm_pose_message(body: BodyPoints) -> ArmPose:
    """The detected points."""
    message = ArmPose(frame=WORLD_FRAME)
    message.captured.FromNanoseconds(body.captured_ns)
    for name, point in body.points.items():
        x, y, z = point.position
        message.points.add(name=name, x=x, y=y, z=z)
    return message


def outline_message(body: BodyPoints, camera: CalibratedCamera) -> ImageAnnotations:
    """The detected points, joined by a line, in the image of a camera as captured."""
    message = ImageAnnotations()
    message.timestamp.FromNanoseconds(body.captured_ns)
    line = message.points.add(type=PointsAnnotation.LINE_STRIP, thickness=2.0)
    line.timestamp.CopyFrom(message.timestamp)
    line.outline_color.r, line.outline_color.g, line.outline_color.b = GREEN
    line.outline_color.a = 1.0
    for name in _in_order(list(body.points)):
        x, y = camera.project(body.points[name].position)
        if np.isfinite((x, y)).all():
            line.points.add(x=x, y=y)
            circle = message.circles.add(diameter=5.0, thickness=1.0)
            circle.timestamp.CopyFrom(message.timestamp)
            circle.position.x, circle.position.y = x, y
            for colour in (circle.fill_color, circle.outline_color):
                colour.r, colour.g, colour.b, colour.a = (*GREEN, 1.0)
    return message


def scene_message(body: BodyPoints) -> SceneUpdate:
    """The detected points, joined by a line, in the world."""
    message = SceneUpdate()
    entity = message.entities.add(id="arm", frame_id=WORLD_FRAME)
    entity.timestamp.FromNanoseconds(body.captured_ns)
    entity.lifetime.FromMilliseconds(1000)
    arm = entity.lines.add(thickness=0.02)
    arm.color.g = arm.color.a = 1.0
    arm.pose.orientation.w = 1.0
    for name in _in_order(list(body.points)):
        x, y, z = body.points[name].position
        arm.points.add(x=x, y=y, z=z)
    return message


def _in_order(names: Sequence[str]) -> list[str]:
    """From the body to the end of the hand; unknown names last."""
    return sorted(names, key=lambda name: ALONG_THE_ARM.index(name) if name in ALONG_THE_ARM else len(ALONG_THE_ARM))
