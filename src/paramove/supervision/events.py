"""Events of a run as lines of JSON, for measurements: `events.jsonl` in the run folder."""

from __future__ import annotations

import datetime
import json
import logging
import os
import signal
import time
from pathlib import Path
from typing import Any, Self

_log = logging.getLogger(__name__)


class EventLog:
    """Appends events to a file; `write` gives each to the kernel, so that it survives the end of the launcher.

    One line is an object with `monotonic_ns` (CLOCK_MONOTONIC, the same for all processes of this machine), `wall`
    (ISO 8601), `event`, and what is known of `node`, `state`, `sentence`, `pid`, `exit_code`, `signal`.

    Args:
        path: Of the file; made if it does not exist.
    """

    def __init__(self, path: Path) -> None:
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o600)
        self._broken = False
        self._cut = b""  # ends a line that a full disk has cut off

    def write(self, event: str, **facts: Any) -> None:
        """Appends one event; facts that are None are left out. A full disk is logged once each time."""
        monotonic_ns = time.monotonic_ns()
        wall = datetime.datetime.now().astimezone().isoformat(timespec="microseconds")
        known = {name: value for name, value in facts.items() if value is not None}
        line = json.dumps({"monotonic_ns": monotonic_ns, "wall": wall, "event": event, **known}, ensure_ascii=False)
        left = self._cut + line.encode("utf-8", errors="backslashreplace") + b"\n"
        try:
            while left:
                left = left[os.write(self._file, left) :]
                self._cut = b"\n" if left else b""
            self._broken = False
        except OSError as error:
            if not self._broken:
                _log.warning("the log of events cannot be written: %s", error.strerror)
            self._broken = True

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._file)


def signal_name(code: int | None) -> str | None:
    """Name of the signal in an exit code of a process (negative, as in `subprocess`), else None."""
    if code is None or code >= 0:
        return None
    try:
        return signal.Signals(-code).name
    except ValueError:  # a real-time signal
        return f"signal {-code}"
