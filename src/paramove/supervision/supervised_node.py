"""One node under supervision: its state, its process, its restarts."""

from __future__ import annotations

import enum
from collections.abc import Callable
from dataclasses import dataclass, field

from paramove.documents import FAILURE, NEVER_RESTARTED, OK, describe, printable
from paramove.msgs.node_status_pb2 import NodeStatus
from paramove.supervision.launch_schema import NodeSettings
from paramove.supervision.processes import SupervisedProcess
from paramove.supervision.remote_host import RemoteProcess
from paramove.supervision.stopping import STOP_S

NodeProcess = SupervisedProcess | RemoteProcess
"""On this host, or on another one."""
LONGEST_BACKOFF_S = 30.0


class State(enum.Enum):
    """State of a node."""

    WAITING = "waiting"
    STARTING = "starting"
    READY = "ready"
    DEGRADED = "degraded"
    FAILED = "failed"
    SUSPENDED = "suspended"
    RESTARTING = "restarting"
    STOPPING = "stopping"
    STOPPED = "stopped"
    FINISHED = "finished"
    GIVEN_UP = "given up"


USUAL_ENDS = ("", "finished", "stopped on request")
"""Messages of nodes that ended without a special reason."""
ENDED = frozenset({State.STOPPED, State.FINISHED, State.GIVEN_UP})
_STATE_OF_STATUS = {
    NodeStatus.STATE_READY: State.READY,
    NodeStatus.STATE_DEGRADED: State.DEGRADED,
    NodeStatus.STATE_FAILED: State.FAILED,
}
_AT_WORK = (State.READY, State.DEGRADED, State.FAILED)
MEASURE_PERIOD_S = 1.0
MAX_CHECK_INTERVAL_S = 0.5
"""At most this much time without status counts per check: a launcher that was itself stopped received nothing."""


