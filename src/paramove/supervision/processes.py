"""Starts, watches and ends one process with everything that it starts; no process outlives the launcher."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Self

import psutil

from paramove.bus import START_VARIABLE
from paramove.documents import printable
from paramove.supervision.environment import node_environment
from paramove.supervision.guard import Watched
from paramove.supervision.launch_schema import NodeSettings
from paramove.supervision.run_folder import RunFolder
from paramove.workspace import Workspace

_HERE = Path(__file__).parent
_NO_SITE = ("-I", "-S")  # `tied.py` needs the standard library only, and starts faster so
NICE = {"low": 5, "normal": 0, "high": -10}
"""Nice value by the launch file's priority."""


class Guard:
    """The process that ends the nodes of a launcher that was killed (see `guard.py`)."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "paramove.supervision.guard"],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            start_new_session=True,
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Lets the guard end what is still watched, and waits for it."""
        if self._process.stdin is not None:
            with contextlib.suppress(BrokenPipeError):
                self._process.stdin.close()
        self._process.wait()

    def watch(self, group: int) -> None:
        """From now on the process group ends with the launcher."""
        self._send(Watched(group=group, watched=True))

    def forget(self, group: int) -> None:
        """The process group has ended."""
        self._send(Watched(group=group, watched=False))

    def _send(self, change: Watched) -> None:
        if self._process.stdin is not None and not self._process.stdin.closed:
            with contextlib.suppress(BrokenPipeError):  # the guard was killed: the kernel's SIGTERM remains
                self._process.stdin.write(change.line() + b"\n")
                self._process.stdin.flush()


class SupervisedProcess:
    """One started command: leader of its own session and process group, tied to the launcher's life.

    Attributes:
        pid: Process id, which is also the id of its process group.
        descriptor: Readable as soon as the process has ended.
    """

    def __init__(
        self,
        command: Sequence[str],
        *,
        folder: Path,
        environment: Mapping[str, str],
        guard: Guard,
        log: Path | None = None,
    ) -> None:
        """Starts `command` in `folder`; its output goes to the end of the file `log`, or where the launcher's goes.

        Raises RuntimeError outside the main thread: the kernel ties a process to the thread that started it.
        """
        if threading.current_thread() is not threading.main_thread():
            raise RuntimeError("processes are started from the main thread, whose end is the launcher's end")
        tied = [sys.executable, *_NO_SITE, str(_HERE / "tied.py"), str(os.getpid()), *command]
        with log.open("ab") if log else contextlib.nullcontext() as output:
            self._process = subprocess.Popen(
                tied,
                cwd=folder,
                env=dict(environment),
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT if log else None,
                start_new_session=True,
            )
        self.pid = self._process.pid
        self.descriptor = os.pidfd_open(self.pid)
        self._guard = guard
        guard.watch(self.pid)

    def ended(self) -> int | None:
        """Exit code (negative: number of the signal) once the process has ended, else None.

        What it started and left behind is killed with it.
        """
        code = self._process.poll()
        if code is not None and self.descriptor >= 0:
            self._signal(signal.SIGKILL)
            os.close(self.descriptor)
            self.descriptor = -1
            self._guard.forget(self.pid)
        return code

    def halted(self) -> bool | None:
        """True if the process was stopped (SIGSTOP and similar) since the last call, False if it was continued.

        None if neither. Both together count as False.
        """
        halted: bool | None = None
        for flag, meaning in ((os.WSTOPPED, True), (os.WCONTINUED, False)):
            with contextlib.suppress(ChildProcessError):
                if os.waitid(os.P_PID, self.pid, flag | os.WNOHANG) is not None:
                    halted = meaning
        return halted

    def memory_mb(self) -> float:
        """What it uses, 0 if it has just ended."""
        try:
            return float(psutil.Process(self.pid).memory_info().rss) / 2**20
        except psutil.Error:
            return 0.0

    def terminate(self) -> None:
        """Requests the process to end. It alone gets the signal: it ends its own children in order."""
        if self._process.poll() is None:
            self._process.terminate()
            self._process.send_signal(signal.SIGCONT)  # a stopped process cannot end in order

    def kill(self) -> None:
        """Ends the process and all of its group at once."""
        self._signal(signal.SIGKILL)

    def _signal(self, number: signal.Signals) -> None:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self.pid, number)


def node_process(
    name: str, settings: NodeSettings, run_folder: RunFolder, workspace: Workspace, guard: Guard
) -> SupervisedProcess:
    """Starts a node's module with its configuration, at its priority; its environment has the number of this start."""
    run_folder.starts[name] += 1
    start = {START_VARIABLE: str(run_folder.starts[name])}
    process = SupervisedProcess(
        [sys.executable, "-P", "-m", settings.module, "--config", str(run_folder.config(name, settings.namespace))],
        folder=workspace.root,
        environment=node_environment(os.environ, workspace) | start,
        guard=guard,
        log=run_folder.log(name),
    )
    prioritise(process.pid, settings.priority)
    return process


def prioritise(pid: int, priority: str) -> None:
    """Gives a process that has just started the nice value of a priority; without effect where that is not allowed.

    Linux shares the processor between sessions first (autogroup), and each node has its own: both are set. Of sessions
    it lets an ordinary user set one in 0.1 s (Linux 6.18, kernel/sched/autogroup.c); it is tried for 0.5 s.
    """
    nice = NICE[priority]
    if nice == 0:
        return
    with contextlib.suppress(PermissionError, ProcessLookupError):
        os.setpriority(os.PRIO_PROCESS, pid, nice)
    for _ in range(10):
        try:
            Path(f"/proc/{pid}/autogroup").write_bytes(str(nice).encode())
        except BlockingIOError:
            time.sleep(0.05)
        except OSError:
            return
        else:
            return


def last_lines(file: Path, count: int) -> list[str]:
    """The last `count` lines of a text file, with control characters written out; [] if it cannot be read."""
    try:
        with file.open("rb") as opened:
            opened.seek(max(0, file.stat().st_size - 100_000))
            lines = opened.read().decode("utf-8", errors="replace").splitlines()
    except OSError:
        return []
    return [printable(line) for line in lines[-count:]]
