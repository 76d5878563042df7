"""Nodes on another host: processes that its agent starts, ends and watches."""

from __future__ import annotations

import contextlib
import os
import select
import subprocess
import time
from collections.abc import Callable
from typing import Any

from paramove.bus import is_logged
from paramove.documents import InputError, MessageError, printable
from paramove.supervision.agent import ALIVE_S, SILENT_S
from paramove.supervision.channel import Channel
from paramove.supervision.distribution import ssh_command
from paramove.supervision.launch_schema import HostSettings
from paramove.supervision.messages import (
    ABOUTS,
    FROM_AGENT,
    About,
    Alive,
    Begin,
    End,
    Ended,
    Failed,
    Halted,
    Kill,
    Log,
    Ready,
    Rejected,
    Start,
    Started,
)
from paramove.supervision.processes import last_lines
from paramove.supervision.run_folder import RunFolder

BEGIN_S = 60.0
"""For ssh, and for the agent to begin: a first start reads the whole installation from a slow disk."""
START_S = 10.0
LOST = 255
"""Exit code of a node whose host can no longer be reached, as ssh has it."""
_MOST_ERRORS = 20_000
"""Bytes of what ssh prints that are kept."""


def connected(settings: HostSettings, *words: str, **options: Any) -> subprocess.Popen[bytes]:
    """Starts a command of paramove on a host by ssh; raises InputError if ssh itself cannot be started."""
    command = ssh_command(settings, *words)
    try:
        return subprocess.Popen(command, stdout=subprocess.PIPE, start_new_session=True, **options)
    except OSError as error:
        raise InputError(
            f"{command[0]} cannot be started: {error.strerror}; install ssh, or correct PARAMOVE_SSH"
        ) from error


def ask_host(settings: HostSettings, *words: str) -> About:
    """What `paramove host WORDS` answers there. Lines that a shell's start-up file prints are skipped.

    Raises InputError with what ssh, or paramove there, prints.
    """
    process = connected(settings, "host", *words, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE)
    assert process.stdout is not None
    assert process.stderr is not None
    channel = Channel(process.stdout.fileno(), None, ABOUTS)
    about: About | None = None
    other, errors = "", b""
    until_s = time.monotonic() + BEGIN_S
    with process:
        os.set_blocking(process.stderr.fileno(), False)
        while True:
            has_ended = process.poll() is not None
            for found in channel.read():
                if isinstance(found, About):
                    about = found
                else:
                    other = other or found.content
            with contextlib.suppress(BlockingIOError):
                errors = (errors + os.read(process.stderr.fileno(), _MOST_ERRORS))[-_MOST_ERRORS:]
            if has_ended:
                break
            if time.monotonic() > until_s:
                process.kill()
                raise InputError(f"{settings.ssh} gives no answer within {BEGIN_S:g} s: check network and ssh")
            select.select([channel.descriptor], [], [], ALIVE_S) if not channel.ended else process.wait()
    if process.returncode:
        lines = [line.strip(" │") for line in errors.decode("utf-8", "replace").splitlines()]
        printed = [printable(line) for line in lines if any(map(str.isalnum, line))]
        raise InputError(f"{settings.ssh}: {printed[-1] if printed else f'exit code {process.returncode}'}")
    if about is None:
        found_there = f"but prints {other!r}" if other else "and prints nothing"
        raise InputError(
            f"{settings.ssh} does not answer as this release does, {found_there}. Install the same on both"
        )
    return about


