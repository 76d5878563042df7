"""The logs of a run: lines of all nodes and events of the supervisor, in the order of time."""

from __future__ import annotations

import json
import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from paramove.bus import parse

SUPERVISOR = "supervisor"
LEVELS = {"debug": logging.DEBUG, "info": logging.INFO, "warn": logging.WARNING, "error": logging.ERROR}
_WARNING_EVENTS = frozenset({"suspended", "degraded"})
_ERROR_EVENTS = frozenset({"fault", "failed", "given_up"})
_LOGGED_BY_THE_NODE = frozenset({"ready", "degraded", "failed"})


@dataclass(frozen=True)
class LogLine:
    """One line.

    Attributes:
        monotonic_s: By which lines are put in order; a line without a stamp has that of the line before.
        wall: ISO 8601; empty if no earlier line of its file had a stamp.
        node: Node whose log has the line.
        level: One of logging's numbers.
        text: As it was written; may hold control characters.
    """

    monotonic_s: float
    wall: str
    node: str
    level: int
    text: str


class RunLogs:
    """Reads the logs of a run as they grow.

    Args:
        run_folder: Of the run.
        nodes: Whose logs are read; empty for all, and then the supervisor's events too.
    """

    def __init__(self, run_folder: Path, nodes: Sequence[str] = ()) -> None:
        self._folder = run_folder
        self._nodes = tuple(nodes)
        self._files: dict[Path, _GrowingFile] = {}
        self._last: dict[str, LogLine] = {}
        self.ended = False

    def names(self) -> list[str]:
        """Nodes that have a log in this run."""
        return sorted(path.stem for path in (self._folder / "logs").glob("*.log"))

    def read(self) -> list[LogLine]:
        """Lines that were finished since the last call, in the order of time.

        Sets `ended` once the supervisor has written that the run is over.
        """
        lines = self._events()
        for name in self.names():
            if not self._nodes or name in self._nodes:
                lines += [self._line(name, text) for text in self._grown(self._folder / "logs" / f"{name}.log")]
        return sorted(lines, key=lambda line: line.monotonic_s)

    def _grown(self, path: Path) -> list[str]:
        return self._files.setdefault(path, _GrowingFile(path)).lines()

    def _line(self, name: str, text: str) -> LogLine:
        stamped = parse(text)
        if stamped is not None:
            line = LogLine(stamped.monotonic_s, stamped.wall, name, stamped.level, stamped.text)
        else:  # a traceback, or output of a library
            before = self._last.get(name, LogLine(0.0, "", name, logging.WARNING, ""))
            line = LogLine(before.monotonic_s, before.wall, name, max(before.level, logging.WARNING), text)
        self._last[name] = line
        return line

    def _events(self) -> list[LogLine]:
        lines = []
        for text in self._grown(self._folder / "events.jsonl"):
            try:
                event = json.loads(text)
                self.ended |= event["event"] == "run_ends"
                if event["event"] not in _LOGGED_BY_THE_NODE and (not self._nodes or event.get("node") in self._nodes):
                    lines.append(_event_line(event))
            except (ValueError, KeyError, TypeError):
                continue  # cut off by a full disk
        return lines


def _event_line(event: dict[str, object]) -> LogLine:
    """A line about an event of the supervisor."""
    name, node = str(event["event"]), event.get("node")
    level = logging.INFO
    if name in _WARNING_EVENTS or (name == "ended" and event.get("state") == "restarting"):
        level = logging.WARNING
    if name in _ERROR_EVENTS or (name == "ended" and event.get("state") == "given up"):
        level = logging.ERROR
    if name in ("run_stops", "run_ends") and event.get("exit_code") != 0:
        level = logging.WARNING
    what = event.get("sentence") or ("is requested to end" if name == "asked" else name.replace("_", " "))
    if name == "started":
        what = f"is started, {what}"
    elif name == "ended" and event.get("state") == "stopped":
        what = f"has ended, {what}"
    text = f"{node} {what}" if node else f"{name.replace('_', ' ')}: {what}" if "sentence" in event else str(what)
    return LogLine(float(str(event["monotonic_ns"])) * 1e-9, str(event["wall"]), SUPERVISOR, level, text)


class _GrowingFile:
    """Yields whole lines of a file that other processes append to."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._read = 0
        self._rest = b""

    def lines(self) -> list[str]:
        """Lines that were finished since the last call; none while the file does not exist."""
        try:
            with self._path.open("rb") as file:
                file.seek(self._read)
                new = file.read()
        except FileNotFoundError:
            return []
        self._read += len(new)
        *whole, self._rest = (self._rest + new).split(b"\n")
        return [line.decode("utf-8", errors="replace") for line in whole]
