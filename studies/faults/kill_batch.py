"""All cases of an evaluation by kills, run by run; results are stored, so that an interrupted one continues."""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from paramove.documents import replacing
from studies.faults.kill_cases import KillCase, runs_of
from studies.faults.kill_run import InterruptedRunError, KillResult, KillRun

ATTEMPTS = 3


@dataclass(frozen=True)
class KillOptions:
    """How the cases are made.

    Attributes:
        workspace: Root of the workspace.
        folder: Where runs and results are stored.
        jobs: Runs at the same time; each uses about two cores, and times are only those of an idle machine with one.
        seed, pace: Of the world, see `LiveRun`.
    """

    workspace: Path
    folder: Path
    jobs: int = 1
    seed: int = 0
    pace: float = 1.0


def result_file(folder: Path, case: KillCase) -> Path:
    """Where the result of a case is stored."""
    return folder / f"{case.name}.json"


def finished(folder: Path, cases: Sequence[KillCase]) -> dict[str, dict[str, Any]]:
    """Stored results, by the cases' names."""
    paths = {case.name: result_file(folder, case) for case in cases}
    return {name: json.loads(path.read_text(encoding="utf-8")) for name, path in paths.items() if path.is_file()}


def run_cases(
    cases: Sequence[KillCase],
    options: KillOptions,
    begun: Callable[[Sequence[KillCase]], None],
    ended: Callable[[KillResult], None],
) -> None:
    """Perform all cases; `begun` and `ended` are called in this thread.

    A case whose run ended before its phase began is repeated in another run, up to three times in all.
    A KeyboardInterrupt ends the current runs in order; their cases have no result then.
    """
    options.folder.mkdir(parents=True, exist_ok=True)
    waiting = [(group, 1) for group in runs_of(cases)]
    interrupted = threading.Event()
    with ThreadPoolExecutor(max_workers=options.jobs) as pool:
        running: dict[Future[list[KillResult]], int] = {}
        try:
            while waiting or running:
                while waiting and len(running) < options.jobs:
                    group, attempt = waiting.pop(0)
                    begun(group)
                    running[pool.submit(_perform, group, attempt, options, interrupted)] = attempt
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    attempt = running.pop(future)
                    again = [result.case for result in future.result() if result.not_sent and attempt < ATTEMPTS]
                    waiting += [(group, attempt + 1) for group in runs_of(again)]
                    for result in future.result():
                        if result.case not in again:
                            _store(options.folder, result)
                            ended(result)
        except KeyboardInterrupt:
            interrupted.set()
            raise


def _perform(
    group: Sequence[KillCase], attempt: int, options: KillOptions, interrupted: threading.Event
) -> list[KillResult]:
    folder = options.folder / "runs" / f"{group[0].name}-{attempt}"
    domain = f"kills-{os.getpid()}-{group[0].name.lower()}-{attempt}"[:40]
    try:
        return KillRun(options.workspace, folder, domain, options.seed, options.pace, interrupted.is_set).perform(group)
    except InterruptedRunError:
        return []


def _store(folder: Path, result: KillResult) -> None:
    with replacing(result_file(folder, result.case)) as unfinished:
        text = json.dumps(result.as_json(), indent=2, sort_keys=True, ensure_ascii=False)
        unfinished.write_text(text + "\n", encoding="utf-8")
