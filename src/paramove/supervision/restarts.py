"""When a node that ended is started again: backoff that doubles, and a budget within a sliding window."""

from __future__ import annotations

from dataclasses import dataclass, field

from paramove.documents.exit_codes import NEVER_RESTARTED, OK
from paramove.supervision.launch_schema import NodeSettings

LONGEST_BACKOFF_S = 30.0


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
        wanted = self.settings.restart == "always" or (self.settings.restart == "on-failure" and failed)
        if not wanted:
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