class SupervisedNode:
    """Follows one node from its start to its end.

    Args:
        name: Of the node.
        settings: From the launch file.
        spawn: Starts its process.
        on_change: Called after each change of `state` or of the reason for it.

    Attributes:
        detail: Latest message of the node, or what happened to it in words that follow its name.
        event: The latest change: `started`, `ready`, `degraded`, `failed`, `suspended`, `resumed`, `fault` (the
            supervisor kills it), `ended`, `given_up`, `asked` (requested to end), `stopped` (it did not run).
        exit_code: Of its last end, negative: number of the signal; None before.
        exit_reason: How it ended last and why, in words that follow its name; empty before.
        came_back: How it ended and its message since it is up again, once it was restarted; empty before.
        status: Its last NodeStatus.
        longest_silence_s: Longest time between two of them while it was at work.
        process: None while it does not run.
        pid: Of its last process; 0 before the first.
    """

    def __init__(
        self,
        name: str,
        settings: NodeSettings,
        spawn: Callable[[str], NodeProcess],
        on_change: Callable[[SupervisedNode], None],
    ) -> None:
        self.name = name
        self.settings = settings
        self.state = State.WAITING
        self.detail = f"for {', '.join(settings.after)}" if settings.after else ""
        self.restarts = 0
        self.event = ""
        self.exit_code: int | None = None
        self.exit_reason = ""
        self.came_back = ""
        self.status = NodeStatus()
        self.process: NodeProcess | None = None
        self.pid = 0
        self._spawn = spawn
        self._on_change = on_change
        self._policy = RestartPolicy(settings)
        self._deadline_s = 0.0  # of readiness while starting, of the next start while restarting
        self._measure_due_s = 0.0
        self._killed_for = ""
        self.longest_silence_s = 0.0
        self._no_status_s = 0.0
        self._checked_s = 0.0
        self._before = State.STARTING  # it was suspended
        self._suspended_s = 0.0
        self._end = ""
        self._by_hand = ""  # request of a person: "stopped" or "restarted"
        self._requested_s = 0.0

    @property
    def is_up(self) -> bool:
        """Whether nodes that come after this one may start."""
        return self.state in (State.READY, State.DEGRADED, State.FINISHED)

    @property
    def is_running(self) -> bool:
        """Whether its process exists."""
        return self.process is not None

    def start(self, now_s: float) -> None:
        """Starts the process. One that cannot be started has ended, and is tried again as any other."""
        self.status = NodeStatus()
        self._killed_for = ""
        self._no_status_s, self._checked_s = 0.0, now_s
        self._deadline_s = now_s + self.settings.ready_timeout_s
        try:
            self.process = self._spawn(self.name)
        except OSError as error:  # no more processes or files are allowed
            self._killed_for = f"cannot be started: {error.strerror}"
            self.conclude(FAILURE, now_s)
            return
        self.pid = self.process.pid
        self._become(State.STARTING, f"pid {self.process.pid}", "started")

    def handle(self, status: NodeStatus) -> None:
        """Handles a status of the node; those of an earlier process are ignored."""
        if self.process is None or status.pid != self.process.pid:
            return
        self.status = status
        if self.state in _AT_WORK:
            self.longest_silence_s = max(self.longest_silence_s, self._no_status_s)
        self._no_status_s = 0.0
        if self.state in (State.STOPPING, State.SUSPENDED):
            return
        state = _STATE_OF_STATUS.get(status.state, self.state)
        message = printable(status.detail)
        if state is self.state:
            self.detail = message
            return
        if self.restarts and self.state is State.STARTING:
            how = "is back" if state is not State.FAILED else "is back, but cannot work"
            self.came_back = f"{self._end} and {how}: {message}"
        self._become(state, message, state.value)

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
        if self.state is State.STOPPING:
            if self._by_hand and now_s >= self._deadline_s:
                self.process.kill()
            return None
        self._follow(self.process.halted(), now_s)
        if not self._killed_for:
            self._killed_for = self._fault(self.process, now_s)
            if self._killed_for:
                self._become(self.state, f"{self._killed_for}, so it is killed", "fault")
                self.process.kill()
        return None

    def _follow(self, halted: bool | None, now_s: float) -> None:
        """Follows whether the process was stopped or continued, and how long it has published no status."""
        self._no_status_s += min(now_s - self._checked_s, MAX_CHECK_INTERVAL_S)
        self._checked_s = now_s
        if halted and self.state is not State.SUSPENDED:
            self._before = self.state
            self._suspended_s = now_s
            timeout_s = self.settings.stopped_timeout_s
            rest = "" if timeout_s is None else f"; killed in {timeout_s:g} s unless it is continued"
            self._become(State.SUSPENDED, f"is stopped (SIGSTOP){rest}", "suspended")
        elif halted is False and not self._killed_for:
            self._no_status_s = 0.0
            self._become(self._before if self.state is State.SUSPENDED else self.state, "is continued", "resumed")

    def _fault(self, process: NodeProcess, now_s: float) -> str:
        """Why the process has to be killed, in words that follow its name; empty if it is healthy."""
        settings = self.settings
        if self.state is State.SUSPENDED:
            timeout_s = settings.stopped_timeout_s
            if timeout_s is not None and now_s >= self._suspended_s + timeout_s:
                return f"was stopped (SIGSTOP) for {timeout_s:g} s"
            return ""
        last = printable(self.status.detail) or "none"
        if self.state is State.STARTING and now_s >= self._deadline_s:
            return (
                f"was not ready within {settings.ready_timeout_s:g} s (ready_timeout_s; a busy machine may need more), "
                f"last message: {last}"
            )
        if self.state in _AT_WORK and self._no_status_s >= (settings.silent_timeout_s or float("inf")):
            return f"hangs: no status for {settings.silent_timeout_s:g} s, last message: {last}"
        if settings.memory_limit_mb is not None and now_s >= self._measure_due_s:
            self._measure_due_s = now_s + MEASURE_PERIOD_S
            used_mb = process.memory_mb()
            if used_mb > settings.memory_limit_mb:
                return f"used {used_mb:.0f} MB of memory, its limit is {settings.memory_limit_mb:g} MB"
        return ""

    def conclude(self, code: int, now_s: float) -> None:
        """Handles an end that was not requested: restart, finished or given up."""
        self.exit_code = code
        if self._by_hand:
            self._conclude_by_hand(code, now_s)
            return
        self._end = self._killed_for or describe(code)
        has_reason = self.status.state == NodeStatus.STATE_STOPPED and self.status.detail not in USUAL_ENDS
        if not self._killed_for and (has_reason or self.status.state == NodeStatus.STATE_FAILED):
            self._end += f" ({printable(self.status.detail)})"
        verdict = self._policy.after_exit(FAILURE if self._killed_for else code, now_s)
        if self.settings.restart_ends_run and self.restarts > 0 and not self.came_back:
            verdict = Verdict(None, True, "it did not come back")
        self.exit_reason = f"{self._end}; {verdict.consequence}" if verdict.consequence else self._end
        if verdict.restart_after_s is not None:
            self._deadline_s = now_s + verdict.restart_after_s
            self._become(State.RESTARTING, self.exit_reason, "ended")
        else:
            self._become(State.GIVEN_UP if verdict.failed else State.FINISHED, self.exit_reason, "ended")

    def stop_by_hand(self, now_s: float, restart: bool = False) -> None:
        """Stops the node alone, on request of a person; it is killed if it takes too long.

        Args:
            now_s: On the monotonic clock.
            restart: Whether it is started again when it has ended.
        """
        if self.process is None:
            self.exit_reason = "was stopped by hand"
            self._become(State.STOPPED, "by hand", "stopped")
            return
        self._by_hand = "restarted" if restart else "stopped"
        self._requested_s = now_s
        self._deadline_s = now_s + STOP_S
        self.process.terminate()
        self._become(State.STOPPING, f"to be {self._by_hand} by hand", "asked")

    def start_by_hand(self, now_s: float) -> None:
        """Starts a node that has ended, at once and without using the budget of restarts."""
        self.restarts += 1
        self._end = self.exit_reason
        self.start(now_s)

    def _conclude_by_hand(self, code: int, now_s: float) -> None:
        """Handles an end that a person requested."""
        restart = self._by_hand == "restarted"
        self._end = f"was {self._by_hand} by hand"
        self.exit_reason = self._end if code == OK else f"{self._end}, {describe(code)}"
        self._by_hand = ""
        self._become(State.STOPPED, f"by hand, {now_s - self._requested_s:.1f} s after the request", "ended")
        if restart:
            self.restarts += 1
            self.start(now_s)
        elif self.settings.required and self.settings.restart == "never":
            self._become(State.GIVEN_UP, self.exit_reason, "given_up")

    def stop(self) -> None:
        """Requests the process to end; a node that is not running stops waiting."""
        self._by_hand = ""
        if self.process is not None:
            self.process.terminate()
            self._become(State.STOPPING, "", "asked")
        elif self.state not in ENDED:
            self._become(State.STOPPED, "", "stopped")

    def kill(self) -> None:
        """Ends the process at once."""
        if self.process is not None:
            self.process.kill()

    def stopped(self, code: int, took_s: float) -> None:
        """Handles the end of the process after `stop` or `kill`."""
        self.exit_code = code
        self.exit_reason = f"{describe(code)} {took_s:.1f} s after the request"
        how = "" if code == OK else f"{describe(code)}, "
        self._become(State.STOPPED, f"{how}{took_s:.1f} s after the request", "ended")

    def _become(self, state: State, detail: str, event: str) -> None:
        self.state, self.detail, self.event = state, detail, event
        self._on_change(self)


