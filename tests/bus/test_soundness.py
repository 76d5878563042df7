"""Numbers that are none, found wherever they are in a message."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import zmq
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from hypothesis import given, settings
from hypothesis import strategies as st

from paramove.bus import topics
from paramove.bus.envelope import Reason
from paramove.bus.publisher import ImpossibleTimeError, Publisher
from paramove.bus.soundness import LARGEST, impossible_time, unsound
from paramove.bus.subscriber import Subscriber
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory, TrajectoryPoint
from paramove.msgs.node_status_pb2 import NodeStatus
from paramove.msgs.relocation_pb2 import Position, RelocationGoal
from tests.bus.conftest import Wait
from tests.own_workspace import UserWorkspace


def _goal(**to: float) -> RelocationGoal:
    return RelocationGoal(id="g", to=Position(**to))


@pytest.mark.parametrize("topic", topics.TOPICS, ids=lambda topic: topic.name)
def test_a_message_without_content_is_sound(topic: topics.Topic) -> None:
    assert unsound(topic.type()) == ""


@pytest.mark.parametrize(
    ("message", "found"),
    [
        (Gesture(x=math.nan), "x is nan"),
        (Gesture(u_px=-math.inf), "u_px is -inf"),
        (_goal(y=1e300), "to.y is 1e+300"),
        (RelocationGoal(avoid=[Position(), Position(z=math.inf)]), "avoid[1].z is inf"),
        (JointTrajectory(points=[TrajectoryPoint(position_rad=[0.0, math.nan])]), "points[0].position_rad[1] is nan"),
        (
            JointTrajectory(points=[TrajectoryPoint(position_rad=[1e300, 0])]),
            "points[0].position_rad[0] is 1e+300",
        ),
        (JointStates(joints=[JointState(velocity=math.nan)]), "joints[0].velocity is nan"),
    ],
)
def test_the_first_bad_number_is_named(message: object, found: str) -> None:
    assert unsound(message) == found


@pytest.mark.parametrize(("seconds", "nanos"), [(-1, 0), (2**62, 0), (-(2**63), 0), (0, -1), (0, 10**9)])
def test_times_that_no_clock_has_are_found(seconds: int, nanos: int) -> None:
    gesture = Gesture()
    gesture.captured.seconds, gesture.captured.nanos = seconds, nanos
    assert unsound(gesture) == f"captured.seconds is {seconds} with {nanos} ns"


def test_a_value_without_a_name_is_unsound() -> None:
    status = NodeStatus()
    status.state = 99  # type: ignore[assignment]
    assert unsound(NodeStatus.FromString(status.SerializeToString())) == "state is 99, which has no name"


def test_an_impossible_time_is_rejected_at_the_publisher(context: zmq.Context[Any], folder: Path, wait: Wait) -> None:
    publisher = Publisher(context, folder, topics.ARM_TRAJECTORY, "synthesizer")
    subscriber = Subscriber(context, folder, topics.ARM_TRAJECTORY)
    wait(lambda: subscriber.receive() or subscriber.welcomed, publisher.serve)
    trajectory = JointTrajectory()
    for seconds in (-(2**63), -1, 2**62):
        trajectory.captured.seconds = seconds
        with pytest.raises(ImpossibleTimeError, match=f"captured.seconds is {seconds}"):
            publisher.publish(trajectory, captured_ns=1, now_ns=2)
    for time_ns in (-(2**63), 2**63, 10**20):
        with pytest.raises(ImpossibleTimeError, match=str(time_ns)):
            publisher.publish(JointTrajectory(), captured_ns=time_ns, now_ns=2)
    publisher.publish(JointTrajectory(id="good"), captured_ns=1, now_ns=2)
    received = wait(subscriber.receive)
    assert (received.message.id, received.sequence) == ("good", 1)


@settings(deadline=None, max_examples=100, derandomize=True)
@given(st.lists(st.floats(), max_size=5), st.floats())
def test_sound_is_what_is_finite_and_not_huge(angles: list[float], time_s: float) -> None:
    message = JointTrajectory(points=[TrajectoryPoint(time_s=time_s, position_rad=angles)])
    assert (unsound(message) == "") == all(abs(value) <= LARGEST for value in [*angles, time_s])


def test_what_is_unsound_is_refused_counted_and_told(
    context: zmq.Context[Any], folder: Path, wait: Wait, caplog: pytest.LogCaptureFixture
) -> None:
    publisher = Publisher(context, folder, topics.GESTURES, "recognizer")
    subscriber = Subscriber(context, folder, topics.GESTURES)
    wait(lambda: subscriber.receive() or subscriber.welcomed, publisher.serve)
    for x in (math.nan, 1e300, 0.5):
        publisher.publish(Gesture(object="red", x=x), captured_ns=1, now_ns=2)
    assert wait(subscriber.receive).message.x == 0.5
    assert subscriber.counter.rejected[Reason.NUMBER] == 2
    assert subscriber.counter.lost == 0
    assert "topic gestures: message rejected (number, number 1): x is nan; finite numbers expected" in caplog.text


def _tree(kind: Any) -> Any:
    tree = kind(height=1.0, age=2.0, oak=3.0, leaves={"a": 1.0}, colours={"a": 1})
    tree.branches.add().tree.branches.add().tree.height = 4.0
    tree.nests[3].height = 5.0
    tree.visits["a"].seconds = 6
    return tree


@pytest.mark.parametrize(
    ("place", "field", "value", "found"),
    [
        (lambda tree: tree, "height", math.nan, "height is nan"),
        (lambda tree: tree, "age", math.nan, "age is nan"),
        (lambda tree: tree, "oak", math.nan, "oak is nan"),
        (lambda tree: tree.leaves, "b", math.nan, "leaves['b'] is nan"),
        (lambda tree: tree.nests[7].leaves, "b", math.nan, "nests[7].leaves['b'] is nan"),
        (
            lambda tree: tree.branches[0].tree.branches[0].tree,
            "height",
            math.nan,
            "branches[0].tree.branches[0].tree.height is nan",
        ),
        (lambda tree: tree.colours, "a", 5, "colours['a'] is 5, which has no name"),
        (lambda tree: tree.visits["b"], "seconds", -1, "visits['b'].seconds is -1 with 0 ns"),
        (lambda tree: tree.where.pose.position, "x", math.nan, "where.pose.position.x is nan"),
        (lambda tree: tree.grown, "nanos", -1, "grown.seconds is 0 with -1 ns"),
    ],
)
def test_numbers_are_found_in_maps_and_in_messages_that_are_a_part_of_themselves(
    user_workspace: UserWorkspace, place: Callable[[Any], Any], field: str, value: float, found: str
) -> None:
    tree = _tree(user_workspace.message("Tree"))
    assert unsound(tree) == ""
    changed = place(tree)
    if hasattr(changed, "keys"):
        changed[field] = value
    else:
        setattr(changed, field, value)
    assert unsound(tree) == found


def test_a_message_of_texts_that_is_a_part_of_itself_is_sound(user_workspace: UserWorkspace) -> None:
    plain = user_workspace.message("Plain")(text="a", words={"a": "b"})
    plain.next.next.text = "b"
    assert unsound(plain) == impossible_time(plain) == ""
