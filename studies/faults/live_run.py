"""The demo under observation while it runs in real time: its launcher, its events, and the messages on its bus."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from paramove.bus import BusSettings, Exchange, default_folder, topics
from paramove.msgs.hoap3_wire_pb2 import Hoap3State
from paramove.msgs.relocation_pb2 import RelocationStatus
from paramove.msgs.safety_state_pb2 import SafetyState
from studies.faults.kill_cases import LAUNCHER

APPLICATION = "rule_learning"
LOOK_S = 0.01
STEADY_S = {"moving": 0.4, "rest": 0.5, "holding": 0.2}
"""A phase counts after this time."""
STOP_S = 30.0

_TOPICS = (topics.WIRE_HOAP3_STATE, topics.RELOCATION_STATUS, topics.ARM_SAFETY)
OVERLAY = """\
# Made for this run: it is ended on purpose, so it is not judged; the firmware logs every frame that it plays.
after_run: null
nodes:
  simulator:
    parameters: {{firmware_log: true, pace: {pace}}}
"""


class LiveRun:
    """One launch of the rule-learning demo in real time; ended in order at the end of the `with` block.

    Args:
        workspace: Root of the workspace.
        folder: Of run folder and output; created if missing.
        domain: Of the bus, not used by anything else.
        seed: Of the world.
        pace: Simulated seconds per second, less than 1 for a machine that is too slow or too busy.

    Attributes:
        events: Of the launcher's log so far, oldest first.
        goals_done: Monotonic times in s at which a goal succeeded.
        safety: Latest state of the safety gate.
    """

    def __init__(self, workspace: Path, folder: Path, domain: str, seed: int, pace: float = 1.0) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        overlay = folder / "kills_overlay.yaml"
        overlay.write_text(OVERLAY.format(pace=pace), encoding="utf-8")
        self.domain = domain
        self.bus_folder = default_folder(domain)
        self.output = folder / "output.log"
        self.events: list[dict[str, Any]] = []
        self.goals_done: list[float] = []
        self.safety = SafetyState.STATE_UNSPECIFIED
        self._runs = folder
        self._read_to = 0
        self._exchange: Exchange | None = None
        self._playing = Hoap3State.PLAYING_NOTHING
        self._phase, self._holding = "", False
        self._since: dict[str, float] = {}
        command = [sys.executable, "-m", "paramove.cli.main", "launch", APPLICATION, "--headless", f"--seed={seed}"]
        command += ["--with=sim", "--with=real_time", f"--with={overlay}", f"--runs={folder}"]
        with self.output.open("wb") as out:
            self.process = subprocess.Popen(
                command,
                cwd=workspace,
                env=os.environ | {"PARAMOVE_DOMAIN": domain},
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    @property
    def folder(self) -> Path:
        """The run folder."""
        return (self._runs / "latest").resolve()

    @property
    def alive(self) -> bool:
        """Whether the launcher runs."""
        return self.process.poll() is None

    @property
    def last_sentence(self) -> str:
        """The last line of what the launcher wrote."""
        lines = self.output.read_text(encoding="utf-8", errors="replace").split("\n")
        return next((line.strip() for line in reversed(lines) if line.strip()), "")

    def pid_of(self, node: str) -> int | None:
        """The latest process of a node, or the launcher's."""
        if node == LAUNCHER:
            return self.process.pid
        started = [event for event in self.events if event.get("node") == node and event["event"] == "started"]
        return int(started[-1]["pid"]) if started else None

    def first(self, node: str, kinds: tuple[str, ...], after_ns: int) -> dict[str, Any] | None:
        """The first event of a node after a monotonic time."""
        for event in self.events:
            if event.get("node") == node and event["event"] in kinds and event["monotonic_ns"] >= after_ns:
                return event
        return None

    def look(self, wait_s: float = LOOK_S) -> None:
        """Take in what has happened, waiting up to `wait_s` for more."""
        self._read_events()
        if self._exchange is None and (self.bus_folder / "clock").exists():
            self._exchange = Exchange("onlooker", BusSettings(folder=self.bus_folder))
            for topic in _TOPICS:
                self._exchange.subscribe(topic)
        if self._exchange is None:
            time.sleep(wait_s)
            return
        self._exchange.wait(wait_s)
        for received in self._exchange.take(topic.name for topic in _TOPICS):
            self._take(received.topic, received.message)
        self._note_moments()

    def is_moment(self, name: str) -> bool:
        """Whether the run is in the phase `name`, for `STEADY_S` at least."""
        since = self._since.get(name)
        return since is not None and time.monotonic() - since >= STEADY_S[name]

    def end(self) -> int | None:
        """End the run in order, as Ctrl-C does, and wait; returns the exit code, None if the launcher hangs."""
        if self.alive:
            self.process.send_signal(signal.SIGCONT)
            self.process.send_signal(signal.SIGINT)
        try:
            return self.process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            return None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._exchange is not None:
            self._exchange.close()
        if self.end() is None:
            self.process.kill()
            self.process.wait()

    def _read_events(self) -> None:
        path = self._runs / "latest" / "events.jsonl"
        if not path.is_file():
            return
        with path.open("rb") as file:
            file.seek(self._read_to)
            new = file.read()
        whole = new[: new.rfind(b"\n") + 1]
        self._read_to += len(whole)
        self.events += [json.loads(line) for line in whole.splitlines()]

    def _take(self, topic: topics.Topic, message: Any) -> None:
        if topic is topics.WIRE_HOAP3_STATE:
            self._playing = message.playing
        elif topic is topics.ARM_SAFETY:
            self.safety = message.state
        elif message.state == RelocationStatus.STATE_EXECUTING:
            self._phase, self._holding = message.phase, message.holding
        elif message.state != RelocationStatus.STATE_ACCEPTED:
            self._phase = ""
            if message.state == RelocationStatus.STATE_SUCCEEDED:
                self.goals_done.append(time.monotonic())

    def _note_moments(self) -> None:
        armed = self.safety == SafetyState.STATE_ARMED
        frames = self._playing == Hoap3State.PLAYING_FRAMES
        rests = self._playing in (Hoap3State.PLAYING_HELD, Hoap3State.PLAYING_NOTHING)
        present = {
            "moving": armed and frames and self._phase == "approach",
            "holding": armed and frames and self._phase == "carry" and self._holding,
            "rest": armed and rests and bool(self.goals_done),
        }
        for name, now in present.items():
            if not now:
                self._since.pop(name, None)
            else:
                self._since.setdefault(name, time.monotonic())
