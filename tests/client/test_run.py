"""A program that is no node: it reads, publishes, sends goals and stops, in the time of the run."""

import os
import threading

import numpy as np
import pytest

import paramove
from paramove.bus import Bus, BusSettings, BusVisitor, LockstepBarrier, TopicTakenError, topics
from paramove.client import NoMessageError, NotConnectedError, Run, connect, message_of
from paramove.documents import InputError
from paramove.msgs.relocation_pb2 import RelocationGoal, RelocationStatus
from paramove.msgs.rule_pb2 import Speech
from tests.supervision.conftest import until

STATUS = RelocationStatus


def test_where_nothing_runs_that_is_said(folder):
    with pytest.raises(InputError, match="nothing is running"):
        paramove.connect()
    with pytest.raises(InputError, match="domain"):
        connect("../x")


def test_what_is_published_comes_back(node):
    with paramove.connect(name="test") as run:
        assert run.latest("rules", 30.0).frame == "table"
        rules = run.listen("rules", seconds=30.0)
        assert run.publish("speech", {"text": "hello"}, wait_s=30.0)
        assert next(one.message for one in rules if one.message.rules).rules[0].text == "hello"
        assert run.publish("speech", Speech(text="again"))
        assert next(rules).message.rules[0].text == "again"
        assert run.latest("rules").rules[0].text == "again"


def test_who_asked_for_the_latest_message_listens_from_then_on(node):
    with connect() as run:
        run.latest("rules", 30.0)
        for text in ("one", "two"):
            assert run.publish("speech", {"text": text}, wait_s=30.0)
            until(lambda text=text: run.latest("rules").rules and run.latest("rules").rules[0].text == text, text)
        rules = run.listen("rules", seconds=30.0)
        assert run.publish("speech", {"text": "three"})
        assert [next(rules).message.rules[0].text for _ in range(2)] == ["two", "three"]
        assert run.publish("speech", {"text": "four"})
        assert run.latest("rules").rules
        assert next(run.listen("rules", seconds=30.0)).message.rules[0].text == "four"


def test_a_topic_without_messages_is_reported_with_its_publisher(node):
    with connect() as run:
        with pytest.raises(NoMessageError, match=r"gestures: no publisher within 0\.1 s"):
            run.latest("gestures", 0.1)
        with pytest.raises(NoMessageError, match=rf"relocation/status: pid {os.getpid()} \(node\) published nothing"):
            run.latest("relocation/status", 0.1)
        assert list(run.listen("gestures", seconds=0.1)) == []


@pytest.mark.parametrize(
    ("topic", "content", "error", "words"),
    [
        ("rules", {}, TopicTakenError, "(node)"),
        ("ruls", {}, InputError, "did you mean 'rules'?"),
        ("speech", {"txt": "a"}, InputError, "txt"),
        ("speech", "no mapping", InputError, "as a mapping"),
        ("speech", {"text": "a" * 100_000}, ValueError, "the topic allows 65536"),
        ("operator/arm", {"armed": True, "by_person": True}, InputError, "paramove arm enable"),
        ("operator/stop", {}, InputError, "for persons"),
        ("truth/state", {}, InputError, "for nodes"),
        ("clock", {}, InputError, "for nodes"),
        ("status/camera", {}, InputError, "for nodes"),
    ],
)
def test_what_cannot_be_published_is_rejected_with_the_reason(node, topic, content, error, words):
    with connect() as run, pytest.raises(error) as raised:
        run.publish(topic, content, wait_s=0.0)
    assert words in str(raised.value)


def test_a_goal_is_sent_until_it_is_acknowledged_and_followed_to_its_end(node):
    with connect() as run:
        done = run.send_goal({"kind": "KIND_REST", "object": "blue"}, 30.0)
        assert done.state == STATUS.STATE_SUCCEEDED
        done = run.send_goal(RelocationGoal(id="mine", object="red"), 30.0)
        assert (done.goal_id, done.state, done.reason) == ("mine", STATUS.STATE_REJECTED, "red")
        with pytest.raises(NoMessageError, match="its state is accepted"):
            run.send_goal({}, 1.0)


def test_a_message_may_be_written_as_yaml_or_json():
    for text in ("{kind: KIND_REST, from: {x: 0.5}}", '{"kind": 5, "from": {"x": 0.5}}'):
        goal = message_of(RelocationGoal, text)
        assert (goal.kind, getattr(goal, "from").x) == (RelocationGoal.KIND_REST, 0.5)
    with pytest.raises(InputError, match="NaN"):
        message_of(RelocationGoal, {"from": {"x": float("nan")}})
    with pytest.raises(InputError, match="the message"):
        message_of(RelocationGoal, "{kind: [")


