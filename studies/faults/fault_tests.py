"""Runs the tests of the table of faults, and reports the result of each row."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from studies.faults.fault_page import FaultRow
from studies.faults.pytest_results import FILE_VARIABLE

ROOT = Path(__file__).parents[2]
LOOK_S = 0.2
_ALL_RAN = (0, 1)  # exit codes of pytest; the others: interrupted, internal error, wrong use, no tests


class TestsNotRunError(RuntimeError):
    """pytest did not run all tests; the message is its own."""

    __test__ = False


@dataclass(frozen=True)
class RowResult:
    """The result of the tests of a row.

    Attributes:
        outcome: "passed" (all that ran), "failed", "skipped" (all) or "missing" (there is no such test).
        passed, failed, skipped: How many tests.
        message: Of the first failure or skip.
    """

    row: FaultRow
    outcome: str
    passed: int
    failed: int
    skipped: int
    message: str

    def as_json(self) -> dict[str, Any]:
        """Plain values."""
        counts = {"passed": self.passed, "failed": self.failed, "skipped": self.skipped}
        facts = {"id": self.row.id, "fault": self.row.fault, "what_happens": self.row.answer}
        return facts | {"tests": list(self.row.tests), "outcome": self.outcome, "message": self.message} | counts


def run_tests(
    rows: Sequence[FaultRow], workspace: Path, progress: Callable[[int, int], None], jobs: int = 1
) -> list[RowResult]:
    """Run the tests of the rows, each once.

    Args:
        rows: Of the page.
        workspace: Root of the workspace.
        progress: Gets how many tests are done, and of how many.
        jobs: Tests at the same time.

    Raises:
        TestsNotRunError: pytest itself failed.
    """
    chosen = list(
        dict.fromkeys(test for row in rows for test in row.tests if (workspace / test.split("::")[0]).exists())
    )
    with tempfile.TemporaryDirectory(prefix="paramove-faults-") as folder:
        file = Path(folder) / "results.jsonl"
        file.touch()
        command = [sys.executable, "-m", "pytest", "-q", "--no-header", "--tb=line", "--continue-on-collection-errors"]
        command += ["-p", "no:cacheprovider", "-p", "studies.faults.pytest_results", *chosen]
        command += ["-n", str(jobs), "--dist", "worksteal"] if jobs > 1 else []
        search_path = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])  # the plugin too
        environment = os.environ | {FILE_VARIABLE: str(file), "PYTHONPATH": search_path}
        with (Path(folder) / "output").open("w+", encoding="utf-8") as output:
            process = subprocess.Popen(
                command, cwd=workspace, env=environment, stdout=output, stderr=output, stdin=subprocess.DEVNULL
            )
            try:
                _follow(process, file, progress)
            finally:
                if process.poll() is None:
                    process.terminate()
                process.wait()
            reported = [line for line in _read(file) if "test" in line]
            if process.returncode not in _ALL_RAN or not reported:
                output.seek(0)
                printed = output.read()[-2000:]
                raise TestsNotRunError(
                    f"pytest ended with {process.returncode} after {len(reported)} tests:\n{printed}"
                )
    return judge(rows, reported)


def judge(rows: Iterable[FaultRow], reported: Sequence[dict[str, Any]]) -> list[RowResult]:
    """The results of the rows, from one dict per test: `test`, `outcome`, `message`."""
    results = []
    for row in rows:
        own = [line for line in reported if any(_is_of(line["test"], test) for test in row.tests)]
        missing = [test for test in row.tests if not any(_is_of(line["test"], test) for line in reported)]
        counts = {name: sum(line["outcome"] == name for line in own) for name in ("passed", "failed", "skipped")}
        worst = next((line for name in ("failed", "skipped") for line in own if line["outcome"] == name), None)
        message = " ".join(worst["message"]) if worst else ""
        if missing:
            outcome, message = "missing", f"there is no {', '.join(missing)}"
        elif counts["failed"]:
            outcome = "failed"
        else:
            outcome = "passed" if counts["passed"] else "skipped"
        results.append(RowResult(row, outcome, counts["passed"], counts["failed"], counts["skipped"], message))
    return results


def _is_of(name: str, test: str) -> bool:
    return name == test or name.startswith((test + "[", test + "::"))


def _follow(process: subprocess.Popen[bytes], file: Path, progress: Callable[[int, int], None]) -> None:
    while True:
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(LOOK_S)
        reported = _read(file)
        done = {line["test"] for line in reported if "test" in line}
        progress(len(done), max((line["collected"] for line in reported if "collected" in line), default=0))
        if process.returncode is not None:
            return


def _read(file: Path) -> list[dict[str, Any]]:
    text = file.read_text(encoding="utf-8")
    return [json.loads(line) for line in text[: text.rfind("\n") + 1].splitlines()]
