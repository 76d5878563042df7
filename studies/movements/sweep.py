"""Runs all jobs of a comparison, on this machine or on a cluster, and stores each result.

A job is one row (method with parameters and seed) on one fold. Its result is a small file under a name that follows
from the row, the data, and the source code that makes it: an interrupted comparison continues, and
a change of code or data gives other names.
"""

from __future__ import annotations

import hashlib
import importlib
import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Protocol

from paramove.documents import replacing
from paramove.linear_algebra_threads import ONE_THREAD
from paramove.source_code import code_digest
from studies.movements.method import Method
from studies.movements.tasks import Fold
from studies.movements.trial import able, measure

TIMEOUT_S = 10.0
"""How long a cluster's scheduler may take to answer."""


class ClusterMissingError(RuntimeError):
    """No cluster can be used: the library is missing or no scheduler answers."""


@dataclass(frozen=True)
class Row:
    """A line of the comparison.

    Attributes:
        name: in reports.
        make: an unfitted method for a seed.
        parameters: everything else that decides the result, as text: the name alone may stay when they change.
        libraries: packages of others whose versions do.
        seeds: repetitions for methods with chance in them.
        ours: whether it is this project's.
    """

    name: str
    make: Callable[[int], Method]
    parameters: str = ""
    libraries: tuple[str, ...] = ()
    seeds: tuple[int, ...] = (0,)
    ours: bool = False


class Work(Protocol):
    """What can be run and stored."""

    @property
    def label(self) -> str:
        """Shown by the progress bar."""

    def run(self) -> dict[str, Any]:
        """The result: plain JSON with "values"."""


@dataclass(frozen=True)
class Job:
    """A row on a fold with a seed."""

    row: Row
    fold: Fold
    seed: int

    @property
    def label(self) -> str:
        """Shown by the progress bar."""
        return f"{self.row.name}: {self.fold.task} {self.fold.name}"

    def key(self, data: str) -> str:
        """Name of the result's file; `data` is the digest of the fold."""
        parts = [self.row.name, self.row.parameters, str(self.seed), self.fold.task, self.fold.name, data]
        parts.append(code_digest(measure.__module__, self.row.make.__module__))
        parts += [f"{name} {_version(name)}" for name in ("numpy", "scipy", *self.row.libraries)]
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:32]

    def run(self) -> dict[str, Any]:
        """Measure; the result is plain JSON."""
        result = measure(self.row.make(self.seed), self.fold)
        return {"row": self.row.name, "seed": self.seed, **result}


def jobs_of(rows: Sequence[Row], tasks: Mapping[str, Sequence[Fold]]) -> list[Job]:
    """All jobs of rows that can do some of the tasks of the folds."""
    jobs: list[Job] = []
    for folds in tasks.values():
        for row in rows:
            if folds and able(row.make(0), folds[0]):
                jobs += [Job(row, fold, seed) for seed in row.seeds for fold in folds]
    return jobs


def run_jobs(
    jobs: Sequence[Job],
    cache: Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    finished: Callable[[int, int, str], None] = lambda done, total, name: None,
) -> list[dict[str, Any]]:
    """Results of all jobs in their order; `finished` gets how many are done, of how many, and the last name.

    Finished results stay in `cache` after an interruption. With `scheduler` (host:port of a Dask scheduler) the
    cluster computes. Raises ClusterMissingError without one.
    """
    return run_stored(jobs, keys_of(jobs), cache, workers=workers, scheduler=scheduler, finished=finished)


def keys_of(jobs: Sequence[Job]) -> list[str]:
    """Names under which the jobs' results are stored."""
    digests = {id(fold): fold_digest(fold) for fold in {id(job.fold): job.fold for job in jobs}.values()}
    return [job.key(digests[id(job.fold)]) for job in jobs]


