"""`python -m studies chapter4 --quick`: the whole chain on one seed."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from paramove.documents.exit_codes import JUDGED_A_FAILURE
from studies.__main__ import app
from studies.chapter4.experiments import QUICK, experiments


@pytest.mark.long
def test_quick_writes_a_report_that_needs_no_other_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("studies.chapter4.command.user_cache_path", lambda name: tmp_path / "cache")
    arguments = [
        "chapter4",
        "--quick",
        "--seeds",
        "1",
        "--out",
        str(tmp_path),
        "--json",
        str(tmp_path / "numbers.json"),
    ]
    answer = CliRunner().invoke(app, arguments)
    numbers = json.loads((tmp_path / "numbers.json").read_text(encoding="utf-8"))
    met = [target["met"] for target in numbers["targets"]]
    assert answer.exit_code == (0 if all(met) else JUDGED_A_FAILURE), answer.output
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert f"{sum(met)} of {len(met)} goals met" in page
    assert page.count("<svg") == page.count("</svg>") >= 8
    assert [word for word in ("src='http", "href='http", "<script", "<link", "nan<") if word in page] == []
    assert json.loads((tmp_path / "chapter4.json").read_text(encoding="utf-8")) == numbers
    theta = {row["name"]: row["theta"][0] for row in numbers["models"]}
    assert max(value for name, value in theta.items() if "3×3" in name) < 2.5
    files = list((tmp_path / "cache" / "chapter4").glob("*.json"))
    assert len(files) == len(experiments([1], QUICK, with_hmmlearn=False))
