"""One host's part of a run that another host has launched: starts, ends and reports its nodes on request.

It reads and writes lines of JSON by its standard input and output, which the launcher's ssh connects. Where the
connection ends, or is silent for `SILENT_S`, it ends its nodes by itself, the arm first. It begins with a line. From
the launcher:

    {"begin": {…}}                     the launch file, the domain, the release, the age of the run; once, on that line
    {"start": NODE}                    the answer is "started", or "failed"
    {"end": NODE}, {"kill": NODE}      SIGTERM, SIGKILL
    {}                                 it is alive; twice a second

To the launcher:

    {"rejected": REASON}               another release, a taken domain …; it ends
    {"ready": FOLDER}                  the folder of this part of the run
    {"started": NODE, "pid": PID}, {"failed": NODE, "reason": TEXT}
    {"ended": NODE, "code": CODE}, {"halted": NODE, "is": BOOL}
    {"log": NODE, "text": TEXT}        further output of a node
    {}                                 it is alive
"""

from __future__ import annotations

import contextlib
import datetime
import json
import os
import select
import signal
import sys
import time
from pathlib import Path
from typing import Any

from paramove.documents import Document
from paramove.source_code import code_digest
from paramove.supervision.control import json_object
from paramove.supervision.domain import DomainError, held_domain
from paramove.supervision.environment import LimitError, allow_open_files
from paramove.supervision.launch_file import Launch
from paramove.supervision.launch_schema import LaunchFile
from paramove.supervision.processes import Guard, SupervisedProcess, node_process
from paramove.supervision.queued_output import ignored_by_nohup
from paramove.supervision.run_folder import RunFolder
from paramove.supervision.stopping import stop_in_waves
from paramove.workspace import Workspace

ALIVE_S, SILENT_S = 0.5, 3.0
MAX_LINE = 4_000_000
_PERIOD_S = 0.05
_LOG_BYTES = 60_000
_BEHIND = ("paramove.bus.node", "paramove.hosts.relay", "paramove.supervision.agent")


def release_of(workspace: Workspace) -> str:
    """What has to be the same on all hosts of a run: version, code of bus and supervision, files of the workspace."""
    from paramove import __version__  # looked up in the installed package

    return f"{__version__}, code {code_digest(*_BEHIND)}, workspace {workspace.digest}"


class Lines:
    """Lines of JSON from a descriptor that is read without waiting.

    Attributes:
        ended: Whether the other side has closed it, or sent what is no such line.
    """

    def __init__(self, descriptor: int) -> None:
        self.descriptor, self.ended = descriptor, False
        self._begun = b""
        os.set_blocking(descriptor, False)

    def read(self) -> list[dict[str, Any]]:
        """Those that have come in."""
        with contextlib.suppress(BlockingIOError):
            while not self.ended:
                part = os.read(self.descriptor, 65_536)
                self._begun += part
                self.ended |= not part or len(self._begun) > MAX_LINE
        *lines, self._begun = self._begun.split(b"\n")
        found = []
        for content in map(json_object, lines):
            if content is None:
                self.ended = True
                break
            found.append(content)
        return found


class Agent:
    """See the head of this module. `run` returns once its part of the run has ended."""

    def __init__(self, workspace: Workspace) -> None:
        self._workspace = workspace
        self._lines = Lines(sys.stdin.fileno())
        self._processes: dict[str, SupervisedProcess] = {}
        self._logs: dict[str, int] = {}
        self._ends = False
        self._latest_s = self._alive_due_s = time.monotonic()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            if not ignored_by_nohup(number):
                signal.signal(number, self._end)
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)

    def run(self) -> bool:
        """Whether it could begin."""
        self._say()
        begin = self._first()
        if begin is None:
            return False
        begun_ns = time.monotonic_ns() - int(begin["age_ns"])
        release = release_of(self._workspace)
        if begin["release"] != release:
            self._say(rejected=f"it has {release}; the launcher has {begin['release']}. Install the same on both")
            return False
        file = LaunchFile.model_validate(begin["launch"])
        launch = Launch(begin["name"], (), file, Document(begin["launch"]))
        try:
            allow_open_files()
            with held_domain(begin["domain"], f"paramove host agent for {begin['launcher']}") as domain:
                runs = self._workspace.root / "runs"
                self._folder = RunFolder.create(runs, datetime.datetime.now().astimezone())
                self._folder.begun_ns = begun_ns
                self._folder.write_effective(launch)
                self._folder.write_configs(launch, domain.folder, domain.truth_folder, begin["clock"], begin["host"])
                self._say(ready=str(self._folder.path))
                self._file = file
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
            self._say(rejected=str(error))
            return False
        return True

    def _end(self, *_: object) -> None:
        self._ends = True

    def _first(self) -> dict[str, Any] | None:
        while not (self._ends or self._lines.ended):
            select.select([self._lines.descriptor], [], [], SILENT_S)
            for line in self._lines.read():
                begin = line.get("begin")
                return begin if isinstance(begin, dict) else None
        return None

    def _serve(self) -> None:
        """Does what is requested until the connection, or the run, has ended."""
        self._latest_s = time.monotonic()
        while not (self._ends or self._lines.ended) and time.monotonic() - self._latest_s < SILENT_S:
            self._wait()
            for line in self._lines.read():
                self._latest_s = time.monotonic()
                if (name := line.get("start")) in self._file.nodes:
                    self._start(name)
                self._terminate(line.get("end", ""))
                self._kill(line.get("kill", ""))

    def _wait(self) -> None:
        """Waits a moment for a line, or an end, and reports what has happened."""
        waited: list[int] = [] if self._lines.ended else [self._lines.descriptor]
        select.select([*waited, *(one.descriptor for one in self._processes.values())], [], [], _PERIOD_S)
        self._report()

    def _start(self, name: str) -> None:
        if name in self._processes:
            return
        try:
            process = node_process(name, self._file.nodes[name], self._folder, self._workspace, self._guard)
        except OSError as error:
            self._say(failed=name, reason=error.strerror or str(error))
            return
        self._processes[name] = process
        self._say(started=name, pid=process.pid)

    def _terminate(self, name: str) -> None:
        if name in self._processes:
            self._processes[name].terminate()

    def _kill(self, name: str) -> None:
        if name in self._processes:
            self._processes[name].kill()

    def _report(self) -> None:
        """Ends, stops (SIGSTOP), output, and that it is alive."""
        for name, process in list(self._processes.items()):
            code = process.ended()
            if code is None and (halted := process.halted()) is not None:
                self._say(halted=name, **{"is": halted})
            self._send_log(name)
            if code is not None:
                del self._processes[name]
                self._say(ended=name, code=code)
        if time.monotonic() >= self._alive_due_s:
            self._alive_due_s = time.monotonic() + ALIVE_S
            self._say()

    def _send_log(self, name: str) -> None:
        path: Path = self._folder.log(name)
        with contextlib.suppress(FileNotFoundError), path.open("rb") as file:
            file.seek(self._logs.get(name, 0))
            if text := file.read(_LOG_BYTES):
                self._logs[name] = file.tell()
                self._say(log=name, text=text.decode("utf-8", "replace"))

    def _say(self, **content: Any) -> None:
        with contextlib.suppress(OSError):  # nobody reads it any more
            sys.stdout.write(json.dumps(content) + "\n")
            sys.stdout.flush()
