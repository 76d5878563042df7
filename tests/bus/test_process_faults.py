"""Forks, jumps of the wall clock, and folders that cannot hold a bus."""

from __future__ import annotations

import ast
import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import psutil
import pytest
import zmq

import paramove.bus
from paramove.bus import topics
from paramove.bus.bus import Bus
from paramove.bus.endpoint import BusFolderError, TopicTakenError, prepare_folder, socket_path
from paramove.bus.publisher import Publisher
from paramove.bus.settings import BusSettings
from paramove.msgs.gesture_pb2 import Gesture
from tests.bus.conftest import Wait

_FORKS = """
import os, sys
from pathlib import Path
from paramove.bus import topics
from paramove.bus.bus import Bus
from paramove.bus.settings import BusSettings
from paramove.msgs.gesture_pb2 import Gesture
with Bus("recognizer", BusSettings(folder=Path(sys.argv[1])), (topics.RULES,), (topics.GESTURES,)) as bus:
    child = os.fork()
    if child == 0:
        for use in (lambda: bus.publish(topics.GESTURES, Gesture()), lambda: next(bus.events()), lambda: bus.idle(1)):
            try:
                use()
                sys.stdout.write("worked\\n")
            except RuntimeError as error:
                sys.stdout.write(f"{error}\\n")
        bus.close()
        sys.stdout.flush()
        os._exit(0)
    os.waitpid(child, 0)
    bus.publish(topics.GESTURES, Gesture())
    sys.stdout.write(f"parent said {bus.exchange.publishers['gestures'].sequence}\\n")
"""


def test_a_child_made_by_fork_is_told_at_its_first_use_and_the_parent_goes_on(folder: Path) -> None:
    command = [sys.executable, "-W", "ignore", "-c", _FORKS, str(folder)]
    result = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert result.returncode == 0, result.stderr
    *child, parent = result.stdout.splitlines()
    assert len(child) == 3
    assert all("the bus of recognizer was made in process" in line for line in child)
    assert all("make a Bus in the new process, under another name" in line for line in child)
    assert parent == "parent said 1"


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_forked_children_of_a_node_end_by_signals_and_with_it(folder: Path, number: signal.Signals) -> None:
    config = folder / "pool.yaml"
    config.write_text(f"node: pool\nbus: {{folder: {folder}}}\n", encoding="utf-8")
    command = [sys.executable, "-W", "ignore", "-m", "tests.bus.pool_node", "--config", str(config)]
    with Bus("tester", BusSettings(folder=folder), (topics.SPEECH, topics.status("pool"))) as bus:
        node = subprocess.Popen(command, cwd=Path(__file__).parents[2], start_new_session=True)
        try:
            first, *children = map(int, next(bus.events(topics.SPEECH)).message.text.split())
            os.kill(first, number)  # one of the pool: it ends, and nothing else
            assert next(bus.events(topics.SPEECH)).message.text
            node.send_signal(number)
            assert node.wait(20) == 0
            assert not [child for child in children if psutil.pid_exists(child)]
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(node.pid, signal.SIGKILL)
            node.wait()


WALL_CLOCK = {"time.time", "time.time_ns", "time.localtime", "time.gmtime", "datetime.now", "datetime.utcnow"}


# A line of a log bears the wall clock's time too, for people.
SOURCES = [path for path in sorted(Path(paramove.bus.__file__).parent.glob("*.py")) if path.stem != "log_format"]


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.stem)
def test_no_wall_clock_is_read(path: Path) -> None:
    calls = {
        ast.unparse(node.func) for node in ast.walk(ast.parse(path.read_text("utf-8"))) if isinstance(node, ast.Call)
    }
    assert not {call for call in calls if call in WALL_CLOCK or call.endswith(("datetime.now", "clock_gettime"))}


def test_steps_of_the_wall_clock_change_nothing(folder: Path, wait: Wait, monkeypatch: pytest.MonkeyPatch) -> None:
    """The wall clock jumps an hour back and forth at every look; whoever used it would lose or repeat something."""
    jumps = iter(range(10**9))
    monkeypatch.setattr(time, "time", lambda: 1.8e9 + 3600.0 * (-1) ** next(jumps))
    monkeypatch.setattr(time, "time_ns", lambda: int(1.8e18) + 3600 * 10**9 * (-1) ** next(jumps))
    settings = BusSettings(folder=folder)
    with Bus("recognizer", settings, (), (topics.GESTURES,)) as speaker, Bus("x", settings, (topics.GESTURES,)) as bus:
        counter = bus.exchange.subscribers["gestures"]
        wait(lambda: counter.welcomed, lambda: speaker.exchange.wait(0), lambda: bus.exchange.wait(0))
        ticks = said = heard = 0
        before_ns = time.monotonic_ns()
        for event in bus.events(tick=True):
            if hasattr(event, "topic"):
                heard += 1
                assert before_ns <= event.published_ns <= time.monotonic_ns()
            else:
                ticks += 1
                speaker.publish(topics.GESTURES, Gesture())
                said += 1
            if ticks == 10 and heard >= 9:
                break
        assert counter.counter.lost == counter.counter.repeated == counter.counter.rejected.total() == 0
        assert said - heard <= 1


def test_a_folder_below_a_file_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    with pytest.raises(BusFolderError, match=r"bus folder .*/file/x: Not a directory; choose another one with \$XDG"):
        prepare_folder(tmp_path / "file" / "x")
    assert (tmp_path / "file").read_text() == "mine"


def test_a_folder_that_cannot_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Root may write anywhere, so the refusal of the kernel is played."""

    def reject(*_: Any, **__: Any) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "mkdir", reject)
    with pytest.raises(BusFolderError, match="Permission denied; choose another one"):
        prepare_folder(tmp_path / "x")


def test_a_directory_at_the_place_of_a_socket_is_left_alone(context: zmq.Context[Any], folder: Path) -> None:
    (folder / "gestures").mkdir()
    with pytest.raises(BusFolderError, match="is not a socket; it is not touched, move it away"):
        Publisher(context, folder, topics.GESTURES, "recognizer")
    assert (folder / "gestures").is_dir()


def test_a_link_at_the_place_of_a_lock_is_not_followed(context: zmq.Context[Any], folder: Path, tmp_path: Path) -> None:
    target = tmp_path / "precious"
    target.write_text("mine")
    (folder / "gestures.lock").symlink_to(target)
    with pytest.raises(BusFolderError, match=r"lock .*gestures\.lock: .*; remove it and start again"):
        Publisher(context, folder, topics.GESTURES, "recognizer")
    assert target.read_text() == "mine"


_STEALS = """
import sys, zmq
from pathlib import Path
from paramove.bus import topics
from paramove.bus.endpoint import TopicTakenError
from paramove.bus.publisher import Publisher
try:
    Publisher(zmq.Context(), Path(sys.argv[1]), topics.GESTURES, "thief")
except TopicTakenError as error:
    sys.stdout.write(str(error))
"""


def test_an_endpoint_is_not_stolen_even_if_its_socket_file_was_removed(context: zmq.Context[Any], folder: Path) -> None:
    publisher = Publisher(context, folder, topics.GESTURES, "recognizer")
    socket_path(folder, "gestures").unlink()
    result = subprocess.run([sys.executable, "-c", _STEALS, str(folder)], capture_output=True, text=True, timeout=60)
    assert "gestures is already published by pid" in result.stdout
    assert "(recognizer); a topic has one publisher" in result.stdout
    with pytest.raises(TopicTakenError):
        Publisher(context, folder, topics.GESTURES, "thief")
    publisher.close()
