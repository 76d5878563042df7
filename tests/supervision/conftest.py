"""A workspace of its own for each test, with the test nodes in it."""

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import pytest
from rich.console import Console

from paramove.supervision import application
from paramove.supervision.launch_file import load
from paramove.supervision.view import LineView
from paramove.workspace import Workspace

NODES = Path(__file__).parent / "nodes"
TIMEOUT_S = 120.0


def until(condition, what):
    """Looks again and again until `condition()` is true; fails with `what` after a timeout."""
    end_s = time.monotonic() + TIMEOUT_S
    pause = threading.Event()
    while not condition():
        if time.monotonic() > end_s:
            pytest.fail(f"not within {TIMEOUT_S:g} s: {what}")
        pause.wait(0.02)


class OwnWorkspace:
    """A folder with launch/ and nodes/ in which the launcher runs."""

    def __init__(self, root):
        self.root = root
        self.folders = Workspace(root, (root,))
        (root / "launch" / "overlays").mkdir(parents=True)
        shutil.copytree(NODES, root / "nodes", ignore=shutil.ignore_patterns("__pycache__"))
        self.launchers = []

    def write(self, text, name="test"):
        (self.root / "launch" / f"{name}.yaml").write_text(text)

    def load(self, *settings, overlays=None, seed=None, headless=False):
        return load(self.folders, "test", overlays, settings, seed, headless)

    def run(self, *settings, headless=False):
        """Runs in this process; returns outcome, run folder and what was shown."""
        with (self.root / "shown.txt").open("w+") as file:
            console = Console(file=file, width=200)
            outcome, folder = application.run(
                self.load(*settings, headless=headless), self.folders, lambda _: LineView(console)
            )
            file.seek(0)
            return outcome, folder, file.read()

    def start(self, *arguments, command=None, **options):
        """Starts the launcher, or a command that does, as a process of its own."""
        command = command or [sys.executable, "-m", "paramove.cli.launch", "test", *arguments]
        options = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True, **options}
        launcher = subprocess.Popen(command, cwd=self.root, **options)
        self.launchers.append(launcher)
        return launcher

    @property
    def events(self):
        """What the nodes did, in order."""
        path = self.root / "runs" / "latest" / "events.txt"
        return path.read_text().splitlines() if path.exists() else []

    @property
    def happened(self):
        """What the supervisor wrote into its log of events, in order."""
        path = self.root / "runs" / "latest" / "events.jsonl"
        return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []

    def await_happening(self, launcher, node, event):
        """Waits until the supervisor has logged `event` of `node` while the launcher lives; returns the newest."""
        found = []

        def seen():
            found[:] = [e for e in self.happened if (e.get("node"), e["event"]) == (node, event)]
            return found or launcher.poll() is not None

        until(seen, f"{node} {event}")
        assert found, launcher.communicate()[0]
        return found[-1]

    def await_event(self, event, launcher):
        """Waits until a node has written `event` while the launcher lives."""
        until(lambda: event in self.events or launcher.poll() is not None, event)
        assert event in self.events, launcher.communicate()[0]

    def processes(self):
        """Every process that has this workspace as its working directory, as pid: command."""
        found = {}
        for entry in Path("/proc").iterdir():
            if entry.name.isdigit() and int(entry.name) != os.getpid():
                try:
                    if (entry / "cwd").readlink() == self.root and (entry / "stat").read_text().split(")")[1][1] != "Z":
                        found[int(entry.name)] = (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode()
                except OSError:
                    continue  # it has just ended
        return found


@pytest.fixture
def launches(tmp_path):
    """An empty folder of launch files."""
    folder = tmp_path / "launch"
    folder.mkdir()
    return folder


@pytest.fixture
def workspace(tmp_path, monkeypatch):
    runtime = tempfile.mkdtemp(prefix="pm-", dir="/tmp")  # paths of sockets are short
    monkeypatch.setenv("XDG_RUNTIME_DIR", runtime)
    monkeypatch.delenv("PARAMOVE_DOMAIN", raising=False)
    made = OwnWorkspace(tmp_path)
    yield made
    for launcher in made.launchers:
        if launcher.poll() is None:
            launcher.kill()
        launcher.communicate()
    for pid in made.processes():
        os.kill(pid, signal.SIGKILL)
    shutil.rmtree(runtime)
