from pathlib import Path

import pytest

from studies.movements import sweep
from studies.movements.sweep import (
    ClusterMissingError,
    Row,
    fold_digest,
    jobs_of,
    missing_libraries,
    run_jobs,
)
from studies.movements.tasks import Fold
from tests.studies.movements.conftest import MeanPath

ROW = Row("mean path", lambda seed: MeanPath())


def chosen(tasks: dict[str, list[Fold]]) -> dict[str, list[Fold]]:
    return {name: tasks[name] for name in ("table/across", "table/actions")}


def without_seconds(results: list[dict[str, object]]) -> list[dict[str, object]]:
    return [{key: value for key, value in result.items() if key != "seconds"} for result in results]


def test_interrupted_it_goes_on_where_it_was(tasks: dict[str, list[Fold]], tmp_path: Path) -> None:
    jobs = jobs_of([ROW], chosen(tasks))

    def interrupt(done: int, total: int, name: str) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_jobs(jobs, tmp_path, finished=interrupt)
    assert len(list(tmp_path.glob("*.json"))) == 2
    heard: list[int] = []
    results = run_jobs(jobs, tmp_path, finished=lambda done, total, name: heard.append(done))
    assert heard == [2, 3, 4, 5, 6]
    assert [(r["task"], r["fold"]) for r in results] == [(j.fold.task, j.fold.name) for j in jobs]
    assert run_jobs(jobs, tmp_path) == results


def test_a_cut_off_file_is_computed_again(tasks: dict[str, list[Fold]], tmp_path: Path) -> None:
    jobs = jobs_of([ROW], {"table/across": tasks["table/across"]})
    results = run_jobs(jobs, tmp_path)
    for file in tmp_path.glob("*.json"):
        file.write_text(file.read_text()[:20])
    assert without_seconds(run_jobs(jobs, tmp_path)) == without_seconds(results)


def test_another_parameter_another_datum_another_code(
    tasks: dict[str, list[Fold]], monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = tasks["table/across"][:2]
    (job, *_) = jobs_of([ROW], {"table/across": [first]})
    (other, *_) = jobs_of([Row("mean path", ROW.make, "alpha=2")], {"table/across": [first]})
    digest = fold_digest(first)
    assert job.key(digest) == job.key(fold_digest(first))
    assert len({job.key(digest), other.key(digest), job.key(fold_digest(second))}) == 3
    before = job.key(digest)
    monkeypatch.setattr(sweep, "code_digest", lambda *modules: "edited")
    assert job.key(digest) != before


@pytest.mark.long
def test_several_processes_find_the_same(tasks: dict[str, list[Fold]], tmp_path: Path) -> None:
    jobs = jobs_of([ROW], {"table/across": tasks["table/across"]})
    alone = run_jobs(jobs, tmp_path / "alone")
    together = run_jobs(jobs, tmp_path / "together", workers=2)
    assert without_seconds(alone) == without_seconds(together)


def test_a_cluster_finds_the_same(tasks: dict[str, list[Fold]], tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="Dask is not installed: pip install 'paramove[cluster]'")
    jobs = jobs_of([ROW], {"table/across": tasks["table/across"]})
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None, host="127.0.0.1", protocol="tcp"
    ) as cluster:
        there = run_jobs(jobs, tmp_path / "there", scheduler=cluster.scheduler_address)
    assert without_seconds(there) == without_seconds(run_jobs(jobs, tmp_path / "here"))


def test_nobody_answers(tasks: dict[str, list[Fold]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweep, "TIMEOUT_S", 1.0)
    jobs = jobs_of([ROW], {"table/across": tasks["table/across"]})
    with pytest.raises(ClusterMissingError, match=r"127\.0\.0\.1:9"):
        run_jobs(jobs, tmp_path, scheduler="127.0.0.1:9")


def test_missing_libraries_are_named() -> None:
    assert missing_libraries(Row("x", ROW.make, libraries=("numpy", "no-such-package"))) == ["no-such-package"]
