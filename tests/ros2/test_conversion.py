"""What the bus carries, as ROS 2's messages."""

import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from paramove.msgs.node_status_pb2 import NodeStatus
from paramove.msgs.relocation_pb2 import RelocationGoal
from paramove.msgs.safety_state_pb2 import SafetyFault, SafetyState

pytest.importorskip("rclpy", reason="not installed: rclpy (pip install 'paramove[ros2]')")

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from visualization_msgs.msg import Marker

from paramove.ros2 import conversion

STAMP_NS = 1_700_000_000_123_456_789


@pytest.mark.parametrize("time_ns", [0, 1, 999_999_999, 1_000_000_000, STAMP_NS])
def test_a_time_keeps_its_nanoseconds(time_ns):
    stamp = conversion.time_of(time_ns)
    assert stamp.sec * 1_000_000_000 + stamp.nanosec == time_ns


def test_what_not_all_joints_have_is_left_out():
    message = JointStates()
    message.joints.add(name="joint1", position=0.5, velocity=-1.0)
    message.joints.add(name="gripper", position=-0.25)
    state = conversion.joint_state(message, conversion.time_of(STAMP_NS))
    assert (list(state.name), list(state.position)) == (["joint1", "gripper"], [0.5, -0.25])
    assert (list(state.velocity), list(state.effort)) == ([], [])
    message.joints[1].velocity = 0.0
    assert list(conversion.joint_state(message, conversion.time_of(0)).velocity) == [-1.0, 0.0]


def test_an_image_keeps_its_bytes_its_frame_and_its_time():
    message = CompressedImage(data=b"\xff\xd8\x00\x01", format="jpeg", frame_id="camera_optical")
    image = conversion.image(message, conversion.time_of(STAMP_NS))
    assert (bytes(image.data), image.format, image.header.frame_id) == (message.data, "jpeg", "camera_optical")
    assert image.header.stamp.sec == STAMP_NS // 1_000_000_000


def test_spheres_and_lines_are_markers_with_numbers_of_their_own():
    scene = SceneUpdate()
    entity = scene.entities.add(frame_id="table", id="arm")
    ball = entity.spheres.add()
    ball.pose.position.x, ball.size.x, ball.color.r, ball.color.a = 0.25, 0.0625, 1.0, 0.5
    line = entity.lines.add(thickness=0.5)
    line.points.add(z=1.0)
    line.points.add(z=2.0)
    sphere, strip = conversion.markers(scene, conversion.time_of(0)).markers
    assert (sphere.type, strip.type) == (Marker.SPHERE, Marker.LINE_STRIP)
    assert (sphere.ns, sphere.id, strip.id, strip.header.frame_id) == ("arm", 0, 1, "table")
    assert (sphere.pose.position.x, sphere.scale.x, sphere.color.a) == (0.25, 0.0625, 0.5)
    assert ([point.z for point in strip.points], strip.scale.x) == ([1.0, 2.0], 0.5)


@pytest.mark.parametrize(
    ("state", "level"),
    [
        (SafetyState.STATE_ARMED, DiagnosticStatus.OK),
        (SafetyState.STATE_DISARMED, DiagnosticStatus.OK),
        (SafetyState.STATE_STOPPING, DiagnosticStatus.ERROR),
        (SafetyState.STATE_HOLD, DiagnosticStatus.ERROR),
        (SafetyState.STATE_ESTOP, DiagnosticStatus.ERROR),
        (SafetyState.STATE_DISCONNECTED, DiagnosticStatus.ERROR),
    ],
)
def test_a_gate_is_well_while_nothing_is_wrong_with_the_arm(state, level):
    gate = SafetyState(state=state, faults=[SafetyFault(code="jump", detail="too far")])
    (status,) = conversion.diagnostics([("arm/safety", gate)], [], conversion.time_of(0)).status
    assert (status.name, status.level) == ("arm/safety", level)
    assert [(value.key, value.value) for value in status.values] == [("jump", "too far")]


def test_nodes_are_among_the_diagnostics():
    nodes = [NodeStatus(node="a", state=NodeStatus.STATE_READY), NodeStatus(node="b", state=NodeStatus.STATE_DEGRADED)]
    found = conversion.diagnostics([], nodes, conversion.time_of(0)).status
    assert [(status.name, status.level) for status in found] == [
        ("a", DiagnosticStatus.OK),
        ("b", DiagnosticStatus.WARN),
    ]


def test_a_pose_becomes_a_goal_for_the_open_hand():
    pose = PoseStamped()
    pose.header.frame_id = "arm_base"
    pose.pose.position.x, pose.pose.position.z = 0.25, 0.125
    goal = conversion.goal(pose)
    place = getattr(goal, "from")
    assert (goal.kind, goal.frame, place.x, place.y, place.z) == (
        RelocationGoal.KIND_OFFER_HAND, "arm_base", 0.25, 0.0, 0.125
    )  # fmt: skip
