"""Which process is killed or stopped in which phase of a run, and what must happen then."""

from __future__ import annotations

import enum
import signal
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from paramove.supervision import LaunchFile

LAUNCHER = "launcher"
SIGNALS = {"KILL": signal.SIGKILL, "STOP": signal.SIGSTOP}
MOMENTS = {
    "moving": "the arm approaches with an empty hand",
    "rest": "the arm rests",
    "holding": "the arm carries an object",
}


class CaseError(ValueError):
    """No such node, signal or phase; the message names the valid ones."""


class Expected(enum.Enum):
    """What must follow."""

    GOES_ON = "goes on"  # restarted, and the run goes on
    ENDS_BACK = "ends, back"  # restarted, and then the run ends with a message
    ENDS = "ends"  # the run ends with a message
    ALL_END = "all end"  # the launcher was killed: nothing may outlive it
    UNHARMED = "unharmed"  # the launcher was stopped and goes on: as if nothing had happened


@dataclass(frozen=True)
class KillCase:
    """One process, one signal, one phase of the run."""

    node: str
    signal: str
    moment: str
    expected: Expected

    @property
    def name(self) -> str:
        """Such as `camera-KILL-moving`; names its result's file."""
        return f"{self.node}-{self.signal}-{self.moment}"

    @property
    def ends_run(self) -> bool:
        """Whether nothing can follow in the same run."""
        return self.expected not in (Expected.GOES_ON, Expected.UNHARMED)


def expected_of(node: str, signal_name: str, file: LaunchFile) -> Expected:
    """What must happen according to the launch file."""
    if node == LAUNCHER:
        return Expected.ALL_END if signal_name == "KILL" else Expected.UNHARMED
    settings = file.nodes[node]
    if settings.restart == "never":
        return Expected.ENDS
    return Expected.ENDS_BACK if settings.restart_ends_run else Expected.GOES_ON


def cases_of(
    file: LaunchFile, nodes: Sequence[str] = (), signals: Sequence[str] = (), moments: Sequence[str] = ()
) -> list[KillCase]:
    """The requested cases, all of them without a request; raises CaseError."""
    known = {"node": [*file.nodes, LAUNCHER], "signal": list(SIGNALS), "moment": list(MOMENTS)}
    requested = {"node": nodes, "signal": signals, "moment": moments}
    for what, names in requested.items():
        for name in names:
            if name not in known[what]:
                raise CaseError(f"no {what} {name!r}; there are {', '.join(known[what])}")
    chosen = {what: names or known[what] for what, names in requested.items()}
    return [
        KillCase(node, name, moment, expected_of(node, name, file))
        for name in chosen["signal"]
        for moment in chosen["moment"]
        for node in chosen["node"]
    ]


def runs_of(cases: Iterable[KillCase]) -> list[list[KillCase]]:
    """Cases grouped so that those of a group can follow one another in the same run.

    A node is killed once a run, so that its first backoff counts each time; a case that ends the run comes alone.
    """
    groups: list[list[KillCase]] = []
    for case in cases:
        if case.ends_run:
            groups.append([case])
            continue
        for group in groups:
            if not group[0].ends_run and case.node not in {other.node for other in group}:
                group.append(case)
                break
        else:
            groups.append([case])
    return groups