@dataclass(frozen=True)
class Verdict:
    """What follows from a node's end.

    Attributes:
        restart_after_s: Wait before the next start; None for no restart.
        failed: Whether the end counts as a failure.
        consequence: In words; empty if there is none but the end.
    """

    restart_after_s: float | None
    failed: bool
    consequence: str


@dataclass
class RestartPolicy:
    """Restart rule of one node; pure but for the restarts that it remembers."""

    settings: NodeSettings
    _restarts_s: list[float] = field(default_factory=list)

    def after_exit(self, code: int, now_s: float) -> Verdict:
        """Verdict on an exit with `code` (negative: a signal) at `now_s` on a monotonic clock."""
        failed = code != OK
        to_restart = self.settings.restart == "always" or (self.settings.restart == "on-failure" and failed)
        if not to_restart:
            return Verdict(None, failed, "")
        if code in NEVER_RESTARTED:
            return Verdict(None, True, "a restart would end the same way")
        window_s = self.settings.budget.window_s
        self._restarts_s = [at for at in self._restarts_s if now_s - at < window_s]
        done = len(self._restarts_s)
        if done >= self.settings.budget.restarts:
            return Verdict(None, True, f"given up after {done} restarts in {window_s:g} s")
        wait_s = min(self.settings.backoff_s * 2.0**done, max(LONGEST_BACKOFF_S, self.settings.backoff_s))
        self._restarts_s.append(now_s)
        return Verdict(wait_s, failed, f"restart {done + 1} in {wait_s:g} s")
