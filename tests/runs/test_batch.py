"""Batches of runs: seeds, kept results, totals."""

import json
import sys
from dataclasses import replace

import pytest

from paramove.runs.batch import BatchOptions, SeedsError, finished, result_file, run_batch, seeds_of
from paramove.runs.batch_table import enough, table_of, totals_of


def test_seeds_are_read():
    assert seeds_of("7") == [7]
    assert seeds_of("0-3, 9,2") == [0, 1, 2, 3, 9]


@pytest.mark.parametrize("text", ["", "a", "3-1", "1-", "-1", "1.5"])
def test_other_texts_are_refused(text):
    with pytest.raises(SeedsError, match="0-9"):
        seeds_of(text)


def result(seed, success=True, **values):
    return {"seed": seed, "success": success, "run_folder": "", "settings": []} | values


def test_results_of_other_settings_are_not_used(tmp_path):
    result_file(tmp_path, 1).write_text(json.dumps(result(1)))
    result_file(tmp_path, 2).write_text(json.dumps(result(2, settings=["camera.width=100"])))
    options = BatchOptions(tmp_path, tmp_path)
    assert list(finished([0, 1, 2], options)) == [1]
    assert list(finished([0, 1, 2], replace(options, settings=("camera.width=100",)))) == [2]
    assert list(finished([0, 1, 2], replace(options, robot="koch_v1_1"))) == []


def test_totals_and_enough():
    results = [result(seed, seed != 3, objects_placed=3, homography_error_mm={"median": seed}) for seed in range(10)]
    totals = totals_of(results)
    assert (totals["runs"], totals["succeeded"]) == (10, 9)
    assert totals["objects_placed (total)"] == 30
    assert totals["homography_error_mm.median (median)"] == 4.5
    assert totals["wall.realtime_factor (median)"] is None
    assert enough(results)
    assert not enough([*results, result(10, False)])
    assert not enough([])
    assert table_of(results).row_count == 10


def hull(tried, succeeded, rejected=0):
    counts = {"tried": tried, "succeeded": succeeded, "refused": rejected}
    return {"from": {"inside": counts, "outside": {"tried": 3, "succeeded": 3, "refused": 0}}}


def test_relocations_within_and_outside_the_training_are_told_apart():
    results = [
        result(0, training_hull=hull(2, 2)),
        result(1, training_hull=hull(3, 2)),
        result(2, training_hull=hull(0, 0)),
        result(3, training_hull=hull(1, 1, rejected=1)),
        result(4),  # of an earlier release
    ]
    inside = totals_of(results)["training_hull.from"]["inside"]
    assert inside == {"tried": 6, "succeeded": 5, "refused": 1, "runs": 3, "runs_all_succeeded": 2}
    table = table_of(results)
    column = next(one for one in table.columns if one.header == "inside\nhull")
    assert (list(column.cells), column.footer) == (["2/2", "2/3", "0/0", "1/1", "–"], "5/6")


LAUNCHER = """
import json, pathlib, sys
arguments = dict(word[2:].split("=", 1) for word in sys.argv if word.startswith("--") and "=" in word)
run = pathlib.Path(arguments["runs"]) / "one"
run.mkdir(parents=True)
(run.parent / "latest").symlink_to("one")
(run / "run.json").write_text(json.dumps({"seed": int(arguments["seed"]), "success": True, "objects_placed": 3}))
sys.exit(int(arguments["seed"]) % 2 and 130)
"""


def test_each_seed_runs_in_processes_of_its_own_and_interrupted_ones_are_not_kept(tmp_path, monkeypatch):
    """A launcher that only writes a run.json stands in for the real one."""
    fake = tmp_path / "workspace"
    (fake / "paramove" / "cli").mkdir(parents=True)
    for package in (fake / "paramove", fake / "paramove" / "cli"):
        (package / "__init__.py").write_text("")
    (fake / "paramove" / "cli" / "main.py").write_text(LAUNCHER)
    monkeypatch.setenv("PYTHONPATH", str(fake))
    options = BatchOptions(fake, tmp_path / "kept", jobs=2)
    begun, ended = [], []
    run_batch([0, 1, 2], options, begun.append, ended.append)
    assert begun == [0, 1, 2]
    assert sorted((item["seed"], item["success"]) for item in ended) == [(0, True), (1, False), (2, True)]
    assert list(finished(range(3), options)) == [0, 2]
    assert sys.executable  # the same interpreter is used for the runs
