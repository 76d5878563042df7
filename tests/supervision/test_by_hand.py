"""One node of a running application stopped, started, restarted by hand."""

import contextlib
import json
import os
import signal
import socket
from pathlib import Path

import pytest
from typer.testing import CliRunner

from paramove.cli.main import build
from paramove.documents import MessageReader, exit_codes
from paramove.supervision.control import MOST_CLIENTS, ControlServer, NoRunError, ask
from paramove.supervision.messages import Answer, Request

THREE = """
nodes:
  camera: {module: nodes.silent_actor, restart: on-failure}
  arm: {module: nodes.silent_actor, restart: on-failure, restart_ends_run: true}
  main: {module: nodes.silent_actor}
"""


def node(*arguments):
    return CliRunner().invoke(build("node"), ["node", *arguments])


def rows():
    return {row["node"]: row for row in json.loads(node("list", "--json").stdout)}


@pytest.fixture
def launcher(workspace):
    workspace.write(THREE)
    started = workspace.start()
    for name in ("camera", "arm", "main"):
        workspace.await_happening(started, name, "ready")
    return started


def test_node_is_stopped_and_started_and_the_run_goes_on(workspace, launcher):
    pid = rows()["camera"]["pid"]
    done = node("stop", "camera")
    assert done.exit_code == 0, done.output
    assert done.output.startswith("camera is stopped: by hand, ")
    row = rows()["camera"]
    assert (row["state"], row["pid"], row["last_end"]) == ("stopped", None, "was stopped by hand")
    again = node("stop", "camera")
    assert again.exit_code == 1
    assert again.output == "camera is not running (stopped)\n"
    done = node("start", "camera")
    assert done.output == "camera is ready: all set\n"
    row = rows()["camera"]
    assert row["pid"] not in (None, pid)
    assert row["restarts"] == 1
    assert launcher.poll() is None


def test_node_is_restarted(workspace, launcher):
    pid = rows()["camera"]["pid"]
    done = node("restart", "camera")
    assert done.exit_code == 0, done.output
    assert done.output == "camera is ready: all set\n"
    row = rows()["camera"]
    assert row["pid"] != pid
    assert row["last_end"] == "was restarted by hand"
    assert workspace.events.count("camera ended") == 1  # in order, not killed


def test_list_keeps_the_reason_of_an_end(workspace, launcher):
    first = rows()["camera"]["pid"]
    os.kill(first, signal.SIGKILL)
    workspace.await_happening(launcher, "camera", "ended")
    assert rows()["camera"]["last_end"] == "was killed (SIGKILL); restart 1 in 0.5 s"
    assert "was killed (SIGKILL)" in node("list").stdout


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("restart", "camra"), "there is no node 'camra'; did you mean 'camera'?"),
        (("stop", "lamp"), "there is no node 'lamp'; there are: arm, camera, main"),
        (("start", "camera"), "camera is already running (ready)"),
        (("restart", "main"), "main cannot continue in a new process (restart: never in the launch file); end the run"),
    ],
)
def test_what_cannot_be_done_is_refused_with_the_reason(launcher, arguments, told):
    done = node(*arguments)
    assert done.exit_code == 1
    assert told in done.output
    assert launcher.poll() is None


def test_run_ends_with_a_required_node_that_cannot_be_started_again(launcher):
    done = node("stop", "main")
    assert done.exit_code in (0, 1), done.output
    shown = launcher.communicate(timeout=60)[0]
    assert launcher.returncode == exit_codes.FAILURE
    assert "main was stopped by hand; the run cannot continue without it" in shown


def test_run_ends_after_the_restart_of_a_node_that_must_not_go_on(launcher):
    node("restart", "arm")
    shown = launcher.communicate(timeout=60)[0]
    assert launcher.returncode == exit_codes.FAILURE
    assert "arm was restarted by hand and is back: all set; the run has ended" in shown


def test_nothing_runs(workspace):
    assert node("stop", "camera").exit_code == 1
    folder = Path(os.environ["XDG_RUNTIME_DIR"]) / "paramove" / "default"
    folder.mkdir(parents=True, mode=0o700)
    done = node("stop", "camera")
    assert done.exit_code == 1
    assert f"no application is running at {folder}" in done.output


@pytest.fixture
def server(workspace):
    with ControlServer(
        Path(os.environ["XDG_RUNTIME_DIR"]), lambda request: Answer(ok=True, sentence=request.do)
    ) as made:
        yield made


def connected():
    client = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    client.settimeout(60)
    client.connect(str(Path(os.environ["XDG_RUNTIME_DIR"]) / "control"))
    return client


@pytest.mark.parametrize(
    "sent",
    [
        b"no json\n",
        b"[1, 2]\n",
        b"\xff\xfe\n",
        b"3\n",
        b"[" * 4000 + b"\n",
        b'{"do": ["list"]}\n',
        b'{"do": {}}\n',
        b'{"do": "end"}\n',
        b'{"do": "stop", "node": {"a": 1}}\n',
        b'{"do": "stop", "node": "../camera"}\n',
        b'{"do": "list", "more": 1}\n',
        b"x" * 10_000,
    ],
)
def test_what_is_no_request_is_told_so(server, sent):
    with connected() as client:
        client.sendall(sent)
        server.serve()
        answer = json.loads(client.makefile().readline())
        assert not answer["ok"]
        assert answer["sentence"].isprintable()
    server.serve()
    assert len(server.descriptors) == 1


def test_of_many_requests_at_once_only_the_first_is_parsed(server, monkeypatch):
    parsed, read = [], MessageReader.read
    monkeypatch.setattr(MessageReader, "read", lambda reader, line: (parsed.append(line), read(reader, line))[1])
    with connected() as client:
        client.sendall(b'{"do": "list"}\n' * 40)
        server.serve()
        assert json.loads(client.recv(4096))["ok"]
    assert len(parsed) == 1


def test_more_clients_than_needed_are_disconnected(server):
    with contextlib.ExitStack() as opened:
        for _ in range(100):
            opened.enter_context(connected())
            server.serve()
        assert len(server.descriptors) == MOST_CLIENTS + 1


def test_request_may_come_in_pieces_and_too_long_a_one_is_hung_up_on(server):
    with connected() as client, connected() as flood:
        client.sendall(b'{"do": ')
        flood.sendall(b"x" * 10_000)
        for _ in range(3):
            server.serve()
        client.sendall(b'"list"}\n')
        server.serve()
        assert json.loads(client.recv(4096)) == {"ok": True, "sentence": "list", "nodes": []}
        assert not json.loads(flood.recv(4096))["ok"]
        assert len(server.descriptors) == 1


def test_socket_is_private_and_gone_afterwards(workspace):
    folder = Path(os.environ["XDG_RUNTIME_DIR"])
    with ControlServer(folder, lambda _: Answer(ok=True, sentence="")):
        assert (folder / "control").stat().st_mode & 0o777 == 0o600
    with pytest.raises(NoRunError, match="start one with `paramove launch`"):
        ask(folder, Request(do="list"))
