"""Kills and stops processes of one run, one case after the other, and measures what follows."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from paramove.documents import exit_codes
from paramove.msgs.safety_state_pb2 import SafetyState
from paramove.robots import RobotDescription
from studies.faults import firmware_log
from studies.faults.kill_cases import LAUNCHER, SIGNALS, Expected, KillCase
from studies.faults.leftovers import left_over
from studies.faults.live_run import LiveRun

REPORT_MS = 50.0
RESTART_S = 2.0
GOES_ON_S = 8.0
SETTLE_S = 60.0  # for the phase to begin, for a node to be ready again, for a goal to be done
END_S = 30.0
GONE_S = 3.0
STOPPED_LAUNCHER_S = 1.5


@dataclass
class KillResult:
    """What followed. Times are from the signal; None where there was nothing to measure.

    Attributes:
        problems: What was not as it must be.
        late: What came later than it must.
        not_sent: Why the signal was not sent; nothing was measured then.
        step: The whole run's largest step, see `firmware_log.LargestStep`.
        pace: Simulated seconds per second of the whole run.
    """

    case: KillCase
    run_folder: str = ""
    report_ms: float | None = None
    restart_s: float | None = None
    ready_s: float | None = None
    end_s: float | None = None
    exit_code: int | None = None
    detail: str = ""
    step: firmware_log.LargestStep | None = None
    pace: float | None = None
    problems: list[str] = field(default_factory=list)
    late: list[str] = field(default_factory=list)
    not_sent: str = ""

    @property
    def passed(self) -> bool:
        """Whether all was as it must be, and in time."""
        return not (self.problems or self.late or self.not_sent)

    def as_json(self) -> dict[str, Any]:
        """Plain values."""
        values = asdict(self)
        values["case"]["expected"] = self.case.expected.value
        return values | {"passed": self.passed}


class InterruptedRunError(Exception):
    """Somebody pressed Ctrl-C."""


class KillRun:
    """One run with its cases.

    Args:
        workspace: Root of the workspace.
        folder: Of this run's files.
        domain: Of the bus.
        seed, pace: Of the world.
        interrupted: Called in a loop; the run is given up when it returns True.
    """

    def __init__(
        self,
        workspace: Path,
        folder: Path,
        domain: str,
        seed: int,
        pace: float = 1.0,
        interrupted: Callable[[], bool] = lambda: False,
    ) -> None:
        self._workspace, self._folder, self._domain, self._seed, self._pace = workspace, folder, domain, seed, pace
        self._interrupted = interrupted

    def perform(self, cases: Sequence[KillCase]) -> list[KillResult]:
        """Start the demo, perform each case in its phase, end it; raises InterruptedRunError."""
        results = [KillResult(case) for case in cases]
        with LiveRun(self._workspace, self._folder, self._domain, self._seed, self._pace) as run:
            waiting = list(results)
            while waiting:
                now = self._next(run, waiting)
                if now is None:
                    break
                waiting.remove(now)
                self._strike(run, now)
            runtime = run.bus_folder.parent
            folder = run.folder
            over_ns = time.monotonic_ns()
            if run.alive and run.end() is None:
                results[-1].problems.append("the launcher did not end within 30 s of Ctrl-C")
            real_s = _real_s(run.events, over_ns)
        _wait(lambda: not left_over(self._domain, runtime))
        left = left_over(self._domain, runtime)
        for result in results:
            result.run_folder = str(folder)
            if not result.not_sent:
                self._judge_whole(result, folder, left, real_s)
        return results

    def _next(self, run: LiveRun, waiting: list[KillResult]) -> KillResult | None:
        """Waits for the phase of one of the cases; None, noted in all of them, if none begins."""
        ready: list[KillResult] = []

        def begun() -> bool:
            ready.extend(result for result in waiting if run.is_moment(result.case.moment))
            return bool(ready)

        if self._until(run, begun, SETTLE_S):
            return ready[0]
        why = "its phase never began" if run.alive else f"the run had ended before: {run.last_sentence}"
        for result in waiting:
            result.not_sent = why
        return None

    def _strike(self, run: LiveRun, result: KillResult) -> None:
        case = result.case
        goals_before = len(run.goals_done)
        struck_ns = time.monotonic_ns()
        try:
            os.kill(run.pid_of(case.node) or 0, SIGNALS[case.signal])
        except ProcessLookupError:
            result.not_sent = f"its process had ended before: {run.last_sentence}"
            return
        if case.node == LAUNCHER:
            self._follow_launcher(run, result, struck_ns)
            return
        kinds = ("ended",) if case.signal == "KILL" else ("suspended",)
        self._until(run, lambda: run.first(case.node, kinds, struck_ns) is not None, 5.0)
        event = run.first(case.node, kinds, struck_ns)
        if event is None:
            result.problems.append("never reported")
        else:
            result.report_ms = (event["monotonic_ns"] - struck_ns) * 1e-6
            if result.report_ms > REPORT_MS:
                result.late.append(f"reported after {result.report_ms:.0f} ms, allowed {REPORT_MS:.0f} ms")
        if case.expected is not Expected.ENDS:
            self._follow_restart(run, result, struck_ns)
        if case.ends_run:
            self._follow_end(run, result, struck_ns)
        else:
            self._goes_on(run, result, goals_before)

    def _follow_restart(self, run: LiveRun, result: KillResult, struck_ns: int) -> None:
        node = result.case.node
        if not self._until(run, lambda: run.first(node, ("started",), struck_ns) is not None, SETTLE_S):
            result.problems.append("never restarted")
            return
        started = run.first(node, ("started",), struck_ns)
        assert started is not None
        result.restart_s = (started["monotonic_ns"] - struck_ns) * 1e-9
        if result.restart_s > RESTART_S:
            result.late.append(f"restarted after {result.restart_s:.2f} s, allowed {RESTART_S:g} s")
        up = ("ready", "degraded")
        self._until(run, lambda: run.first(node, up, started["monotonic_ns"]) is not None, SETTLE_S)
        ready = run.first(node, up, started["monotonic_ns"])
        if ready is None:
            result.problems.append("never ready again")
        else:
            result.ready_s = (ready["monotonic_ns"] - struck_ns) * 1e-9
            result.detail = str(ready.get("sentence", ""))

    def _follow_end(self, run: LiveRun, result: KillResult, struck_ns: int) -> None:
        """The run must end by itself, with a message that names the node and what happened to it."""
        node = result.case.node
        if not self._until(run, lambda: not run.alive, END_S):
            result.problems.append(f"the run did not end within {END_S:g} s")
            return
        result.end_s = (time.monotonic_ns() - struck_ns) * 1e-9
        result.exit_code = run.process.returncode
        result.detail = run.last_sentence
        if result.exit_code != exit_codes.FAILURE:
            result.problems.append(f"exit code {result.exit_code}, expected {exit_codes.FAILURE}")
        expected = [node, f"SIG{result.case.signal}"]
        expected += ["is back", "disarmed"] if result.case.expected is Expected.ENDS_BACK else []
        missing = [word for word in expected if not re.search(rf"\b{word}\b", result.detail)]
        if missing:
            result.problems.append(f"the last message lacks {', '.join(missing)}: {result.detail}")

    def _follow_launcher(self, run: LiveRun, result: KillResult, struck_ns: int) -> None:
        if result.case.signal == "KILL":
            self._until(run, lambda: not run.alive, END_S)
            result.exit_code = run.process.returncode
            _wait(lambda: "launcher" in run.last_sentence)
            result.detail = run.last_sentence
            if "launcher" not in result.detail:
                result.problems.append(f"no message that the launcher was killed; last: {result.detail}")
            if not _wait(lambda: not left_over(run.domain, run.bus_folder.parent)):
                result.problems.append("nodes outlive the launcher by more than 3 s")
            result.end_s = (time.monotonic_ns() - struck_ns) * 1e-9
            return
        until_s = time.monotonic() + STOPPED_LAUNCHER_S
        self._until(run, lambda: time.monotonic() >= until_s, SETTLE_S)
        os.kill(run.process.pid, signal.SIGCONT)
        self._goes_on(run, result, len(run.goals_done))

    def _goes_on(self, run: LiveRun, result: KillResult, goals_before: int) -> None:
        """For 8 s more nothing else may end, and the arm stays armed; a goal that was interrupted is recovered."""
        until_s = time.monotonic() + GOES_ON_S
        begun_ns = time.monotonic_ns()
        self._until(run, lambda: time.monotonic() >= until_s or not run.alive, SETTLE_S)
        if not run.alive:
            result.problems.append(f"the run ended: {run.last_sentence}")
            return
        ended = [event for event in run.events if event["event"] == "ended" and event["monotonic_ns"] >= begun_ns]
        result.problems += [f"{event['node']} {event.get('sentence', 'ended')}" for event in ended]
        if run.safety != SafetyState.STATE_ARMED:
            state = SafetyState.State.Name(run.safety).removeprefix("STATE_").lower()
            result.problems.append(f"the arm is {state}, not armed")
        if result.case.node == "synthesizer":
            # One that was under way ends, too; at rest there is none, and after the last corner none follows for long.
            enough = goals_before + (1 if result.case.moment == "rest" else 2)
            back = self._until(run, lambda: len(run.goals_done) >= enough or not run.alive, SETTLE_S)
            if not back or not run.alive:
                result.problems.append("no goals were done any more")

    def _until(self, run: LiveRun, happened: Callable[[], bool], limit_s: float) -> bool:
        end_s = time.monotonic() + limit_s
        while time.monotonic() < end_s:
            if self._interrupted():
                raise InterruptedRunError
            run.look()
            if happened():
                return True
            if not run.alive:
                run.look(0.0)
                return happened()
        return False

    def _judge_whole(self, result: KillResult, folder: Path, left: list[str], real_s: float) -> None:
        result.problems += [f"left over: {what}" for what in left]
        robot = RobotDescription.load(self._workspace / "robot_description" / "hoap3")
        with contextlib.suppress(FileNotFoundError):
            frames = firmware_log.read_frames(folder / firmware_log.FILE, robot.n_joints)
            result.step = firmware_log.largest_step(frames, robot)
            result.pace = len(frames) * 1e-3 / real_s if real_s else None
        if result.step is None:
            result.problems.append("the firmware wrote no log")
        elif not result.step.within_limits:
            result.problems.append(
                f"joint {result.step.joint} stepped {result.step.counts} counts in 1 ms at {result.step.at_ms} ms: "
                f"{result.step.share:.2f} of what is allowed (change of speed {result.step.bend_share:.2f})"
            )


def _wait(happened: Callable[[], bool]) -> bool:
    """Up to 3 s, whether or not the run is still alive."""
    end_s = time.monotonic() + GONE_S
    while not (done := happened()) and time.monotonic() < end_s:
        time.sleep(0.02)
    return done


def _real_s(events: Sequence[dict[str, Any]], over_ns: int) -> float:
    """How long the simulator ran, s: from when it was ready to when it was killed, stopped or asked to end."""
    own = [event for event in events if event.get("node") == "simulator"]
    ready = [event["monotonic_ns"] for event in own if event["event"] == "ready"]
    ended = [event["monotonic_ns"] for event in own if event["event"] in ("ended", "suspended", "asked")]
    return (min([*ended, over_ns]) - ready[0]) * 1e-9 if ready else 0.0
