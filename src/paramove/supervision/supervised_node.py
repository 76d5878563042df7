"""One node under supervision: its state, its process, its restarts."""

from __future__ import annotations

import enum
from collections.abc import Callable

import psutil

from paramove.msgs.node_status_pb2 import NodeStatus
from paramove.supervision.exit_codes import FAILURE, OK
from paramove.supervision.launch_schema import NodeSettings
from paramove.supervision.processes import SupervisedProcess, printable
from paramove.supervision.restarts import RestartPolicy


class State(enum.Enum):
    """Where a node stands."""

    WAITING = "waiting"
    STARTING = "starting"
    READY = "ready"
    DEGRADED = "degraded"
    FAILED = "failed"
    RESTARTING = "restarting"
    STOPPING = "stopping"
    STOPPED = "stopped"
    FINISHED = "finished"
    GIVEN_UP = "given up"


ENDED = frozenset({State.STOPPED, State.FINISHED, State.GIVEN_UP})
_SAID = {
    NodeStatus.STATE_READY: State.READY,
    NodeStatus.STATE_DEGRADED: State.DEGRADED,
    NodeStatus.STATE_FAILED: State.FAILED,
}


MEASURE_PERIOD_S = 1.0


class SupervisedNode:
    """Follows one node from its start to its end.

    Args:
        name: Of the node.
        settings: From the launch file.
        spawn: Starts its process.
        on_change: Called after each change of `state` or of the reason for it.

    Attributes:
        sentence: What the node said last, or what happened to it.
        exit_code: Of its last end; None before.
        status: Its last NodeStatus.
    """

    def __init__(
        self,
        name: str,
        settings: NodeSettings,
        spawn: Callable[[str], SupervisedProcess],
        on_change: Callable[[SupervisedNode], None],
    ) -> None:
        self.name = name
        self.settings = settings
        self.state = State.WAITING
        self.sentence = f"for {', '.join(settings.after)}" if settings.after else ""
        self.restarts = 0
        self.exit_code: int | None = None
        self.status = NodeStatus()
        self.process: SupervisedProcess | None = None
        self._spawn = spawn
        self._on_change = on_change
        self._policy = RestartPolicy(settings)
        self._deadline_s = 0.0  # of readiness while starting, of the next start while restarting
        self._measure_due_s = 0.0
        self._killed_for = ""

    @property
    def is_up(self) -> bool:
        """Whether nodes that come after this one may start."""
        return self.state in (State.READY, State.DEGRADED, State.FINISHED)

    @property
    def is_running(self) -> bool:
        """Whether its process exists."""
        return self.process is not None

    def start(self, now_s: float) -> None:
        """Starts the process."""
        self.status = NodeStatus()
        self._killed_for = ""
        self._deadline_s = now_s + self.settings.ready_timeout_s
        self.process = self._spawn(self.name)
        self._become(State.STARTING, f"pid {self.process.pid}")

    def hear(self, status: NodeStatus) -> None:
        """Takes in what the node says of itself; words of an earlier process are passed over."""
        if self.process is None or status.pid != self.process.pid:
            return
        self.status = status
        if self.state is State.STOPPING:
            return
        state = _SAID.get(status.state, self.state)
        sentence = printable(status.sentence)
        if state is not self.state:
            self._become(state, sentence)
        else:
            self.sentence = sentence

    def check(self, now_s: float) -> int | None:
        """Does what is due; returns the exit code if the process has just ended (see `conclude`)."""
        if self.state is State.RESTARTING and now_s >= self._deadline_s:
            self.restarts += 1
            self.start(now_s)
        if self.process is None:
            return None
        code = self.process.ended()
        if code is not None:
            self.process = None
            return code
        if self.state is not State.STOPPING and not self._killed_for:
            self._killed_for = self._fault(self.process.pid, now_s)
            if self._killed_for:
                self.process.kill()
        return None

    def _fault(self, pid: int, now_s: float) -> str:
        """Why the process has to be killed; empty if it is well."""
        if self.state is State.STARTING and now_s >= self._deadline_s:
            said = printable(self.status.sentence) or "nothing"
            return f"not ready within {self.settings.ready_timeout_s:g} s, last said: {said}"
        limit_mb = self.settings.memory_limit_mb
        if limit_mb is not None and now_s >= self._measure_due_s:
            self._measure_due_s = now_s + MEASURE_PERIOD_S
            used_mb = _memory_mb(pid)
            if used_mb > limit_mb:
                return f"used {used_mb:.0f} MB of memory, its limit is {limit_mb:g} MB"
        return ""

    def conclude(self, code: int, now_s: float) -> None:
        """Draws the consequence of an end that nobody asked for: restart, finished or given up."""
        self.exit_code = FAILURE if self._killed_for else code
        verdict = self._policy.after_exit(self.exit_code, now_s)
        sentence = f"{self._killed_for}; {verdict.sentence}" if self._killed_for else verdict.sentence
        if verdict.restart_after_s is not None:
            self._deadline_s = now_s + verdict.restart_after_s
            self._become(State.RESTARTING, sentence)
        else:
            self._become(State.GIVEN_UP if verdict.failed else State.FINISHED, sentence)

    def stop(self) -> None:
        """Asks the process to end; one that is not running just stops waiting."""
        if self.process is not None:
            self.process.terminate()
            self._become(State.STOPPING, "")
        elif self.state not in ENDED:
            self._become(State.STOPPED, "")

    def kill(self) -> None:
        """Ends the process at once."""
        if self.process is not None:
            self.process.kill()

    def stopped(self, code: int, took_s: float) -> None:
        """Takes in the end of the process that `stop` or `kill` asked for."""
        self.exit_code = code
        how = "" if code == OK else f"exit {code}, "
        self._become(State.STOPPED, f"{how}{took_s:.1f} s after it was asked")

    def _become(self, state: State, sentence: str) -> None:
        self.state, self.sentence = state, sentence
        self._on_change(self)


def _memory_mb(pid: int) -> float:
    try:
        return float(psutil.Process(pid).memory_info().rss) / 2**20
    except psutil.Error:  # it has just ended
        return 0.0
