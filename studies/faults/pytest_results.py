"""A pytest plugin (`-p studies.faults.pytest_results`) that reports each test's result as a line of JSON.

The lines go to the file that the environment variable PARAMOVE_FAULT_RESULTS names. With several processes
(`pytest -n`) each worker reports how many tests there are, and the one that collects the results reports these.
"""

from __future__ import annotations

import json
import os
from typing import Any

FILE_VARIABLE = "PARAMOVE_FAULT_RESULTS"
_OPEN = open
_is_worker = False


def pytest_configure(config: Any) -> None:
    """Whether this process runs tests for another one."""
    global _is_worker
    _is_worker = hasattr(config, "workerinput")


def pytest_collection_finish(session: Any) -> None:
    """All tests are known: how many."""
    _say({"collected": len(session.items)})


def pytest_runtest_logreport(report: Any) -> None:
    """A phase of a test has ended: a failure in any phase counts, success only of the test itself."""
    if not _is_worker and (report.when == "call" or report.outcome != "passed"):
        message = getattr(getattr(report.longrepr, "reprcrash", None), "message", "") or ""
        if report.outcome == "skipped" and isinstance(report.longrepr, tuple):
            message = str(report.longrepr[2])
        _say({"test": report.nodeid, "outcome": report.outcome, "message": message.splitlines()[:1]})


def _say(facts: dict[str, Any]) -> None:
    # Nothing of Path: what a test has replaced is put back only after its report.
    with _OPEN(os.environ[FILE_VARIABLE], "a", encoding="utf-8") as file:
        file.write(json.dumps(facts) + "\n")