class RemoteHost:
    """The launcher's end of an agent, until `close`. Waits for the agent to be ready.

    What comes is checked against `messages.py` and against the nodes that run there; all else is counted, and nothing
    of it ends the run: only an agent that ends, or is silent, does.

    Args:
        settings: How it is reached.
        begin: The run, and the host's name in it.
        folder: Of the run here; the output of the nodes there is appended to its logs.

    Raises:
        InputError: It is not reached, or rejects the run.

    Attributes:
        lost: Why it is not connected; "" while it is.
        problems: What is to be shown to a person; the caller removes it.
    """

    def __init__(self, settings: HostSettings, begin: Begin, folder: RunFolder) -> None:
        self.name, self.lost = begin.host, ""
        self.problems: list[str] = []
        self._folder = folder
        self._nodes = frozenset(name for name, node in begin.launch.nodes.items() if node.host == begin.host)
        self._processes: dict[str, RemoteProcess] = {}
        self._starting = self._failed = self._rejection = self._greeting = ""
        self._is_ready = False
        self._unreadable = 0
        with folder.log(f"agent_{self.name}").open("ab") as log:
            self._process = connected(settings, "host", "agent", stdin=subprocess.PIPE, stderr=log)
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._channel: Channel[Any] = Channel(self._process.stdout.fileno(), self._process.stdin.fileno(), FROM_AGENT)
        self._latest_s = self._alive_due_s = time.monotonic()
        self._begin: Begin | None = begin
        self._serve_until(lambda: self._is_ready or bool(self._rejection), BEGIN_S)
        if not self._is_ready:
            why = self._rejection or self.lost or f"no answer within {BEGIN_S:g} s{self._printed()}"
            self.close()
            log_file = folder.log(f"agent_{self.name}")
            raise InputError(f"{self.name} ({settings.ssh}) does not take part: {why}; see {log_file}")

    @property
    def descriptor(self) -> int:
        """Readable when the agent has reported something."""
        return self._channel.descriptor

    def serve(self) -> None:
        """Reads what the agent has reported, and shows it that the launcher is alive; to be called often."""
        now_s = time.monotonic()
        for message in self._channel.read():
            if isinstance(message, MessageError):
                self._skip(message)
            else:
                self._latest_s = now_s
                self._take(message)
        if self._channel.ended:
            self.lost = self.lost or f"its agent has ended{self._printed()}"
        elif self._is_ready and now_s - self._latest_s > SILENT_S:
            self.lost = self.lost or f"it is silent for {SILENT_S:g} s"
        if self._begin is None and not self.lost and now_s >= self._alive_due_s and not self._channel.is_behind:
            self._alive_due_s = now_s + ALIVE_S
            self._channel.send(Alive())
        self._channel.flush()

    def start(self, node: str) -> RemoteProcess:
        """Starts a node's process there. Raises OSError if that fails."""
        self._processes.pop(node, None)
        self._starting, self._failed = node, ""
        self._channel.send(Start(node=node))
        self._serve_until(lambda: node in self._processes or bool(self._failed), START_S)
        self._starting = ""
        if node not in self._processes:
            why = self._failed or self.lost or f"no answer within {START_S:g} s"
            raise OSError(0, f"{self.name}: {why}")
        return self._processes[node]

    def _serve_until(self, is_answered: Callable[[], bool], timeout_s: float) -> None:
        end_s = time.monotonic() + timeout_s
        while not (is_answered() or self.lost) and time.monotonic() < end_s:
            select.select([self.descriptor], [], [], ALIVE_S)
            self.serve()

    def terminate(self, node: str) -> None:
        """SIGTERM to a node there."""
        self._channel.send(End(node=node))

    def kill(self, node: str) -> None:
        """SIGKILL to a node there."""
        self._channel.send(Kill(node=node))

    def close(self) -> None:
        """Ends the agent, which ends what is left there."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        with contextlib.suppress(OSError):
            self._process.stdin.close()
        try:
            self._process.wait(timeout=SILENT_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self.lost = self.lost or "it was closed"
        self._process.stdout.close()

    def _skip(self, error: MessageError) -> None:
        """What is no message: before the first one, the greeting of a shell's start-up file."""
        if self._begin is not None:
            self._greeting = self._greeting or error.content
            return
        self._unreadable += 1
        if is_logged(self._unreadable):
            self.problems.append(f"{self.name} sends what is no message (number {self._unreadable}): {error}")

    def _printed(self) -> str:
        """What the other host has printed instead of messages, as the end of a reason."""
        errors = last_lines(self._folder.log(f"agent_{self.name}"), 1)
        texts = [repr(text) for text in (self._greeting, *errors) if text]
        return f"; it prints {' and '.join(texts)}" if texts else ""

    def _take(self, message: Any) -> None:
        if self._begin is not None:  # not before the agent reads: the age would have grown
            age_ns = time.monotonic_ns() - self._folder.begun_ns
            self._channel.send(self._begin.model_copy(update={"age_ns": age_ns}))
            self._begin = None
        node: str = getattr(message, "node", "")
        if node and node not in self._nodes:
            self._skip(MessageError(f"{node} does not run there"))
            return
        match message:
            case Ready():
                self._is_ready = True
            case Rejected(reason=reason):
                self._rejection = reason or "no reason given"
            case Started(pid=pid) if node == self._starting:
                self._processes[node] = RemoteProcess(self, node, pid)
            case Failed(reason=reason) if node == self._starting:
                self._failed = reason or "no reason given"
            case Log(text=text):
                with contextlib.suppress(OSError), self._folder.log(node).open("a", encoding="utf-8") as file:
                    file.write(text)  # without room on the disk, the log is complete on the other host
            case Ended(code=code) if node in self._processes:
                self._processes[node].code = code
            case Halted(is_halted=is_halted) if node in self._processes:
                self._processes[node].is_halted = is_halted


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
        self._host.terminate(self._node)

    def kill(self) -> None:
        """See `SupervisedProcess.kill`."""
        self._host.kill(self._node)
