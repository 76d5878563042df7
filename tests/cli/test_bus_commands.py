"""`paramove topic` and `paramove node` on a real bus."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from paramove.bus import topics
from paramove.bus.bus import Bus
from paramove.bus.settings import BusSettings
from paramove.cli.main import COMMANDS, build
from paramove.cli.topic import readable
from paramove.client import connect
from paramove.documents import DocumentError, exit_codes
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.hoap3_wire_pb2 import StreamBatch
from paramove.msgs.rule_pb2 import Rule, Rules
from tests.own_workspace import UserWorkspace
from tests.received_messages import received_while

Run = Callable[..., Any]
RULES = Rules(frame="table", rules=[Rule(object="blue"), Rule(object="green", x=0.5)])


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> Iterator[Run]:
    with tempfile.TemporaryDirectory(prefix="run-") as runtime:
        monkeypatch.setenv("XDG_RUNTIME_DIR", runtime)
        monkeypatch.delenv("PARAMOVE_DOMAIN", raising=False)

        def invoke(*arguments: str) -> Any:
            return CliRunner().invoke(build(arguments[0]), arguments)

        yield invoke


@pytest.fixture
def speaking(run: Run) -> Iterator[Path]:
    """A node that says ten gestures a second or so, in a thread of its own as if it were a process."""
    folder = Path(os.environ["XDG_RUNTIME_DIR"]) / "paramove" / "default"
    made: list[Bus] = []
    ready = threading.Event()

    def speak() -> None:
        with Bus("recognizer", BusSettings(folder=folder), (), (topics.GESTURES, topics.RULES)) as bus:
            made.append(bus)
            bus.publish(topics.RULES, RULES)
            bus.ready("recognising\x1b[2J")
            ready.set()
            for _ in bus.events(tick=True):
                bus.publish(topics.GESTURES, Gesture(object="red"))

    thread = threading.Thread(target=speak)
    thread.start()
    assert ready.wait(60)
    yield folder
    made[0].stop()
    thread.join()


def test_without_a_bus_the_commands_say_so(run: Run) -> None:
    for arguments in (("topic", "list"), ("node", "list"), ("topic", "echo", "gestures"), ("topic", "hz")):
        result = run(*arguments)
        assert result.exit_code == 1
        assert "nothing is running in this domain" in result.output


def test_list_shows_who_says_what(run: Run, speaking: Path) -> None:
    assert [row["topic"] for row in json.loads(run("topic", "list", "--json").output)] == [
        "gestures",
        "rules",
        "status/recognizer",
    ]
    rows = {row["topic"]: row for row in json.loads(run("topic", "list", "--all", "--json").output)}
    assert rows["gestures"]["publisher"] == f"pid {os.getpid()} (recognizer)"
    assert rows["camera/image"]["publisher"] == rows["camera/image"]["said by"] == "none"
    assert rows["status/recognizer"]["type"] == "paramove.msgs.NodeStatus"
    assert not any(name.startswith("truth/") for name in rows)
    text = run("topic", "list").output.splitlines()
    assert text[0].split() == ["topic", "type", "rate_hz", "profile", "recorded", "publisher"]
    assert any(line.startswith("gestures ") and "(recognizer)" in line for line in text)


def test_info_shows_what_was_said(run: Run, speaking: Path) -> None:
    row = json.loads(run("topic", "info", "rules", "--json").output)
    assert (row["alive"], row["answers"], row["said so far"]) == (True, True, 1)
    lines = [line.split() for line in run("topic", "info", "calibration/plane").output.splitlines()]
    assert ["frame", "right_shoulder"] in lines
    assert ["publisher", "none"] in lines
    wrong = run("topic", "info", "camera/imgae")
    assert wrong.exit_code == 2
    assert "camera/image" in wrong.output


def test_echo_prints_messages_and_ends(run: Run, speaking: Path) -> None:
    result = run("topic", "echo", "gestures", "--count", "2", "--json")
    lines = [json.loads(line) for line in result.output.splitlines()]
    assert [line["message"]["object"] for line in lines] == ["red"] * 2
    assert lines[0]["message"]["confidence"] == 0.0, "a number that is zero is shown"
    assert lines[1]["sequence"] == lines[0]["sequence"] + 1
    assert "--- rules 1, captured at" in run("topic", "echo", "rules", "--count", "1").output


def test_echo_of_a_silent_topic_ends_and_says_so(run: Run, speaking: Path) -> None:
    result = run("topic", "echo", "speech", "--seconds", "0.2")
    assert result.exit_code == 1
    assert "speech: no publisher within 0.2 s" in result.output


@pytest.mark.parametrize(
    ("field", "printed"),
    [("rules[0].object", "blue"), ("rules[1].x", 0.5), ("rules[7]", None), ("frame", "table")],
)
def test_echo_prints_a_part(run: Run, speaking: Path, field: str, printed: object) -> None:
    result = run("topic", "echo", "rules", "--once", "--field", field)
    assert json.loads(result.output) == printed


def test_echo_names_the_nearest_part(run: Run, speaking: Path) -> None:
    result = run("topic", "echo", "rules", "--once", "--field", "rules[0].objekt")
    assert result.exit_code == 2
    assert "did you mean 'object'?" in result.output


def test_maps_and_messages_of_a_workspace_are_printed(user_workspace: UserWorkspace) -> None:
    tree = user_workspace.message("Tree")(leaves={"a": 0.5}, colours={"b": 1})
    tree.nests[3].height = 2.0
    shown = readable(tree)
    assert (shown["leaves"], shown["colours"]) == ({"a": 0.5}, {"b": "COLOUR_RED"})
    assert shown["nests"]["3"]["height"] == 2.0


def test_a_wrong_table_of_the_workspace_is_reported_and_not_taken_for_an_unknown_topic(
    run: Run, speaking: Path, user_workspace: UserWorkspace
) -> None:
    user_workspace.table("some/topic: {type: paramove.msgs.Gestur}")
    for words in (("topic", "type", "some/topic"), ("topic", "pub", "some/topic")):
        result = run(*words)
        assert isinstance(result.exception, DocumentError)
        assert "did you mean 'paramove.msgs.Gesture'?" in str(result.exception)
    with connect() as client, pytest.raises(DocumentError, match=r"paramove\.msgs\.Gesture"):
        client.latest("some/topic")


def test_type_and_interface_show_what_a_topic_carries(run: Run, user_workspace: UserWorkspace) -> None:
    user_workspace.message("Tree")
    assert run("topic", "type", "some/topic").output == f"{user_workspace.package}.Tree\n"
    shown = run("interface", "show", "some/topic").output
    assert shown == run("interface", "show", f"{user_workspace.package}.Tree").output
    package = user_workspace.package
    for line in (
        f"message {package}.Tree {{",
        f"message {package}.Branch {{",
        f"  repeated {package}.Branch branches = 1;",
        "  map<string, double> leaves = 4;",
        f"  map<int32, {package}.Tree> nests = 5;",
        f"  enum {package}.Colour {{ COLOUR_UNKNOWN = 0; COLOUR_RED = 1; }}",
        "  foxglove.PoseInFrame where = 8;",
        "  optional double age = 10;",
        "  double oak = 11;  // one of kind",
        "message foxglove.Quaternion {",
    ):
        assert f"{line}\n" in shown
    assert run("interface", "show", "Gesture").output == run("interface", "show", "/gestures").output
    wrong = run("interface", "show", f"{package}.Tre")
    assert wrong.exit_code == 2
    assert f"did you mean '{package}.Tree'?" in wrong.output
    listed = run("interface", "list").output.splitlines()
    assert {f"{package}.Tree", "paramove.msgs.Gesture", "foxglove.RawImage"} <= set(listed)


def test_pub_publishes_once_with_a_subscriber(run: Run, speaking: Path) -> None:
    done: list[Any] = []

    def publish() -> None:
        done.append(run("topic", "pub", "speech", "{text: hello}", "--wait", "30"))
        done.append(run("topic", "pub", "speech", "{text: again}", "--rate", "50", "--count", "3", "--wait", "30"))

    received = received_while(speaking, [topics.SPEECH], publish)
    assert [one.exit_code for one in done] == [0, 0], [one.output for one in done]
    assert {one.message.text for one in received} == {"hello", "again"}
    assert [one.output for one in done] == ["speech: published 1 message\n", "speech: published 3 messages\n"]


@pytest.mark.parametrize(
    ("words", "code", "printed"),
    [
        (("gestures", "{object: red}"), exit_codes.TEMPORARY, "(recognizer)"),
        (("speech", "{txt: hello}"), exit_codes.CONFIGURATION, "txt"),
        (("speech", "hello"), exit_codes.CONFIGURATION, "as a mapping"),
        (("speech", "{text: 3}"), exit_codes.CONFIGURATION, "paramove.msgs.Speech"),
        (("relocation/goal", "{to: {x: 1e300}}"), exit_codes.CONFIGURATION, "to.x is 1e+300"),
        (("speech", "{text: " + "a" * 70_000 + "}"), exit_codes.CONFIGURATION, "the topic allows 65536"),
        (("speech", "{text: hello}", "--wait", "0.1"), exit_codes.FAILURE, "nobody subscribed"),
        (("operator/arm", "{armed: true, by_person: true}"), exit_codes.CONFIGURATION, "paramove arm enable"),
        (("operator/stop", "{}"), exit_codes.CONFIGURATION, "paramove arm estop"),
        (("clock", "{}"), exit_codes.CONFIGURATION, "for nodes"),
        (("truth/state", "{}"), exit_codes.CONFIGURATION, "for nodes"),
        (("status/camera", "{}"), exit_codes.CONFIGURATION, "for nodes"),
    ],
)
def test_what_pub_rejects_is_reported(
    run: Run, speaking: Path, words: tuple[str, ...], code: int, printed: str
) -> None:
    done = run("topic", "pub", *words)
    assert (done.exit_code, printed in done.output) == (code, True), done.output


def test_node_info_shows_topics_and_the_nodes_at_them(run: Run, speaking: Path) -> None:
    facts = json.loads(run("node", "info", "recognizer", "--json").output)
    assert (facts["state"], facts["pid"], facts["parameters"]) == ("ready", os.getpid(), {})
    assert {row["topic"]: row["type"] for row in facts["publishes"]}["gestures"] == "paramove.msgs.Gesture"
    text = run("node", "info", "recognizer").output
    assert "subscribes nothing" in text
    assert "\x1b" not in text
    wrong = run("node", "info", "recogniser")
    assert wrong.exit_code == 1
    assert "did you mean 'recognizer'?" in wrong.output


def test_bw_and_delay_measure(run: Run, speaking: Path) -> None:
    (width,) = json.loads(run("topic", "bw", "gestures", "--seconds", "1.5", "--json").output)
    assert width["mean_bytes"] == width["least_bytes"] == width["most_bytes"] == 5
    assert 20 < width["bytes_per_s"] < 120
    (age,) = json.loads(run("topic", "delay", "gestures", "--seconds", "1.5", "--json").output)
    assert 0.0 <= age["captured_to_published_ms"] < 1000.0
    assert 0.0 <= age["published_to_here_ms"] < 1000.0


def test_hz_does_not_count_the_value_from_before(run: Run, speaking: Path) -> None:
    (rules,) = json.loads(run("topic", "hz", "rules", "--seconds", "1", "--json").output)
    assert (rules["rate_hz"], rules["messages"], rules["state"]) == (0.0, 1, "published")


def test_hz_measures_rate_and_size(run: Run, speaking: Path) -> None:
    rows = {row["topic"]: row for row in json.loads(run("topic", "hz", "--seconds", "1.5", "--json").output)}
    assert set(rows) == {"gestures", "rules", "status/recognizer"}
    gestures = rows["gestures"]
    assert 5 < gestures["rate_hz"] < 20
    assert (gestures["lost"], gestures["refused"], gestures["state"]) == (0, 0, "published")
    assert gestures["mean_bytes"] == Gesture(object="red").ByteSize()
    assert rows["rules"]["messages"] == 1
    silent = json.loads(run("topic", "hz", "speech", "--seconds", "0.1", "--json").output)[0]
    assert (silent["state"], silent["messages"]) == ("no publisher", 0)


def test_a_dead_and_a_busy_speaker_are_shown_as_such(run: Run, speaking: Path) -> None:
    program = (
        "import sys, os; from pathlib import Path; from paramove.bus import topics; from paramove.bus.bus import Bus;"
        "from paramove.bus.settings import BusSettings;"
        "bus = Bus(sys.argv[2], BusSettings(folder=Path(sys.argv[1])), (), (getattr(topics, sys.argv[3]),));"
        "sys.stdout.write('x'); sys.stdout.flush(); sys.stdin.read()"
    )
    started = []
    for node, topic in (("dead", "SPEECH"), ("busy", "CLOCK")):
        command = [sys.executable, "-c", program, str(speaking), node, topic]
        started.append(subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE))
        assert started[-1].stdout is not None
        assert started[-1].stdout.read(1) == b"x"
    try:
        started[0].kill()
        started[0].wait()
        rows = {row["topic"]: row for row in json.loads(run("topic", "list", "--all", "--json").output)}
        assert rows["speech"]["publisher"] == "none"
        assert rows["clock"]["publisher"] == f"pid {started[1].pid} (busy)"
        hz = json.loads(run("topic", "hz", "clock", "--seconds", "0.2", "--json").output)[0]
        assert hz["state"] == "not responding"
        nodes = {row["node"]: row for row in json.loads(run("node", "list", "--seconds", "0.5", "--json").output)}
        assert set(nodes) == {"recognizer", "busy"}
        assert nodes["busy"]["state"] == "busy"
        assert "did not answer" in nodes["busy"]["sentence"]
    finally:
        for process in started:
            process.kill()
            process.communicate()


def test_node_list_shows_states_and_no_control_characters(run: Run, speaking: Path) -> None:
    (row,) = json.loads(run("node", "list", "--json").output)
    assert (row["node"], row["state"], row["pid"]) == ("recognizer", "ready", os.getpid())
    assert "recognising?[2J" in run("node", "list").output


def test_long_bytes_and_enums_are_readable() -> None:
    message = StreamBatch(epoch=3, frames=b"\0" * 56_000)
    assert readable(message).items() >= {"epoch": 3, "frames": "<56000 bytes>"}.items()
    gesture = Gesture(kind=Gesture.KIND_MOVED, x=float("nan"))
    gesture.captured.FromNanoseconds(2_000_000_003)
    shown = readable(gesture)
    assert (shown["captured"], shown["kind"], shown["x"]) == ({"seconds": 2, "nanos": 3}, "KIND_MOVED", "nan")
    assert (shown["y"], shown["object"]) == (0.0, ""), "zeros and empty texts are shown"
    assert "captured" not in readable(Gesture()), "a message that is not there is not"
    assert readable(topics.CLOCK.type(published=[{"topic": "a"}]))["published"][0]["topic"] == "a"


def test_only_the_called_command_is_imported() -> None:
    program = "import sys; from paramove.cli.main import build; build('topic'); sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_help_and_version_need_no_command() -> None:
    result = CliRunner().invoke(build(None), ["--help"])
    assert result.exit_code == 0
    assert COMMANDS["topic"][1] in result.output
    assert CliRunner().invoke(build(None), ["--version"]).output.startswith("paramove ")
