"""The tests of the rows are run by pytest and counted row by row."""

from pathlib import Path

import pytest

from studies.faults.fault_page import FaultRow
from studies.faults.fault_tests import TestsNotRunError, judge, run_tests

TESTS = """
import pytest

@pytest.mark.parametrize("n", [1, 2])
def test_good(n):
    assert n

def test_bad():
    assert 1 == 2, "one is not two"

def test_left_out():
    pytest.skip("no arm here")

@pytest.fixture
def broken():
    raise RuntimeError("no fixture")

def test_with_a_broken_fixture(broken):
    pass
"""


def row(name: str, *tests: str) -> FaultRow:
    return FaultRow(name, "P. Processes", "fault", "answer", tests)


@pytest.mark.parametrize("jobs", [1, 2])
def test_rows_are_told_by_what_their_tests_said(tmp_path: Path, jobs: int) -> None:
    (tmp_path / "test_all.py").write_text(TESTS)
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    rows = [
        row("P1", "test_all.py::test_good"),
        row("P2", "test_all.py::test_good[1]", "test_all.py::test_bad"),
        row("P3", "test_all.py::test_left_out"),
        row("P4", "test_all.py::test_with_a_broken_fixture"),
        row("P5", "absent.py::test_x"),
    ]
    seen: list[tuple[int, int]] = []
    ran = run_tests(rows, tmp_path, lambda *reported: seen.append(reported), jobs)
    results = {result.row.id: result for result in ran}
    assert {name: result.outcome for name, result in results.items()} == {
        "P1": "passed",
        "P2": "failed",
        "P3": "skipped",
        "P4": "failed",
        "P5": "missing",
    }
    assert (results["P1"].passed, results["P2"].passed, results["P2"].failed) == (2, 1, 1)
    assert "one is not two" in results["P2"].message
    assert "no arm here" in results["P3"].message
    assert "no fixture" in results["P4"].message
    assert "there is no absent.py::test_x" in results["P5"].message
    assert seen[-1] == (5, 5)
    assert results["P2"].as_json()["outcome"] == "failed"


def test_pytest_that_runs_nothing_is_told_in_its_own_words(tmp_path: Path) -> None:
    (tmp_path / "test_all.py").write_text(TESTS)
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    with pytest.raises(TestsNotRunError, match="not found"):
        run_tests([row("P1", "test_all.py::test_renamed")], tmp_path, lambda *_: None)


@pytest.mark.parametrize("end", ["os._exit(3)", "os.kill(os.getpid(), signal.SIGKILL)", "pytest.exit('enough')"])
def test_pytest_that_ends_early_is_told_with_how_far_it_came(tmp_path: Path, end: str) -> None:
    test = f"import os, signal, pytest\n\ndef test_ends():\n    {end}\n"
    (tmp_path / "test_all.py").write_text(TESTS + test)
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    rows = [
        row("P1", "test_all.py::test_good"),
        row("P2", "test_all.py::test_ends"),
        row("P3", "test_all.py::test_bad"),
    ]
    with pytest.raises(TestsNotRunError, match=r"ended with -?\d after 2 tests"):
        run_tests(rows, tmp_path, lambda *_: None)


def test_what_a_test_replaces_does_not_reach_its_report(tmp_path: Path) -> None:
    test = "import builtins, pathlib\n\ndef test_replaces(monkeypatch):\n"
    test += "    monkeypatch.setattr(pathlib.Path, 'open', None)\n    monkeypatch.setattr(builtins, 'open', None)\n"
    (tmp_path / "test_all.py").write_text(test)
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    (result,) = run_tests([row("P1", "test_all.py::test_replaces")], tmp_path, lambda *_: None)
    assert result.outcome == "passed"


def test_a_test_that_no_longer_exists_is_missing_even_if_others_of_the_row_pass() -> None:
    reported = [{"test": "a.py::test_x", "outcome": "passed", "message": []}]
    (result,) = judge([row("P1", "a.py::test_x", "a.py::test_gone")], reported)
    assert (result.outcome, result.message) == ("missing", "there is no a.py::test_gone")
