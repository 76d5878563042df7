"""Times of a message become those of the host that receives it."""

from __future__ import annotations

import pytest
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from paramove.bus import Envelope, schema_hash, topics
from paramove.hosts.clock_offset import ClockOffset
from paramove.hosts.own_time import LARGEST_BOUND_NS, UnknownTimeError, in_own_time
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory
from paramove.msgs.rule_pb2 import Rule, Rules, Speech
from paramove.msgs.safety_state_pb2 import ArmRequest, StopRequest

AHEAD_NS, NOW_NS = 5_000_000_000_000, 10**12


def clock(bound_ns=1000):
    known = ClockOffset()
    known.add(NOW_NS - 2 * bound_ns, NOW_NS - bound_ns + AHEAD_NS, NOW_NS)
    return known


def arrived(topic, message, known):
    there_ns = NOW_NS + AHEAD_NS
    envelope = Envelope(schema_hash(topic.type), 1, 2, 3, there_ns, there_ns - 7)
    return in_own_time(topic, envelope, message.SerializeToString(), known, NOW_NS)


def test_all_times_of_a_message_and_its_parts_are_set_back():
    rules = Rules(rules=[Rule(object="blue"), Rule(object="green")])
    rules.captured.FromNanoseconds(NOW_NS + AHEAD_NS)
    rules.rules[1].seen.FromNanoseconds(NOW_NS + AHEAD_NS - 40)
    envelope, message = arrived(topics.RULES, rules, clock())
    assert (envelope.published_ns, envelope.captured_ns, envelope.sequence) == (NOW_NS, NOW_NS - 7, 3)
    assert message.captured.ToNanoseconds() == NOW_NS
    assert message.rules[1].seen.ToNanoseconds() == NOW_NS - 40
    assert not message.rules[0].HasField("seen")
    assert [rule.object for rule in message.rules] == ["blue", "green"]


def test_times_of_public_messages_too_but_no_durations():
    scene = SceneUpdate()
    entity = scene.entities.add()
    entity.timestamp.FromNanoseconds(NOW_NS + AHEAD_NS)
    entity.lifetime.FromNanoseconds(500)
    _, message = arrived(topics.GESTURES_SCENE, scene, clock())
    assert message.entities[0].timestamp.ToNanoseconds() == NOW_NS
    assert message.entities[0].lifetime.ToNanoseconds() == 500


def test_nothing_arrives_before_the_clock_is_known():
    with pytest.raises(UnknownTimeError):
        arrived(topics.SPEECH, Speech(text="one"), ClockOffset())


@pytest.mark.parametrize(
    ("topic", "message"),
    [
        (topics.ARM_TRAJECTORY, JointTrajectory(id="a")),
        (topics.OPERATOR_ARM, ArmRequest(source="a person", armed=True, by_person=True)),
    ],
)
def test_a_command_whose_age_is_not_known_is_rejected(topic, message):
    arrived(topic, message, clock(LARGEST_BOUND_NS - 1_000_000))
    with pytest.raises(UnknownTimeError, match="6"):
        arrived(topic, message, clock(LARGEST_BOUND_NS + 1_000_000))


def test_a_stop_counts_however_old():
    late = clock(100 * LARGEST_BOUND_NS)
    arrived(topics.OPERATOR_ESTOP, StopRequest(source="terminal"), late)
    arrived(topics.OPERATOR_ARM, ArmRequest(source="a person", armed=False, by_person=True), late)


@pytest.mark.parametrize("seconds", [-(2**62), 0, 2**62])
def test_a_stop_counts_from_when_it_comes_whatever_clock_is_there(seconds):
    stop = StopRequest(source="terminal")
    disarm = ArmRequest(source="a person", armed=False)
    for topic, request in ((topics.OPERATOR_ESTOP, stop), (topics.OPERATOR_ARM, disarm)):
        request.captured.seconds = seconds
        envelope, message = arrived(topic, request, ClockOffset())
        assert (envelope.published_ns, envelope.captured_ns) == (NOW_NS, NOW_NS)
        assert message.captured.ToNanoseconds() == NOW_NS


def test_times_in_maps_and_in_messages_that_are_a_part_of_themselves_are_set_back(user_workspace):
    message = user_workspace.message("Branch")()
    message.tree.at.FromNanoseconds(NOW_NS + AHEAD_NS)
    message.tree.visits["a"].FromNanoseconds(NOW_NS + AHEAD_NS - 1)
    message.tree.nests[2].at.FromNanoseconds(NOW_NS + AHEAD_NS - 2)
    message.tree.branches.add().tree.branches.add().tree.at.FromNanoseconds(NOW_NS + AHEAD_NS - 3)
    message.tree.leaves["a"] = 1.0
    _, moved = arrived(topics.by_name("some/topic"), message, clock())
    tree = moved.tree
    times = [tree.at, tree.visits["a"], tree.nests[2].at, tree.branches[0].tree.branches[0].tree.at]
    assert [NOW_NS - time.ToNanoseconds() for time in times] == [0, 1, 2, 3]
    assert tree.leaves == {"a": 1.0}
