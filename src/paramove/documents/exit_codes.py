"""Exit codes that nodes and `paramove launch` use (sysexits where one fits)."""

from __future__ import annotations

import signal

OK = 0
"""The node finished, or the run reached its end and was judged a success."""
FAILURE = 1
"""A node was given up, a required node ended, or the run was judged a failure."""
USAGE = 2
"""Wrong arguments; a restart does not help."""
JUDGED_A_FAILURE = 3
"""An evaluation judged its subject a failure."""
INPUT_MISSING = 66
"""A launch file, an overlay or a node's input does not exist; a restart does not help."""
UNAVAILABLE = 69
"""A device is missing or does not respond, or no node that should answer does."""
NODE_FAILED = 70
"""A node raised an exception, or reported that it has failed."""
TEMPORARY = 75
"""Another process holds what is needed, such as another run in the same domain."""
PERMISSION = 77
"""A permission is missing; a restart does not help."""
CONFIGURATION = 78
"""The launch file, a node's parameters or its input are wrong; a restart does not help."""
TIME_LIMIT = 124
"""The run took longer than its time limit."""

NEVER_RESTARTED = frozenset({USAGE, INPUT_MISSING, PERMISSION, CONFIGURATION})
"""Exit codes after which a restart would end the same way."""


def by_signal(number: int) -> int:
    """Exit code of a process that a signal ended: 130 SIGINT, 143 SIGTERM, 129 SIGHUP, 141 SIGPIPE."""
    return 128 + number


CTRL_C = by_signal(signal.SIGINT)
"""A person ended the command."""
INTERRUPTED = frozenset({CTRL_C, *map(by_signal, (signal.SIGTERM, signal.SIGHUP, signal.SIGPIPE))})
"""A person ended the run; it is neither a success nor a failure."""


def describe(code: int) -> str:
    """How a node ended, as a phrase that follows its name; negative codes are signals."""
    if code < 0:
        return _describe_signal(-code)
    meanings = {
        OK: "has finished",
        USAGE: "ended with exit code 2: wrong arguments",
        INPUT_MISSING: "ended with exit code 66: an input is missing",
        TEMPORARY: "ended with exit code 75: what it needs is held by another process",
        PERMISSION: "ended with exit code 77: a right is missing",
        CONFIGURATION: "ended with exit code 78: its parameters or its input are wrong",
    }
    return meanings.get(code, f"ended with exit code {code}")


def _describe_signal(number: int) -> str:
    try:
        name = signal.Signals(number).name
    except ValueError:  # a real-time signal
        return f"was ended by signal {number}"
    if number == signal.SIGKILL:
        return "was killed (SIGKILL)"
    if number in (signal.SIGSEGV, signal.SIGABRT, signal.SIGBUS, signal.SIGFPE, signal.SIGILL):
        return f"crashed ({name})"
    return f"was ended by {name}"


def interrupted(number: int) -> str:
    """Why a run ended after a signal to the launcher."""
    reasons = {
        signal.SIGINT: "stopped by Ctrl-C",
        signal.SIGHUP: "stopped because the terminal was closed",
        signal.SIGPIPE: "stopped because the program that read its output has ended",
    }
    return reasons.get(signal.Signals(number), f"stopped by {signal.Signals(number).name}")
