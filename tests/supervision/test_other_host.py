"""The launcher's end of another host, and the agent's: whatever comes, nothing but silence or an end ends a run."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from paramove.documents import InputError
from paramove.supervision.channel import Channel
from paramove.supervision.launch_schema import HostSettings, LaunchFile
from paramove.supervision.messages import ABOUTS, FROM_AGENT, Alive, Begin, Log, Ready, Rejected, Start, Started
from paramove.supervision.processes import last_lines
from paramove.supervision.remote_host import RemoteHost, ask_host
from paramove.supervision.run_folder import RunFolder
from tests.supervision.conftest import until

SETTINGS = HostSettings(ssh="other")
SHOUTS = """
import sys, time
while True:
    print("x" * 4096, flush=True)
    time.sleep(0.005)
"""


def begin(release="1", **nodes):
    file = {
        "hosts": {"here": {}, "there": {"ssh": "other"}},
        "nodes": nodes or {"far": {"module": "nodes.a", "host": "there"}},
    }
    return Begin(
        launch=LaunchFile.model_validate(file),
        name="test",
        domain="test",
        clock=None,
        launcher="here",
        release=release,
        host="there",
    )


class FalseAgent:
    """What the test sends is what the launcher gets from ssh."""

    def __init__(self, folder, monkeypatch):
        pipe = folder / "agent"
        os.mkfifo(pipe)
        self.descriptor = os.open(pipe, os.O_RDWR)
        monkeypatch.setenv("PARAMOVE_SSH", f"sh -c 'cat {pipe} & exec cat > /dev/null' --")
        self.run_folder = RunFolder(folder / "run")
        self.run_folder.logs.mkdir(parents=True)

    def send(self, *lines):
        for line in lines:
            os.write(self.descriptor, (line if isinstance(line, bytes) else line.line()) + b"\n")

    def connected(self):
        return RemoteHost(SETTINGS, begin(), self.run_folder)

    def close(self):
        os.close(self.descriptor)


@pytest.fixture
def agent(tmp_path, monkeypatch):
    made = FalseAgent(tmp_path, monkeypatch)
    yield made
    made.close()


@pytest.mark.parametrize(
    "line",
    [
        b"[" * 100_000,
        b'{"kind": ["log"], "node": "far", "text": ""}',
        b'{"kind": "started"}',
        b'{"kind": "started", "node": "far", "pid": -1}',
        b'{"kind": "log", "node": "../../evil", "text": "x"}',
        b'{"kind": "log", "node": "near", "text": "x"}',
        b'{"kind": "ended", "node": {"far": 1}, "code": 0}',
        b'{"kind": "ended", "node": "far", "code": "0"}',
        b'{"kind": "ended", "node": "far", "code": 1e999}',
        b'{"kind": "halted", "node": "far", "is_halted": null}',
        b'{"kind": "alive", "more": 1}',
        b"[1, 2]",
        b"3",
        b"\xff\xfe",
        b"\x1b[2JSUCCESS",
        b"x" * 1_500_000,
    ],
)
def test_what_is_no_message_is_named_and_ends_nothing(agent, tmp_path, line):
    agent.send(Alive(), Ready(folder="there"))
    host = agent.connected()
    before = sorted(tmp_path.rglob("*"))
    sent = memoryview(line + b"\n")
    os.set_blocking(agent.descriptor, False)
    while sent:
        with contextlib.suppress(BlockingIOError):
            sent = sent[os.write(agent.descriptor, sent) :]
        host.serve()
    until(lambda: host.serve() or host.problems, "it is named")
    agent.send(Alive())
    host.serve()
    assert not host.lost
    assert all(problem.isprintable() for problem in host.problems)
    assert sorted(tmp_path.rglob("*")) == before
    host.close()


def test_texts_of_another_host_are_printable_where_they_are_read(agent):
    agent.send(Alive(), Ready(folder="there"))
    host = agent.connected()
    agent.send(b'{"kind": "started", "node": "far", "pid": 77}')
    host.start("far")
    agent.send(b'{"kind": "log", "node": "far", "text": "one\\n\\u001b]0;title\\u0007\\u001b[2Jtwo\\n"}')
    path = agent.run_folder.log("far")
    until(lambda: host.serve() or path.exists(), "the log comes")
    assert path.read_text().splitlines() == ["one", r"\x1b]0;title\x07\x1b[2Jtwo"]
    host.close()


def test_a_rejection_is_printable(agent):
    agent.send(Alive(), b'{"kind": "rejected", "reason": "\\u001b[2J\\u001b[32mSUCCESS"}')
    with pytest.raises(InputError, match="SUCCESS") as raised:
        agent.connected()
    assert str(raised.value).isprintable()


def test_a_greeting_is_skipped_whether_or_not_it_ends_its_line(agent):
    agent.send(b"Welcome to robot-pc!", b"\x1b]0;robot-pc\x07$ \n" + Alive().line(), Ready(folder="there"))
    host = agent.connected()
    assert (host.lost, host.problems) == ("", [])
    host.close()


def test_an_agent_that_cannot_start_is_named_with_what_was_printed(tmp_path, monkeypatch):
    monkeypatch.setenv("PARAMOVE_SSH", "sh -c 'echo Welcome to robot-pc!; echo no such program >&2; exit 127' --")
    folder = RunFolder(tmp_path)
    folder.logs.mkdir()
    with pytest.raises(InputError) as raised:
        RemoteHost(SETTINGS, begin(), folder)
    for fact in ("Welcome to robot-pc!", "no such program"):
        assert fact in str(raised.value)
    with pytest.raises(InputError, match="no such program"):
        ask_host(SETTINGS, "about")
    monkeypatch.setenv("PARAMOVE_SSH", "sh -c 'printf \"\\xff Welcome\\n\"' --")
    with pytest.raises(InputError, match="Welcome"):
        ask_host(SETTINGS, "about")


@pytest.mark.parametrize("program", ["/nowhere/ssh", "'"])
def test_an_ssh_that_cannot_be_started_is_named(monkeypatch, program):
    monkeypatch.setenv("PARAMOVE_SSH", program)
    with pytest.raises(InputError, match="PARAMOVE_SSH"):
        ask_host(SETTINGS, "about")


class OwnAgent:
    """A real agent, and the launcher's end of its connection."""

    def __init__(self, root):
        command = [sys.executable, "-m", "paramove.cli.main", "host"]
        answer = subprocess.run([*command, "about"], cwd=root, capture_output=True, check=True)
        self.release = ABOUTS.read(answer.stdout.strip()).release
        self.process = subprocess.Popen([*command, "agent"], cwd=root, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.channel = Channel(self.process.stdout.fileno(), self.process.stdin.fileno(), FROM_AGENT)

    def expect(self, kind):
        found = []

        def comes():
            found.extend(message for message in self.channel.read() if isinstance(message, kind))
            return found or self.channel.ended

        until(comes, kind.__name__)
        return found[0]


@pytest.fixture
def own_agent(workspace, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    (workspace.root / "nodes" / "shouts.py").write_text(SHOUTS)
    made = OwnAgent(workspace.root)
    yield made
    made.process.kill()
    made.process.communicate()


def test_nodes_end_by_the_clock_of_their_host_when_the_launcher_takes_nothing(own_agent):
    own_agent.expect(Alive)
    own_agent.channel.send(begin(own_agent.release, far={"module": "nodes.shouts", "host": "there"}))
    own_agent.expect(Ready)
    own_agent.channel.send(Start(node="far"))
    pid = own_agent.expect(Started).pid
    own_agent.channel.send(Alive())
    stopped_s = time.monotonic()  # from here on nothing is read or sent: a launcher that is stopped
    until(lambda: not Path(f"/proc/{pid}").exists(), "the node ends")
    assert time.monotonic() - stopped_s < 6.0


def test_output_of_a_node_comes_whole_though_the_launcher_is_slow(own_agent):
    own_agent.expect(Alive)
    own_agent.channel.send(begin(own_agent.release, far={"module": "nodes.shouts", "host": "there"}))
    own_agent.expect(Ready)
    own_agent.channel.send(Start(node="far"))
    received = ""
    while len(received) < 1_000_000:
        own_agent.channel.send(Alive())
        received += own_agent.expect(Log).text
    assert set(received.strip().splitlines()[:-1]) == {"x" * 4096}


@pytest.mark.parametrize("line", [b"[" * 1000, b'{"kind": "start", "node": "far"}', b'{"kind": "begin"}', b"\xff"])
def test_an_agent_that_gets_no_run_rejects_it(own_agent, line):
    own_agent.expect(Alive)
    own_agent.process.stdin.write(line + b"\n")
    own_agent.process.stdin.flush()
    assert own_agent.expect(Rejected).reason
    until(lambda: own_agent.process.poll() is not None, "it ends")
    assert own_agent.process.returncode == 1
    assert last_lines(Path("/dev/null"), 1) == []
