"""Many runs of an application, one per seed, each in processes and a domain of its own; finished ones are stored."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from paramove.documents import exit_codes, replacing
from paramove.runs.recorded_run import judged
from paramove.supervision import node_environment
from paramove.workspace import Workspace

APPLICATION = "rule_learning"
EVALUATOR = "paramove.runs.rule_learning"
INTERRUPTED = tuple(exit_codes.by_signal(number) for number in (signal.SIGHUP, signal.SIGINT, signal.SIGTERM))


class SeedsError(ValueError):
    """A text that names no seeds; the message has the valid forms."""


@dataclass(frozen=True)
class BatchOptions:
    """How the runs are made.

    Attributes:
        workspace: Root of the workspace.
        folder: Where the runs and results are stored.
        jobs: Runs at the same time.
        video: Whether each run gets its video and report (and takes longer).
        keep_recordings: Whether the recordings are kept; a run takes about 0.5 GB.
        settings: `node.parameter=value`, as `paramove launch --set`.
        overlays: As `paramove launch --with`; none: the launch file's own.
        robot: As `paramove launch --robot`.
    """

    workspace: Path
    folder: Path
    jobs: int = 1
    video: bool = False
    keep_recordings: bool = True
    settings: tuple[str, ...] = ()
    overlays: tuple[str, ...] = ()
    robot: str | None = None


def seeds_of(text: str) -> list[int]:
    """Seeds of "0-9" or "3,5,10-12", in order and each once; raises SeedsError."""
    seeds: list[int] = []
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        if not first.isdecimal() or (dash and not last.isdecimal()) or (dash and int(last) < int(first)):
            raise SeedsError(f"{part.strip()!r} names no seeds; write 7, 0-9 or 3,5,10-12")
        seeds.extend(range(int(first), int(last or first) + 1))
    return list(dict.fromkeys(seeds))


def result_file(folder: Path, seed: int) -> Path:
    """Where the result of a seed is stored."""
    return folder / f"seed_{seed:04d}.json"


def finished(seeds: Iterable[int], options: BatchOptions) -> dict[int, dict[str, Any]]:
    """Results that are there already and were made with the same settings, overlays and robot."""
    wanted = (list(options.settings), list(options.overlays), options.robot)
    results = {}
    for seed in seeds:
        path = result_file(options.folder, seed)
        if path.is_file():
            result = json.loads(path.read_text(encoding="utf-8"))
            if (result.get("settings", []), result.get("overlays", []), result.get("robot")) == wanted:
                results[seed] = result
    return results


def run_batch(
    seeds: Sequence[int], options: BatchOptions, begun: Callable[[int], None], ended: Callable[[dict[str, Any]], None]
) -> None:
    """Run every seed; `begun` and `ended` are called in this thread and in the order of the end.

    A KeyboardInterrupt ends the runs under way in order and leaves the finished results.
    """
    options.folder.mkdir(parents=True, exist_ok=True)
    waiting = list(seeds)
    children = Children()
    with ThreadPoolExecutor(max_workers=options.jobs) as pool:
        running: dict[Future[dict[str, Any]], int] = {}
        try:
            while waiting or running:
                while waiting and len(running) < options.jobs:
                    seed = waiting.pop(0)
                    begun(seed)
                    running[pool.submit(run_seed, seed, options, children)] = seed
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    del running[future]
                    ended(future.result())
        except KeyboardInterrupt:
            children.interrupt()
            raise


def run_seed(seed: int, options: BatchOptions, children: Children) -> dict[str, Any]:
    """One run and its evaluation; the result is stored unless the run was interrupted."""
    runs = options.folder / f"seed_{seed:04d}"
    environment = os.environ | {"PARAMOVE_DOMAIN": f"eval-{os.getpid()}-{seed}"}
    launch = [
        sys.executable,
        "-P",
        "-m",
        "paramove.cli.main",
        "launch",
        APPLICATION,
        f"--seed={seed}",
        f"--runs={runs}",
    ]
    launch += [f"--set={setting}" for setting in options.settings]
    launch += [f"--with={overlay}" for overlay in options.overlays]
    launch += [] if options.robot is None else [f"--robot={options.robot}"]
    launch += [] if options.video else ["--headless"]
    launched = children.call(launch, options.workspace, environment, options.folder / f"seed_{seed:04d}.log")
    folder = (runs / "latest").resolve()
    result: dict[str, Any] = {
        "seed": seed,
        "settings": list(options.settings),
        "overlays": list(options.overlays),
        "robot": options.robot,
        "exit_code": launched,
        "run_folder": str(folder),
    }
    if launched in INTERRUPTED or launched < 0:
        return result | {"success": False, "reason": "interrupted"}
    if (folder / "truth.mcap").is_file() and not (folder / "run.json").is_file():
        evaluate = [sys.executable, "-P", "-m", EVALUATOR, str(folder)]
        evaluate += [] if options.video else ["--no-video", "--no-report"]
        searched = node_environment(environment, Workspace.at(options.workspace))
        children.call(evaluate, options.workspace, searched, options.folder / f"seed_{seed:04d}.log")
    result |= judged(folder / "run.json", "the run ended before it could be evaluated; see its logs")
    with replacing(result_file(options.folder, seed)) as unfinished:
        text = json.dumps(result, indent=2, sort_keys=True, ensure_ascii=False)
        unfinished.write_text(text + "\n", encoding="utf-8")
    if not options.keep_recordings and result["success"]:
        (folder / "recording.mcap").unlink(missing_ok=True)
    return result


class Children:
    """Processes under way. They do not receive the terminal's Ctrl-C, but one signal from `interrupt`."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._running: set[subprocess.Popen[bytes]] = set()
        self._interrupted = False

    def call(self, command: list[str], folder: Path, environment: dict[str, str], log: Path) -> int:
        """Run a command to its end, its output added to `log`; returns its exit code."""
        with log.open("ab") as out:
            with self._lock:
                if self._interrupted:
                    return exit_codes.by_signal(signal.SIGINT)
                process = subprocess.Popen(
                    command,
                    cwd=folder,
                    env=environment,
                    stdin=subprocess.DEVNULL,
                    stdout=out,
                    stderr=out,
                    start_new_session=True,
                )
                self._running.add(process)
            code = process.wait()
            with self._lock:
                self._running.discard(process)
        return code

    def interrupt(self) -> None:
        """Ask all to end in order, and start no more."""
        with self._lock:
            self._interrupted = True
            for process in self._running:
                process.send_signal(signal.SIGINT)