EVERY_KIND = """
message All {
  bytes data = 1;
  repeated bytes parts = 2;
  map<string, bytes> named = 3;
  repeated double x = 4;
  All next = 5;
}
"""


@pytest.mark.parametrize(
    ("content", "named"),
    [({"kin": "KIND_REST"}, "did you mean 'kind'"), ({"kind": "KIND_REACH"}, "KIND_REST")],
)
def test_a_wrong_field_or_value_is_rejected_with_those_that_there_are(content, named):
    with pytest.raises(InputError, match=named):
        message_of(RelocationGoal, content)


def test_bytes_and_arrays_are_taken_as_they_are(user_workspace):
    kind = user_workspace.message("All", EVERY_KIND)
    fields = {"data": b"\xff\x00raw", "parts": [b"a", bytearray(b"b")], "named": {"c": b"d"}, "x": np.array([1.0, 2.0])}
    made = message_of(kind, {**fields, "next": {"data": "cmF3"}})
    assert (made.data, list(made.parts), dict(made.named)) == (b"\xff\x00raw", [b"a", b"b"], {"c": b"d"})
    assert (list(made.x), made.next.data) == ([1.0, 2.0], b"raw")


@pytest.mark.parametrize("text", ["***", "###", "hello"])
def test_a_text_that_is_no_base64_is_no_bytes(user_workspace, text):
    kind = user_workspace.message("All", EVERY_KIND)
    with pytest.raises(InputError, match=r"next\.data"):
        message_of(kind, {"next": {"data": text}})


def test_a_mapping_that_contains_itself_is_rejected(user_workspace):
    kind = user_workspace.message("All", EVERY_KIND)
    fields: dict = {"x": [1.0]}
    fields["next"] = fields
    with pytest.raises(InputError, match="more than 100 deep"):
        message_of(kind, fields)


def test_topics_may_be_given_as_rows_and_nothing_else_but_names(node):
    with connect() as run:
        assert run.latest(topics.RULES, 30.0).frame == "table"
        with pytest.raises(InputError, match="expected the name of a topic"):
            run.latest(3)
        with pytest.raises(ValueError, match="nan"):
            next(run.listen("rules", seconds=float("nan")))


def test_a_stop_that_no_gate_answers_and_a_time_that_does_not_come_are_no_answers(folder):
    with BusVisitor(folder, "world") as world:
        world.publisher(topics.CLOCK)
        with connect() as run:
            with pytest.raises(NoMessageError, match="the arm may still move"):
                run.stop(0.1)
            with pytest.raises(NoMessageError, match="clock"):
                _ = run.now_ns
    with pytest.raises(NotConnectedError, match="with paramove"):
        run.latest("rules")
    with pytest.raises(NotConnectedError):
        Run(folder).idle(0.1)


def test_a_message_reaches_every_node_that_runs_and_subscribes(folder):
    """Each connects in its own time; the recorder may well be the last."""
    received, buses, threads = [], [], []

    def listens(name, ready):
        with Bus(name, BusSettings(folder=folder), (topics.SPEECH,)) as bus:
            buses.append(bus)
            bus.connect()
            bus.ready("listens")
            ready.set()
            received.extend((name, one.message.text) for one in bus.events())

    for name in ("first", "second", "third"):
        ready = threading.Event()
        threads.append(threading.Thread(target=listens, args=(name, ready)))
        threads[-1].start()
        assert ready.wait(60)
    with connect() as run:
        assert run.publish("speech", {"text": "all"}, wait_s=30.0)
        until(lambda: len(received) == 3, "all have received it")
    assert sorted(received) == [("first", "all"), ("second", "all"), ("third", "all")]
    for bus in buses:
        bus.stop()
    for thread in threads:
        thread.join()


def test_in_simulated_time_messages_have_the_time_of_the_run(folder):
    made, ends = [], threading.Event()
    settings = BusSettings(folder=folder, clock="simulated")

    def tell_the_time():
        with Bus("world", settings, (topics.SPEECH,), (topics.CLOCK,)) as bus:
            barrier = LockstepBarrier(bus)
            bus.ready("publishes the time")
            barrier.wait_for_members()
            made.append(bus)
            while not ends.is_set():
                made.extend(barrier.advance(bus.now_ns + 10**8))
                bus.idle(0.02)

    world = threading.Thread(target=tell_the_time)
    world.start()
    try:
        while not made:
            ends.wait(0.01)
        with connect() as run:
            assert run.publish("speech", {"text": "now"}, wait_s=30.0)
            begun_ns = run.now_ns
            assert 0 < begun_ns < 10**12
            while len(made) == 1:
                run.idle(0.01)
        assert made[1].message.text == "now"
        assert 0 < made[1].captured_ns <= made[0].now_ns
    finally:
        ends.set()
        world.join()
