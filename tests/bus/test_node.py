"""The life of a node as a process: file, signals, exceptions, exit codes."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from paramove.bus import topics
from paramove.bus.bus import Bus
from paramove.bus.node import ConfigurationError, read_node_file
from paramove.bus.settings import BusSettings
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.node_status_pb2 import NodeStatus
from tests.bus.trivial_node import Config

ROOT = Path(__file__).resolve().parents[2]
STATUS = topics.status("trivial")

Start = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture
def start(folder: Path) -> Iterator[Start]:
    started = []

    def begin(parameters: str = "{}") -> subprocess.Popen[str]:
        config = folder / "trivial.yaml"
        config.write_text(f"node: trivial\nbus: {{folder: {folder}}}\nparameters: {parameters}\n", encoding="utf-8")
        command = [sys.executable, "-m", "tests.bus.trivial_node", "--config", str(config)]
        started.append(subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True))
        return started[-1]

    yield begin
    for process in started:
        process.kill()
        process.communicate()


@pytest.fixture
def bus(folder: Path) -> Iterator[Bus]:
    with Bus("tester", BusSettings(folder=folder), (topics.SPEECH, STATUS), (topics.GESTURES,)) as made:
        yield made


def _wait_for_state(bus: Bus, state: NodeStatus.State) -> Any:
    return next(heard.message for heard in bus.events(STATUS) if heard.message.state == state)


def _say(bus: Bus, name: str, starts: int = 1) -> None:
    """Says a gesture once the node, in its so-manieth start, hears it and can be heard."""
    publisher = bus.exchange.publishers["gestures"]
    speech = bus.exchange.subscribers["speech"].counter
    for _ in bus.events(STATUS, tick=True):
        if publisher.subscriptions >= starts and speech.epochs >= starts:
            break
    bus.publish(topics.GESTURES, Gesture(object=name), captured_ns=42)


def test_a_node_that_fails_at_once_is_heard_to_say_why(start: Start, bus: Bus) -> None:
    process = start("{greeting: farewell}")
    assert _wait_for_state(bus, NodeStatus.STATE_FAILED).detail == "nothing to greet with"
    assert process.wait(60) == 66


def test_a_node_hears_says_and_ends_on_a_signal(start: Start, bus: Bus) -> None:
    for starts, number in enumerate((signal.SIGTERM, signal.SIGINT), start=1):
        process = start("{greeting: good morning}")
        assert _wait_for_state(bus, NodeStatus.STATE_READY).detail == "good morning"
        _say(bus, "red", starts)
        heard = next(bus.events(topics.SPEECH))
        assert (heard.message.text, heard.captured_ns) == ("red", 42)
        process.send_signal(number)
        assert _wait_for_state(bus, NodeStatus.STATE_STOPPED).detail == "stopped on request"
        assert process.wait(60) == 0


def test_an_exception_is_said_logged_and_ends_with_70(start: Start, bus: Bus) -> None:
    process = start()
    _say(bus, "trouble")
    said = _wait_for_state(bus, NodeStatus.STATE_FAILED).detail
    assert said == "ValueError: found trouble (over gestures, sequence 1)"
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 70
    assert "Traceback" in errors
    assert 'raise ValueError("found trouble")' in errors


@pytest.mark.parametrize(("which", "code"), [("missing", 66), ("wrong", 78)])
def test_an_input_that_cannot_be_used_is_said_in_one_line_without_traceback(
    start: Start, bus: Bus, which: str, code: int
) -> None:
    process = start()
    _say(bus, which)
    assert _wait_for_state(bus, NodeStatus.STATE_FAILED).detail == f"{which}.npz cannot be used"
    _, errors = process.communicate(timeout=60)
    assert process.returncode == code
    assert "Traceback" not in errors


def test_a_node_that_gives_up_ends_with_70_and_keeps_its_last_word(start: Start, bus: Bus) -> None:
    process = start()
    _say(bus, "given up")
    assert _wait_for_state(bus, NodeStatus.STATE_FAILED).detail == "cannot go on"
    assert process.wait(60) == 70


def test_a_second_start_names_the_first(start: Start, bus: Bus) -> None:
    first = start()
    _wait_for_state(bus, NodeStatus.STATE_READY)
    second = start()
    _, errors = second.communicate(timeout=60)
    assert second.returncode == 75
    assert f"status/trivial is already published by pid {first.pid} (trivial)" in errors
    assert "Traceback" not in errors


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "node: x\nbus: {folder: /tmp/x, clok: simulated}\n",
            r"bus\.clok: extra inputs are not permitted, found 'simulated'",
        ),
        (
            "node: x\nbus: {folder: /tmp/x}\nparameters: {greting: 1}\n",
            r"parameters: greting: extra inputs are not permitted, found 1",
        ),
        ("node: [\n", r"node\.yaml:2:1"),
        ("", "the file is empty"),
    ],
)
def test_a_wrong_file_is_refused_with_the_key(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "node.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigurationError, match=message):
        read_node_file(path, Config)


def test_a_missing_or_wrong_file_ends_with_78(start: Start, tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="there is no configuration"):
        read_node_file(tmp_path / "none.yaml", Config)
    process = start("{greting: 1}")
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 78
    assert "parameters: greting" in errors
