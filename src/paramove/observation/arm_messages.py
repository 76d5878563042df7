"""Bus messages of a tracked arm: its points, and lines through them in a camera's image and in space."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.Point2_pb2 import Point2
from foxglove_schemas_protobuf.PointsAnnotation_pb2 import PointsAnnotation
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from paramove.cameras import WORLD_FRAME
from paramove.documents import Floats
from paramove.msgs.arm_pose_pb2 import ArmPose

Colour = tuple[float, float, float]
"""Red, green, blue, each 0 to 1."""
GREEN: Colour = (0.2, 1.0, 0.4)


def pose_message(captured_ns: int, points: Mapping[str, Floats]) -> ArmPose:
    """Points of an arm, (3,), m, in the world, by their names."""
    message = ArmPose(frame=WORLD_FRAME)
    message.captured.FromNanoseconds(captured_ns)
    for name, (x, y, z) in points.items():
        message.points.add(name=name, x=x, y=y, z=z)
    return message


def line_in_image(captured_ns: int, points: Iterable[Floats], colour: Colour, *, closed: bool) -> ImageAnnotations:
    """A line through points, (2,), px, of an image as captured."""
    message = ImageAnnotations()
    message.timestamp.FromNanoseconds(captured_ns)
    message.points.add(
        timestamp=message.timestamp,
        type=PointsAnnotation.LINE_LOOP if closed else PointsAnnotation.LINE_STRIP,
        points=[Point2(x=x, y=y) for x, y in points],
        outline_color=opaque(colour),
        thickness=2.0,
    )
    return message


def add_circle(message: ImageAnnotations, centre: Floats, diameter: float, colour: Colour) -> None:
    """Adds a filled circle about a point, (2,), px."""
    message.circles.add(
        timestamp=message.timestamp,
        position=Point2(x=centre[0], y=centre[1]),
        diameter=diameter,
        thickness=1.0,
        fill_color=opaque(colour),
        outline_color=opaque(colour),
    )


def line_in_scene(captured_ns: int, name: str, points: Iterable[Floats], frame: str = WORLD_FRAME) -> SceneUpdate:
    """An entity of that name: a green line through points, (3,), m, of a frame."""
    message = SceneUpdate()
    entity = message.entities.add(id=name, frame_id=frame)
    entity.timestamp.FromNanoseconds(captured_ns)
    entity.lifetime.FromMilliseconds(1000)
    line = entity.lines.add(thickness=0.02, color=opaque((0.0, 1.0, 0.0)))
    line.pose.orientation.w = 1.0
    for x, y, z in points:
        line.points.add(x=x, y=y, z=z)
    return message


def opaque(colour: Colour) -> Color:
    """The message of a colour."""
    red, green, blue = colour
    return Color(r=red, g=green, b=blue, a=1.0)