def run_stored(
    work: Sequence[Work],
    keys: Sequence[str],
    cache: Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    finished: Callable[[int, int, str], None] = lambda done, total, name: None,
) -> list[dict[str, Any]]:
    """As `run_jobs`, for any work whose result is plain JSON with "values"; a key names the file of each result."""
    cache.mkdir(parents=True, exist_ok=True)
    files = [cache / f"{key}.json" for key in keys]
    results: dict[int, dict[str, Any]] = {}
    missing: list[int] = []
    for index, file in enumerate(files):
        stored = _stored(file)
        if stored is None:
            missing.append(index)
        else:
            results[index] = stored
    finished(len(results), len(work), "")
    for index, result in _computed([(i, work[i]) for i in missing], workers, scheduler):
        _store(files[index], result)
        results[index] = result
        finished(len(results), len(work), work[index].label)
    return [results[index] for index in range(len(work))]


def _computed(
    jobs: Sequence[tuple[int, Work]], workers: int, scheduler: str | None
) -> Iterator[tuple[int, dict[str, Any]]]:
    if not jobs:
        return
    if workers == 1 and scheduler is None:
        for index, job in jobs:
            yield index, job.run()
        return
    joblib = importlib.import_module("joblib")
    with _cluster(scheduler):
        parallel = joblib.Parallel(
            n_jobs=-1 if scheduler else workers,
            return_as="generator_unordered",
            pre_dispatch="3 * n_jobs",
            max_nbytes=None,
        )
        yield from parallel(joblib.delayed(_numbered)(index, job) for index, job in jobs)
    if scheduler is None:  # else the interpreter's end finds their semaphores and warns
        importlib.import_module("joblib.externals.loky").get_reusable_executor().shutdown(wait=True)


def _numbered(index: int, job: Work) -> tuple[int, dict[str, Any]]:
    _one_thread()
    return index, job.run()


def _one_thread() -> None:
    """Workers share the processors: a second thread in one of them only takes from another."""
    for name in (*ONE_THREAD, "NUMBA_NUM_THREADS"):
        os.environ.setdefault(name, "1")


@contextmanager
def _cluster(scheduler: str | None) -> Iterator[None]:
    """While inside, joblib's jobs run on the cluster."""
    if scheduler is None:
        yield
        return
    try:
        distributed = importlib.import_module("distributed")
    except ImportError as error:
        raise ClusterMissingError(
            f"--scheduler needs Dask: pip install 'paramove[cluster]' brings it ({error})"
        ) from error
    joblib = importlib.import_module("joblib")
    try:
        client = distributed.Client(scheduler, timeout=TIMEOUT_S, set_as_default=True)
    except (OSError, ValueError) as error:
        raise ClusterMissingError(f"no Dask scheduler answers at {scheduler}: {error}") from error
    with client, joblib.parallel_config(backend="dask"):
        yield


def missing_libraries(row: Row) -> list[str]:
    """Packages that a row needs and that are not installed."""
    return [name for name in row.libraries if _version(name) == "none"]


def fold_digest(fold: Fold) -> str:
    """Digest of all numbers and labels of a fold."""
    digest = hashlib.sha256(f"{fold.kind} {fold.train.tip} {fold.beginnings}".encode())
    for examples in (fold.train, fold.test):
        digest.update(repr((examples.labels, examples.rate_hz, examples.groups.tolist())).encode())
        digest.update(examples.theta.tobytes())
        for x in examples.sequences:
            digest.update(x.tobytes())
    for x in fold.others:
        digest.update(x.tobytes())
    return digest.hexdigest()


@lru_cache
def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "none"


def _stored(file: Path) -> dict[str, Any] | None:
    """A result from its file; None where there is none or it was cut off while it was written."""
    try:
        result = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return result if isinstance(result, dict) and "values" in result else None


def _store(file: Path, result: dict[str, Any]) -> None:
    with replacing(file) as unfinished:
        unfinished.write_text(json.dumps(result), encoding="utf-8")
