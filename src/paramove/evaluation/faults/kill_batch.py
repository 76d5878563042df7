"""All cases of an evaluation by kills, run by run; results are kept, so that it can be interrupted and gone on with."""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from paramove.evaluation.faults.kill_cases import KillCase, runs_of
from paramove.evaluation.faults.kill_run import InterruptedRunError, KillResult, KillRun


@dataclass(frozen=True)
class KillOptions:
    """How the cases are made.

    Attributes:
        workspace: Root of the workspace.
        folder: Where runs and results are kept.
        jobs: Runs at the same time; each uses about two cores, and times are only those of an idle machine with one.
        seed, pace: Of the world, see `LiveRun`.
    """

    workspace: Path
    folder: Path
    jobs: int = 1
    seed: int = 0
    pace: float = 1.0


def result_file(folder: Path, case: KillCase) -> Path:
    """Where the result of a case is kept."""
    return folder / f"{case.name}.json"


def finished(folder: Path, cases: Sequence[KillCase]) -> dict[str, dict[str, Any]]:
    """Results that are there already, by the cases' names."""
    paths = {case.name: result_file(folder, case) for case in cases}
    return {name: json.loads(path.read_text(encoding="utf-8")) for name, path in paths.items() if path.is_file()}


def run_cases(
    cases: Sequence[KillCase],
    options: KillOptions,
    begun: Callable[[Sequence[KillCase]], None],
    ended: Callable[[KillResult], None],
) -> None:
    """Perform all cases; `begun` and `ended` are called in this thread.

    A KeyboardInterrupt ends the runs under way in order; their cases have no result then.
    """
    options.folder.mkdir(parents=True, exist_ok=True)
    waiting = list(enumerate(runs_of(cases), start=1))
    interrupted = threading.Event()
    with ThreadPoolExecutor(max_workers=options.jobs) as pool:
        running: set[Future[list[KillResult]]] = set()
        try:
            while waiting or running:
                while waiting and len(running) < options.jobs:
                    number, group = waiting.pop(0)
                    begun(group)
                    running.add(pool.submit(_perform, group, number, options, interrupted))
                done, running = wait(running, return_when=FIRST_COMPLETED)
                for result in (result for future in done for result in future.result()):
                    _keep(options.folder, result)
                    ended(result)
        except KeyboardInterrupt:
            interrupted.set()
            raise


def _perform(
    group: Sequence[KillCase], number: int, options: KillOptions, interrupted: threading.Event
) -> list[KillResult]:
    folder = options.folder / "runs" / group[0].name
    domain = f"kills-{os.getpid()}-{number}"
    try:
        return KillRun(options.workspace, folder, domain, options.seed, options.pace, interrupted.is_set).perform(group)
    except InterruptedRunError:
        return []


def _keep(folder: Path, result: KillResult) -> None:
    path = result_file(folder, result.case)
    beside = path.with_suffix(".new")
    beside.write_text(json.dumps(result.as_json(), indent=2, sort_keys=True, ensure_ascii=False) + "\n", "utf-8")
    beside.replace(path)
