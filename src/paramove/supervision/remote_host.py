"""Nodes on another host: processes that its agent starts, ends and watches."""

from __future__ import annotations

import contextlib
import json
import select
import subprocess
import time
from collections.abc import Callable
from typing import Any

from paramove.documents import InputError
from paramove.supervision.agent import ALIVE_S, SILENT_S, Lines
from paramove.supervision.distribution import ssh_command
from paramove.supervision.launch_schema import HostSettings
from paramove.supervision.run_folder import RunFolder

BEGIN_S = 60.0
"""For ssh, and for the agent to begin: a first start reads the whole installation from a slow disk."""
START_S = 10.0
LOST = 255
"""Exit code of a node whose host can no longer be reached, as ssh has it."""


class RemoteHost:
    """The launcher's end of an agent, until `close`. Waits for the agent to be ready.

    Args:
        name: Of the host in the launch file.
        settings: How it is reached.
        begin: The first line to the agent: see `agent.py`.
        folder: Of the run here; the output of the nodes there is appended to its logs.

    Raises:
        InputError: It is not reached, or rejects the run.

    Attributes:
        lost: Why it is not connected; "" while it is.
    """

    def __init__(self, name: str, settings: HostSettings, begin: dict[str, Any], folder: RunFolder) -> None:
        self.name, self.lost = name, ""
        self._folder = folder
        self._processes: dict[str, RemoteProcess] = {}
        self._failed: dict[str, str] = {}
        self._answers: dict[str, str] = {}
        with folder.log(f"agent_{name}").open("ab") as log:
            self._process = subprocess.Popen(
                ssh_command(settings, "host", "agent"),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                start_new_session=True,  # Ctrl-C is for the launcher alone
            )
        assert self._process.stdout is not None
        self._lines = Lines(self._process.stdout.fileno())
        self._latest_s = self._alive_due_s = time.monotonic()
        self._begin: dict[str, Any] | None = {**begin, "host": name}
        self._serve_until(lambda: "ready" in self._answers, BEGIN_S)
        if "ready" not in self._answers:
            self.close()
            why = self._answers.get("rejected") or self.lost or f"no answer within {BEGIN_S:g} s"
            raise InputError(f"{name} ({settings.ssh}) does not take part: {why}; see {folder.log(f'agent_{name}')}")

    @property
    def descriptor(self) -> int:
        """Readable when the agent has reported something."""
        return self._lines.descriptor

    def serve(self) -> None:
        """Reads what the agent has reported, and shows it that the launcher is alive; to be called often."""
        now_s = time.monotonic()
        for line in self._lines.read():
            self._latest_s = now_s
            self._take(line)
        if self._lines.ended:
            self.lost = self.lost or "its agent has ended"
        elif "ready" in self._answers and now_s - self._latest_s > SILENT_S:
            self.lost = self.lost or f"it is silent for {SILENT_S:g} s"
        if self._begin is None and not self.lost and now_s >= self._alive_due_s:
            self._alive_due_s = now_s + ALIVE_S
            self.send()

    def start(self, node: str) -> RemoteProcess:
        """Starts a node's process there. Raises OSError if that fails."""
        self._processes.pop(node, None)
        self._failed.pop(node, None)
        self.send(start=node)
        self._serve_until(lambda: node in self._processes or node in self._failed, START_S)
        if node not in self._processes:
            why = self._failed.get(node) or self.lost or f"no answer within {START_S:g} s"
            raise OSError(0, f"{self.name}: {why}")
        return self._processes[node]

    def _serve_until(self, is_answered: Callable[[], bool], timeout_s: float) -> None:
        end_s = time.monotonic() + timeout_s
        while not (is_answered() or self.lost) and time.monotonic() < end_s:
            select.select([self.descriptor], [], [], ALIVE_S)
            self.serve()

    def send(self, **content: Any) -> None:
        """Sends one line."""
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):  # `serve` notices that it has gone
            self._process.stdin.write(json.dumps(content).encode() + b"\n")
            self._process.stdin.flush()

    def close(self) -> None:
        """Ends the agent, which ends what is left there."""
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):
            self._process.stdin.close()
        try:
            self._process.wait(timeout=SILENT_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _take(self, line: dict[str, Any]) -> None:
        if self._begin is not None:  # not before the agent reads: the age would have grown
            age_ns = time.monotonic_ns() - self._folder.begun_ns
            self.send(begin={**self._begin, "age_ns": age_ns})
            self._begin = None
        for word in ("ready", "rejected"):
            if word in line:
                self._answers[word] = str(line[word])
        if "started" in line:
            self._processes[line["started"]] = RemoteProcess(self, line["started"], int(line["pid"]))
        if "failed" in line:
            self._failed[line["failed"]] = str(line["reason"])
        if (name := line.get("log")) in self._processes:
            with self._folder.log(name).open("a", encoding="utf-8") as file:
                file.write(str(line["text"]))
        process = self._processes.get(line.get("ended", line.get("halted", "")))
        if process is not None and "ended" in line:
            process.code = int(line["code"])
        elif process is not None:
            process.is_halted = bool(line["is"])


class RemoteProcess:
    """A node's process on another host. Its methods are those of `SupervisedProcess`.

    Attributes:
        pid: Of the process there.
        descriptor: Readable as soon as its agent has reported something.
        code: Exit code that the agent has reported; None before.
        is_halted: Whether the agent has reported since the last call of `halted` that it was stopped, or continued.
    """

    def __init__(self, host: RemoteHost, node: str, pid: int) -> None:
        self.pid, self.descriptor = pid, host.descriptor
        self.code: int | None = None
        self.is_halted: bool | None = None
        self._host, self._node = host, node

    def ended(self) -> int | None:
        """Exit code once the process has ended, or is lost with its host, else None."""
        return LOST if self.code is None and self._host.lost else self.code

    def halted(self) -> bool | None:
        """See `SupervisedProcess.halted`."""
        halted, self.is_halted = self.is_halted, None
        return halted

    def memory_mb(self) -> float:
        """Is not measured from here."""
        return 0.0

    def terminate(self) -> None:
        """See `SupervisedProcess.terminate`."""
        self._host.send(end=self._node)

    def kill(self) -> None:
        """See `SupervisedProcess.kill`."""
        self._host.send(kill=self._node)
