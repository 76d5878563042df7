"""One host's part of a run that another host has launched: starts, ends and reports its nodes on request.

It reads and writes messages (see `messages.py`) by its standard input and output, which the launcher's ssh connects.
Where the connection ends, or is silent for `SILENT_S`, it ends its nodes by itself, the arm first: it never waits for
the launcher to take what it sends, so that its own clock decides. It sends first: then a shell's start-up file has
printed what it prints, and the launcher begins.
"""

from __future__ import annotations

import codecs
import contextlib
import datetime
import select
import signal
import sys
import time
from pathlib import Path
from typing import Any

from paramove.documents import Document, MessageError, printable
from paramove.source_code import code_digest
from paramove.supervision.channel import Channel
from paramove.supervision.domain import DomainError, held_domain
from paramove.supervision.environment import LimitError, allow_open_files
from paramove.supervision.launch_file import Launch
from paramove.supervision.messages import (
    TO_AGENT,
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
from paramove.supervision.processes import Guard, SupervisedProcess, node_process
from paramove.supervision.run_folder import RunFolder
from paramove.supervision.stopping import stop_in_waves
from paramove.workspace import Workspace

ALIVE_S, SILENT_S = 0.5, 3.0
_PERIOD_S = 0.05
_LAST_S = 1.0
"""How long it waits at its end for the launcher to take the last messages."""
_LOG_BYTES = 60_000
_BEHIND = ("paramove.bus.node", "paramove.hosts.relay", "paramove.supervision.agent")


def release_of(workspace: Workspace) -> str:
    """What has to be the same on all hosts of a run: version, code of bus and supervision, files of the workspace."""
    from paramove import __version__  # looked up in the installed package

    return f"{__version__}, code {code_digest(*_BEHIND)}, workspace {workspace.digest}"


class _LogTail:
    """What has been added to a log since it was read last."""

    def __init__(self, path: Path) -> None:
        self._path, self._at = path, 0
        self._decoder = codecs.getincrementaldecoder("utf-8")("replace")

    def further(self) -> str:
        """The next part of it, "" if there is none; a character may lie in two parts of the file."""
        with contextlib.suppress(FileNotFoundError), self._path.open("rb") as file:
            file.seek(self._at)
            content = file.read(_LOG_BYTES)
            self._at = file.tell()
            return self._decoder.decode(content)
        return ""


class Agent:
    """See the head of this module. `run` returns once its part of the run has ended.

    Args:
        workspace: Where nodes are found.
        reads, writes: Descriptors of the connection; default: standard input and output.
    """

    def __init__(self, workspace: Workspace, reads: int | None = None, writes: int | None = None) -> None:
        self._workspace = workspace
        reads = sys.stdin.fileno() if reads is None else reads
        writes = sys.stdout.fileno() if writes is None else writes
        self._channel: Channel[Any] = Channel(reads, writes, TO_AGENT)
        self._processes: dict[str, SupervisedProcess] = {}
        self._logs: dict[str, _LogTail] = {}
        self._ends = False
        self._latest_s = self._alive_due_s = time.monotonic()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, self._end)
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)

    def run(self) -> bool:
        """Whether it could begin."""
        self._channel.send_line_break()
        self._channel.send(Alive())
        begin = self._first()
        has_begun = begin is not None and self._run(begin)
        self._send_the_rest()
        return has_begun

    def _run(self, begin: Begin) -> bool:
        begun_ns = time.monotonic_ns() - begin.age_ns
        release = release_of(self._workspace)
        if begin.release != release:
            return self._reject(f"it has {release}; the launcher has {begin.release}. Install the same on both")
        file = begin.launch
        launch = Launch(begin.name, (), file, Document(file.model_dump(mode="json")))
        try:
            allow_open_files()
            with held_domain(begin.domain, f"paramove host agent for {begin.launcher}") as domain:
                runs = self._workspace.root / "runs"
                self._folder = RunFolder.create(runs, datetime.datetime.now().astimezone())
                self._folder.begun_ns = begun_ns
                self._folder.write_effective(launch)
                self._folder.write_configs(launch, domain.folder, domain.truth_folder, begin.clock, begin.host)
                self._channel.send(Ready(folder=printable(str(self._folder.path))))
                self._nodes = {name: node for name, node in file.nodes.items() if node.host == begin.host}
                with Guard() as self._guard:
                    self._serve()
                    stop_in_waves(
                        file,
                        is_running=self._processes.__contains__,
                        stop=self._terminate,
                        kill=self._kill,
                        wait=self._wait,
                    )
        except (DomainError, LimitError, OSError) as error:
            return self._reject(str(error))
        return True

    def _reject(self, reason: str) -> bool:
        self._channel.send(Rejected(reason=printable(reason)))
        return False

    def _end(self, *_: object) -> None:
        self._ends = True

    def _first(self) -> Begin | None:
        while not (self._ends or self._channel.ended):
            select.select([self._channel.descriptor], [], [], SILENT_S)
            for message in self._channel.read():
                if isinstance(message, Begin):
                    return message
                self._reject(f"the run was expected first, found {message}")
                return None
        return None

    def _serve(self) -> None:
        """Does what is requested until the connection, or the run, has ended."""
        self._latest_s = time.monotonic()
        while not (self._ends or self._channel.ended) and time.monotonic() - self._latest_s < SILENT_S:
            self._wait()
            for message in self._channel.read():
                if not isinstance(message, MessageError):
                    self._latest_s = time.monotonic()
                    self._take(message)

    def _take(self, message: Any) -> None:
        match message:
            case Start(node=name) if name in self._nodes:
                self._start(name)
            case End(node=name):
                self._terminate(name)
            case Kill(node=name):
                self._kill(name)

    def _wait(self) -> None:
        """Waits a moment for a message, or an end, and reports what has happened."""
        waited: list[int] = [] if self._channel.ended else [self._channel.descriptor]
        select.select([*waited, *(process.descriptor for process in self._processes.values())], [], [], _PERIOD_S)
        self._report()

    def _start(self, name: str) -> None:
        if name in self._processes:
            return
        try:
            process = node_process(name, self._nodes[name], self._folder, self._workspace, self._guard)
        except OSError as error:
            self._channel.send(Failed(node=name, reason=printable(error.strerror or str(error))))
            return
        self._processes[name] = process
        self._logs.setdefault(name, _LogTail(self._folder.log(name)))
        self._channel.send(Started(node=name, pid=process.pid))

    def _terminate(self, name: str) -> None:
        if name in self._processes:
            self._processes[name].terminate()

    def _kill(self, name: str) -> None:
        if name in self._processes:
            self._processes[name].kill()

    def _report(self) -> None:
        """Ends, stops (SIGSTOP), output, and that it is alive."""
        ended = {}
        for name, process in list(self._processes.items()):
            code = process.ended()
            if code is not None:
                ended[name] = code
                del self._processes[name]
            elif (halted := process.halted()) is not None:
                self._channel.send(Halted(node=name, is_halted=halted))
        self._send_logs()
        for name, code in ended.items():
            self._channel.send(Ended(node=name, code=code))
        if time.monotonic() >= self._alive_due_s and not self._channel.is_behind:
            self._alive_due_s = time.monotonic() + ALIVE_S
            self._channel.send(Alive())
        self._channel.flush()

    def _send_logs(self) -> None:
        """Further output, as long as the launcher takes it; the rest stays in the files here."""
        for name, log in self._logs.items():
            if self._channel.is_behind:
                return
            if text := log.further():
                self._channel.send(Log(node=name, text=text))

    def _send_the_rest(self) -> None:
        until_s = time.monotonic() + _LAST_S
        while self._channel.is_behind and time.monotonic() < until_s:
            select.select([], [], [], _PERIOD_S)
            self._channel.flush()
