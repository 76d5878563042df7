"""Format of a line in a node's log, which `paramove logs` parses.

    8123.456789 2026-11-21T10:00:00.123456+01:00 WARNING camera: no frame for 1 s

The first number is CLOCK_MONOTONIC in seconds, by which lines of several processes are put in order: it never steps.
"""

from __future__ import annotations

import datetime
import logging
import re
import time
from dataclasses import dataclass

_LINE = re.compile(r"(\d+\.\d{6}) (\S+) (DEBUG|INFO|WARNING|ERROR|CRITICAL) (\w+): (.*)", re.DOTALL)


@dataclass(frozen=True)
class Stamped:
    """A parsed line; `level` is one of logging's numbers."""

    monotonic_s: float
    wall: str
    level: int
    node: str
    text: str


def is_logged(count: int) -> bool:
    """Whether an event is the 1st, 10th, 100th … of its kind, so that a flood of them fills no disk."""
    return str(count).strip("0") == "1"


class NodeFormatter(logging.Formatter):
    """Formats records of one node; times are those of the formatting, just after the event."""

    def __init__(self, node: str) -> None:
        super().__init__("%(stamp)s %(levelname)s %(node)s: %(message)s")
        self._node = node

    def format(self, record: logging.LogRecord) -> str:
        """The record as text; a traceback follows in further lines."""
        wall = datetime.datetime.now().astimezone().isoformat(timespec="microseconds")
        record.stamp = f"{time.monotonic():.6f} {wall}"
        record.node = self._node
        return super().format(record)


def log_to_stderr(node: str) -> None:
    """Sends what this process logs to standard error, which the supervisor writes to a file."""
    handler = logging.StreamHandler()
    handler.setFormatter(NodeFormatter(node))
    logging.basicConfig(level=logging.INFO, handlers=[handler])


def parse(line: str) -> Stamped | None:
    """A line of a log; None if it has no time stamp, such as a line of a traceback."""
    match = _LINE.fullmatch(line)
    if match is None:
        return None
    monotonic_s, wall, level, node, text = match.groups()
    return Stamped(float(monotonic_s), wall, logging.getLevelNamesMapping()[level], node, text)
