"""`python -m studies kills` and `faults`: choices, tables, exit codes. Nothing is killed here."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from studies.__main__ import app
from studies.faults.kill_batch import result_file
from studies.faults.kill_cases import Expected, KillCase

RUNNER = CliRunner()
CASES = [KillCase(node, "KILL", "rest", Expected.GOES_ON) for node in ("camera", "recorder")]
HEAD = "## P. Processes\n\n| id | fault | what happens | test |\n|---|---|---|---|\n"


def keep(folder: Path, case: KillCase, **facts: object) -> None:
    result = {
        "case": {"node": case.node, "signal": case.signal, "moment": case.moment, "expected": case.expected.value},
        "run_folder": "/tmp/run",
        "report_ms": 4.0,
        "restart_s": 0.52,
        "ready_s": 2.0,
        "end_s": None,
        "exit_code": None,
        "sentence": "",
        "step": {"share": 0.5},
        "pace": 1.0,
        "problems": [],
        "late": [],
        "not_sent": "",
        "passed": True,
    }
    result_file(folder, case).write_text(json.dumps(result | facts))


def test_results_that_are_there_are_shown_and_no_run_is_made(tmp_path: Path) -> None:
    for case in CASES:
        keep(tmp_path, case)
    wanted = ["--nodes", "camera,recorder", "--signals", "KILL", "--moments", "rest"]
    shown = RUNNER.invoke(app, ["kills", *wanted, "--runs", str(tmp_path), "--json", str(tmp_path / "all.json")])
    assert shown.exit_code == 0, shown.output
    assert "results of 2 cases are taken" in " ".join(shown.output.split())
    assert "2/2" in shown.output
    assert [case["case"]["node"] for case in json.loads((tmp_path / "all.json").read_text())["cases"]] == [
        "camera",
        "recorder",
    ]


def test_a_case_that_failed_or_was_late_is_told_and_gives_exit_code_3(tmp_path: Path) -> None:
    keep(tmp_path, CASES[0], problems=["the arm is hold, not armed"], passed=False)
    keep(tmp_path, CASES[1], late=["reported after 80 ms, allowed 50 ms"], passed=False)
    wanted = ["--nodes", "camera,recorder", "--signals", "KILL", "--moments", "rest"]
    shown = RUNNER.invoke(app, ["kills", *wanted, "--runs", str(tmp_path)])
    assert shown.exit_code == 3
    assert "camera KILL rest: the arm is hold, not armed (/tmp/run)" in shown.output
    assert "recorder KILL rest: reported after 80 ms, allowed 50 ms (/tmp/run)" in shown.output


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [("--nodes", "cam", "no node 'cam'"), ("--signals", "TERM", "no signal"), ("--moments", "x", "no moment 'x'")],
)
def test_unknown_names_are_refused(option: str, value: str, words: str) -> None:
    shown = RUNNER.invoke(app, ["kills", option, value])
    assert shown.exit_code == 2
    assert words in shown.output


def workspace(folder: Path, rows: str) -> Path:
    for name in ("launch", "nodes", "docs", "tests"):
        (folder / name).mkdir()
    (folder / "pytest.ini").write_text("[pytest]\n")
    (folder / "tests" / "test_it.py").write_text("def test_good(): pass\n\n\ndef test_bad(): assert 0, 'oh no'\n")
    (folder / "docs" / "faults.md").write_text(HEAD + rows)
    return folder


def test_the_table_of_faults_is_printed_with_results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(workspace(tmp_path, "| P1 | killed | back | `tests/test_it.py::test_good` |\n"))
    shown = RUNNER.invoke(app, ["faults", "--json", "-"])
    assert shown.exit_code == 0, shown.output
    assert "1 faults: 1 passed" in shown.output


def test_a_fault_whose_test_fails_gives_exit_code_3(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = "| P1 | a | b | `tests/test_it.py::test_good` |\n| P2 | c | d | `tests/test_it.py::test_bad` |\n"
    monkeypatch.chdir(workspace(tmp_path, rows))
    shown = RUNNER.invoke(app, ["faults", "--section", "P"])
    assert shown.exit_code == 3
    assert "1 passed, 1 failed" in shown.output
    assert "P2: " in shown.output
    assert "oh no" in shown.output
    assert RUNNER.invoke(app, ["faults", "--section", "Z"]).exit_code == 2


def test_a_page_that_cannot_be_read_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(workspace(tmp_path, "| P1 | a | b | by hand |\n"))
    shown = RUNNER.invoke(app, ["faults"])
    assert shown.exit_code == 78
    (tmp_path / "docs" / "faults.md").unlink()
    assert RUNNER.invoke(app, ["faults"]).exit_code == 66
