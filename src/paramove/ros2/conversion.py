"""Messages of the bus as messages of ROS 2: REP-103 units and axes in both, so only names and containers differ."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from builtin_interfaces.msg import Duration, Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from geometry_msgs.msg import Point, PoseStamped
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CompressedImage as RosCompressedImage
from sensor_msgs.msg import JointState
from std_msgs.msg import ColorRGBA, String
from visualization_msgs.msg import Marker, MarkerArray

from paramove.msgs.node_status_pb2 import NodeStatus
from paramove.msgs.relocation_pb2 import RelocationGoal
from paramove.msgs.safety_state_pb2 import SafetyState

_LEVELS = {NodeStatus.STATE_READY: DiagnosticStatus.OK, NodeStatus.STATE_FAILED: DiagnosticStatus.ERROR}
_LEVELS_OF_GATES = {SafetyState.STATE_ARMED: DiagnosticStatus.OK, SafetyState.STATE_DISARMED: DiagnosticStatus.OK}


def time_of(time_ns: int) -> Time:
    """Nanoseconds as a time of ROS."""
    seconds, nanoseconds = divmod(max(0, time_ns), 1_000_000_000)
    return Time(sec=seconds, nanosec=nanoseconds)


def clock(time_ns: int) -> Clock:
    """Simulated time."""
    return Clock(clock=time_of(time_ns))


def text(content: str) -> String:
    """A text."""
    return String(data=content)


def joint_state(message: JointStates, stamp: Time) -> JointState:
    """Positions, rad or m, and what else all joints have: velocities, efforts."""
    state = JointState()
    state.header.stamp = stamp
    state.name = [joint.name for joint in message.joints]
    state.position = [joint.position for joint in message.joints]
    if all(joint.HasField("velocity") for joint in message.joints):
        state.velocity = [joint.velocity for joint in message.joints]
    if all(joint.HasField("effort") for joint in message.joints):
        state.effort = [joint.effort for joint in message.joints]
    return state


def image(message: CompressedImage, stamp: Time) -> RosCompressedImage:
    """A compressed image, in the optical frame of its camera."""
    converted = RosCompressedImage(format=message.format)
    converted.header.stamp = stamp
    converted.header.frame_id = message.frame_id
    converted.data = message.data
    return converted


def markers(message: SceneUpdate, stamp: Time) -> MarkerArray:
    """Spheres and lines of a scene; those of an entity have its id as their namespace."""
    array = MarkerArray()
    for entity in message.entities:
        for number, marker in enumerate(_shapes(entity)):
            marker.header.stamp = stamp
            marker.header.frame_id = entity.frame_id
            marker.ns, marker.id = entity.id, number
            marker.lifetime = Duration(sec=entity.lifetime.seconds, nanosec=entity.lifetime.nanos)
            array.markers.append(marker)
    return array


def _shapes(entity: SceneEntity) -> Iterator[Marker]:
    for sphere in entity.spheres:
        marker = Marker(type=Marker.SPHERE, color=_colour(sphere.color))
        marker.pose.position = _point(sphere.pose.position)
        marker.scale.x, marker.scale.y, marker.scale.z = sphere.size.x, sphere.size.y, sphere.size.z
        yield marker
    for line in entity.lines:
        marker = Marker(type=Marker.LINE_STRIP, color=_colour(line.color))
        marker.scale.x = line.thickness
        marker.points = [_point(point) for point in line.points]
        yield marker


def _point(point: Any) -> Point:
    return Point(x=point.x, y=point.y, z=point.z)


def _colour(colour: Any) -> ColorRGBA:
    return ColorRGBA(r=colour.r, g=colour.g, b=colour.b, a=colour.a)


def diagnostics(gates: Iterable[tuple[str, SafetyState]], nodes: Iterable[NodeStatus], stamp: Time) -> DiagnosticArray:
    """States of safety gates, by the names of their topics, and of nodes."""
    array = DiagnosticArray()
    array.header.stamp = stamp
    for name, gate in gates:
        status = DiagnosticStatus(name=name, level=_LEVELS_OF_GATES.get(gate.state, DiagnosticStatus.ERROR))
        status.message = SafetyState.State.Name(gate.state).removeprefix("STATE_")
        status.values = [KeyValue(key=fault.code, value=fault.detail) for fault in gate.faults]
        array.status.append(status)
    for node in nodes:
        status = DiagnosticStatus(name=node.node, level=_LEVELS.get(node.state, DiagnosticStatus.WARN))
        status.message = node.detail
        array.status.append(status)
    return array


def goal(pose: PoseStamped) -> RelocationGoal:
    """The goal to go to a position with an open hand, in the pose's frame; its orientation does not count."""
    message = RelocationGoal(kind=RelocationGoal.KIND_OFFER_HAND, frame=pose.header.frame_id, attempt=1)
    place = getattr(message, "from")
    place.x, place.y, place.z = pose.pose.position.x, pose.pose.position.y, pose.pose.position.z
    return message
