"""One run on two hosts: the launcher's, and another one that it reaches by ssh (a stand-in, and another folder)."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
import zmq

from paramove.hosts import HostKeys
from tests.hosts.conftest import free_ports
from tests.supervision.conftest import OwnWorkspace, until

STAND_IN = Path(__file__).parent / "ssh_stand_in.py"
RELAY = Path(__file__).parents[2] / "nodes" / "relay.py"
PARAMOVE = f"{sys.executable} -m paramove.cli.main"
FILE = """
bus: {{clock: simulated, lockstep: true}}
hosts:
  here: {{address: 127.0.0.1, port: {here}}}
  there: {{ssh: other, address: 127.0.0.1, port: {there}, folder: {folder}, command: {command}}}
nodes:
  world: {{module: nodes.world, truth: true}}
  far: {{module: nodes.silent_actor, host: there, after: [world], parameters: {{child: true}}}}
  near: {{module: nodes.silent_actor, after: [far]}}
"""


class TwoHosts:
    def __init__(self, workspace, runtime, tmp_path, monkeypatch):
        self.here = workspace
        shutil.copy(RELAY, workspace.root / "nodes")
        self.there = OwnWorkspace(tmp_path / "there")
        shutil.copy(RELAY, self.there.root / "nodes")
        config = {"XDG_RUNTIME_DIR": runtime, "XDG_CONFIG_HOME": str(tmp_path / "config_there")}
        (tmp_path / "environment.json").write_text(json.dumps(config))
        monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config_here"))
        monkeypatch.setenv("PARAMOVE_SSH", f"{sys.executable} {STAND_IN} {tmp_path / 'environment.json'}")
        self.keys = HostKeys(tmp_path / "config_here" / "paramove" / "hosts")
        text = FILE.format(here=free_ports(), there=free_ports(), folder=self.there.root, command=PARAMOVE)
        for one in (self.here, self.there):
            one.write(text)

    def host(self, *words):
        return subprocess.run(
            [*PARAMOVE.split(), "host", *words, "other", "--folder", str(self.there.root), "--command", PARAMOVE],
            cwd=self.here.root,
            capture_output=True,
            text=True,
            check=False,
        )

    def processes(self):
        """Of both hosts but the stand-ins."""
        found = {**self.here.processes(), **self.there.processes()}
        return {pid: line for pid, line in found.items() if STAND_IN.name not in line}

    def stand_in(self):
        return next(pid for pid, line in self.here.processes().items() if STAND_IN.name in line)


@pytest.fixture
def two_hosts(workspace, tmp_path, monkeypatch):
    runtime = tempfile.mkdtemp(prefix="pm-", dir="/tmp")
    hosts = TwoHosts(workspace, runtime, tmp_path, monkeypatch)
    yield hosts
    for pid in hosts.there.processes():
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    shutil.rmtree(runtime)


def shown_by(launcher):
    """All that a launcher has printed when it has ended."""
    until(lambda: launcher.poll() is not None, "the launcher ends")
    return launcher.stdout.read()


@pytest.fixture
def running(two_hosts):
    """A run in which all nodes are ready."""
    trusted = two_hosts.host("trust")
    assert trusted.returncode == 0, trusted.stderr
    launcher = two_hosts.here.start("--headless")
    two_hosts.here.await_happening(launcher, "near", "ready")
    return two_hosts, launcher


def test_nodes_run_where_the_launch_file_assigns_them_and_end_in_order(running):
    hosts, launcher = running
    far = hosts.here.await_happening(launcher, "far", "ready")
    assert hosts.there.processes()[far["pid"]]
    assert hosts.there.events == ["far started", "far ready"]
    launcher.send_signal(signal.SIGINT)
    shown = shown_by(launcher)
    assert launcher.returncode == 130, shown
    ended = [event["node"] for event in hosts.here.happened if event["event"] == "ended"]
    assert ended[:3] == ["near", "far", "world"]
    assert sorted(ended[3:]) == ["relay_here", "relay_there"]
    assert all(event["exit_code"] == 0 for event in hosts.here.happened if event["event"] == "ended")
    assert "ready" in (hosts.here.root / "runs" / "latest" / "logs" / "relay_there.log").read_text()
    until(lambda: not hosts.processes(), "nothing is left")


@pytest.mark.parametrize("how", ["cut", "silent", "launcher killed"])
def test_where_the_connection_ends_everything_ends_on_both_hosts(running, how):
    hosts, launcher = running
    victim, number = {
        "cut": (hosts.stand_in, signal.SIGKILL),
        "silent": (hosts.stand_in, signal.SIGSTOP),
        "launcher killed": (lambda: launcher.pid, signal.SIGKILL),
    }[how]
    pid = victim()
    os.kill(pid, number)
    shown = shown_by(launcher)
    until(lambda: not hosts.processes(), "nothing is left")
    if how != "launcher killed":
        assert launcher.returncode == 1, shown
        assert "the connection to there is lost" in shown


def test_a_killed_agent_leaves_nothing_and_ends_the_run(running):
    hosts, launcher = running
    agent = next(pid for pid, line in hosts.there.processes().items() if line.startswith(sys.executable))
    os.kill(agent, signal.SIGKILL)
    shown_by(launcher)
    assert launcher.returncode == 1
    until(lambda: not hosts.processes(), "nothing is left")


@pytest.mark.parametrize("node", ["far", "relay_there", "relay_here"])
def test_a_killed_node_there_is_reported_as_one_here(running, node):
    hosts, launcher = running
    pid = hosts.here.await_happening(launcher, node, "ready")["pid"]
    os.kill(pid, signal.SIGKILL)
    shown = shown_by(launcher)
    assert launcher.returncode == 1, shown
    assert f"{node} was killed (SIGKILL)" in shown
    until(lambda: not hosts.processes(), "nothing is left")


def test_another_release_is_rejected_naming_both(two_hosts):
    assert two_hosts.host("trust").returncode == 0
    with (two_hosts.there.root / "nodes" / "world.py").open("a") as file:
        file.write("# changed\n")
    checked = two_hosts.host("check")
    assert checked.returncode == 78
    launcher = two_hosts.here.start("--headless")
    shown = shown_by(launcher)
    assert launcher.returncode == 78
    for text in (checked.stderr, shown):
        assert text.count("workspace ") == 2, text
    assert not two_hosts.processes()


def test_a_host_is_trusted_once_and_a_changed_key_is_rejected(two_hosts):
    launcher = two_hosts.here.start("--headless")
    assert "paramove host trust other" in shown_by(launcher)
    assert launcher.returncode == 78
    assert "now trusted" in two_hosts.host("trust").stdout
    assert "still trusted" in two_hosts.host("trust").stdout
    assert two_hosts.host("check").returncode == 0
    pinned = two_hosts.keys.trusted()["other"]
    (two_hosts.keys.folder / "trusted").write_text(f"other {'0' * 40}\n")
    for words in ("trust", "check"):
        rejected = two_hosts.host(words)
        assert rejected.returncode == 78
        assert pinned in rejected.stderr
        assert "0" * 40 in rejected.stderr


def test_a_greeting_changes_nothing(two_hosts, tmp_path, monkeypatch):
    greeting = tmp_path / "ssh"
    rest = os.environ["PARAMOVE_SSH"]
    greeting.write_text(f'#!/bin/sh\necho "{"*" * 40}"\nprintf "Welcome $ "\nexec {rest} "$@"\n')
    greeting.chmod(0o755)
    monkeypatch.setenv("PARAMOVE_SSH", str(greeting))
    for words in ("trust", "check"):
        done = two_hosts.host(words)
        assert done.returncode == 0, done.stderr
    assert two_hosts.keys.trusted()["other"] != "*" * 40
    launcher = two_hosts.here.start("--headless")
    two_hosts.here.await_happening(launcher, "near", "ready")
    launcher.send_signal(signal.SIGINT)
    assert "Welcome" not in shown_by(launcher)
    assert launcher.returncode == 130


def test_a_key_that_begins_like_an_option_is_a_key(two_hosts):
    public = ""
    while not public.startswith("-"):
        public, secret = (key.decode() for key in zmq.curve_keypair())
    two_hosts.keys.own()
    (two_hosts.keys.folder / "own.key").write_text(f"{public}\n{secret}\n")
    trusted = two_hosts.host("trust")
    assert trusted.returncode == 0, trusted.stderr
