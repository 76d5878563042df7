"""A recording played on a bus: its messages, at their distances, in the time of now; nothing that arms or stops."""

import os
from dataclasses import replace

import pytest
from typer.testing import CliRunner

from paramove.bus import BusVisitor, Topic, inspection, topics
from paramove.cli.main import build
from paramove.client import Run, is_played, play
from paramove.documents import InputError, exit_codes
from paramove.msgs.clock_pb2 import Clock
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.relocation_pb2 import RelocationGoal
from paramove.msgs.rule_pb2 import Speech
from paramove.msgs.safety_state_pb2 import ArmRequest, StopRequest
from paramove.recording import RecordingWriter, contents
from tests.received_messages import received_while

BEGIN_NS, STEP_NS = 5 * 10**9, 10**8


@pytest.fixture
def recording(tmp_path):
    """Ten gestures and sentences in a second, and what is never played."""
    path = tmp_path / "recording.mcap"
    with RecordingWriter(path, "test") as writer:
        for number in range(10):
            now_ns = BEGIN_NS + number * STEP_NS
            gesture = Gesture(x=number)
            gesture.captured.FromNanoseconds(now_ns - 7)
            for topic, message in (
                ("gestures", gesture),
                ("speech", Speech(text=str(number))),
                ("clock", Clock(time_ns=now_ns)),
                ("operator/arm", ArmRequest(armed=True, by_person=True)),
                ("operator/stop", StopRequest()),
                ("relocation/goal", RelocationGoal(id=str(number))),
            ):
                writer.write(topic, message, now_ns, now_ns, number + 1)
    return path


def test_a_recording_is_played_in_its_order_and_time(folder, recording):
    with Run(folder) as run:
        found = received_while(
            folder,
            (topics.GESTURES, topics.SPEECH, topics.OPERATOR_ARM, topics.OPERATOR_STOP, topics.RELOCATION_GOAL),
            lambda: play(run, recording, rate=2.0, wait_s=30.0),
        )
    assert {one.topic.name for one in found} == {"gestures", "speech"}
    gestures = [one for one in found if one.topic.name == "gestures"]
    assert [one.message.x for one in gestures] == list(range(10))
    assert [one.message.text for one in found if one.topic.name == "speech"] == [str(n) for n in range(10)]
    for one in gestures:
        assert one.published_ns - one.message.captured.ToNanoseconds() == 7
    assert 1e-9 * (gestures[-1].published_ns - gestures[0].published_ns) > 0.4


def test_named_topics_are_played_from_a_time_on(folder, recording):
    with Run(folder) as run:
        found = received_while(
            folder,
            (topics.GESTURES, topics.RELOCATION_GOAL),
            lambda: play(run, recording, ["relocation/goal"], rate=100.0, start_s=0.55, wait_s=30.0),
        )
    assert [one.message.id for one in found] == ["6", "7", "8", "9"]


@pytest.mark.parametrize("name", ["operator/arm", "operator/stop", "clock"])
def test_what_nodes_or_persons_alone_publish_is_never_played(folder, recording, name):
    with Run(folder) as run, pytest.raises(InputError, match="not played"):
        play(run, recording, ["speech", name], wait_s=0.0)


def test_a_request_under_another_name_or_in_another_pool_is_none_that_is_played(folder):
    assert not is_played(Topic("my/arm", ArmRequest, None, topics.Profile.QUEUE), named=True)
    assert not is_played(Topic("operator/arm", Speech, None, topics.Profile.QUEUE), named=True)
    assert not is_played(Topic("truth/mine", Speech, None, topics.Profile.QUEUE), named=True)
    assert is_played(Topic("my/speech", Speech, None, topics.Profile.QUEUE))


def test_a_topic_of_another_workspace_is_read_and_played_by_its_recorded_schema(
    folder, user_workspace, tmp_path_factory, monkeypatch
):
    tree = user_workspace.message("Tree")(height=2.0)
    tree.at.FromNanoseconds(BEGIN_NS)
    path = user_workspace.root / "own.mcap"
    with RecordingWriter(path, "test") as writer:
        writer.write("some/topic", tree, BEGIN_NS, BEGIN_NS, 1)
    own = topics.by_name("some/topic")
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    with pytest.raises(KeyError):
        topics.by_name("some/topic")
    (recorded,) = contents(path)
    assert (recorded.name, recorded.type_name, recorded.messages) == ("some/topic", own.type_name, 1)
    with Run(folder) as run:
        found = received_while(folder, [own], lambda: play(run, path, wait_s=30.0))
    assert found[0].message.height == 2.0
    assert found[0].message.at.ToNanoseconds() == found[0].published_ns


def test_messages_of_a_changed_type_or_too_large_for_the_topic_are_not_played(folder, recording, monkeypatch):
    small = replace(topics.SPEECH, max_bytes=1)
    monkeypatch.setitem(topics._LIBRARY_BY_NAME, "speech", small)
    with Run(folder) as run, pytest.raises(InputError, match="the topic allows 1; raise its max_bytes"):
        play(run, recording, ["speech"], wait_s=0.0)
    monkeypatch.setitem(topics._LIBRARY_BY_NAME, "speech", replace(topics.GESTURES, name="speech"))
    with Run(folder) as run, pytest.raises(InputError, match=r"Speech is paramove\.msgs\.Gesture now"):
        play(run, recording, ["speech"], wait_s=0.0)


def test_a_recording_without_messages_is_told_from_a_damaged_one(tmp_path):
    empty = tmp_path / "empty.mcap"
    RecordingWriter(empty, "test").close()
    with pytest.raises(InputError, match="has no messages"):
        contents(empty)
    empty.write_bytes(empty.read_bytes()[:-20])
    with pytest.raises(InputError, match="paramove recover"):
        contents(empty)


def test_bag_info_lists_the_topics(recording):
    shown = CliRunner().invoke(build("bag"), ["bag", "info", str(recording)])
    lines = [line.split() for line in shown.output.splitlines()]
    assert shown.output.startswith(f"{recording}: 0.9 s, 60 messages\n")
    assert lines[2][:4] == ["gestures", "paramove.msgs.Gesture", "10", "10.0"]


@pytest.mark.parametrize(
    ("words", "code", "printed"),
    [
        (("--topics", "gestres"), exit_codes.CONFIGURATION, "did you mean 'gestures'?"),
        (("--topics", "operator/arm"), exit_codes.CONFIGURATION, "not played"),
    ],
)
def test_what_bag_play_rejects_is_reported(folder, recording, words, code, printed):
    done = CliRunner().invoke(build("bag"), ["bag", "play", str(recording), *words, "--wait", "0"])
    assert (done.exit_code, printed in done.output) == (code, True), done.output


def test_a_topic_that_a_node_publishes_is_reported_with_the_node(folder, recording):
    with BusVisitor(folder, "node") as node:
        node.publisher(topics.SPEECH)
        done = CliRunner().invoke(build("bag"), ["bag", "play", str(recording), "--wait", "0"])
        assert done.exit_code == exit_codes.TEMPORARY
        assert f"pid {os.getpid()} (node)" in done.output
        only = CliRunner().invoke(
            build("bag"), ["bag", "play", str(recording), "--topics", "gestures", "--rate", "50", "--wait", "0"]
        )
        assert only.output.endswith("\nplayed 10 messages\n")
    assert not inspection.publisher_of(folder, topics.GESTURES).alive
