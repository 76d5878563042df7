"""Exit codes that nodes and `paramove launch` use (sysexits where one fits)."""

from __future__ import annotations

import signal

OK = 0
"""The node finished, or the run reached its end and was judged a success."""
FAILURE = 1
"""A node was given up, a required node ended, or the run was judged a failure."""
USAGE = 2
"""Wrong arguments; the same again would fail again."""
INPUT_MISSING = 66
"""A launch file or an overlay does not exist."""
TEMPORARY = 75
"""Something else holds what is needed, such as another run in the same domain."""
PERMISSION = 77
"""A right is missing; a restart does not help."""
CONFIGURATION = 78
"""The launch file or a node's parameters are wrong; a restart does not help."""
TIME_LIMIT = 124
"""The run took longer than its time limit."""

NEVER_RESTARTED = frozenset({USAGE, PERMISSION, CONFIGURATION})
"""Exit codes after which a restart would end the same way."""


def by_signal(number: int) -> int:
    """Exit code of a process that a signal ended: 130 for SIGINT, 143 for SIGTERM, 129 for SIGHUP."""
    return 128 + number


def describe(code: int) -> str:
    """What an exit code of a node says, in words; negative codes are signals, as in `subprocess`."""
    if code < 0:
        return f"ended by {signal.Signals(-code).name}"
    meanings = {
        OK: "finished",
        USAGE: "exit code 2: wrong arguments",
        PERMISSION: "exit code 77: a right is missing",
        CONFIGURATION: "exit code 78: its parameters are wrong",
    }
    return meanings.get(code, f"exit code {code}")
