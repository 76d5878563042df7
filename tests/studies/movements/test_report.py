import json
from pathlib import Path

import pytest

from studies.movements.report import leading, write_report
from studies.movements.summary import QUANTITIES, Measured, summarised
from studies.movements.sweep import Row, jobs_of, run_jobs
from studies.movements.tasks import Fold
from tests.studies.movements.conftest import MeanPath

BY_NAME = {quantity.name: quantity for quantity in QUANTITIES}


def rows(name: str, **found: tuple[float, float, float]) -> dict[str, dict[str, object]]:
    return {row: {"measures": {name: Measured(*values)}} for row, values in found.items()}


def test_leading_are_the_best_and_whom_its_interval_does_not_exclude() -> None:
    found = rows("theta", a=(1.0, 0.5, 1.5), b=(1.4, 1.0, 2.0), c=(1.6, 1.2, 2.0))
    assert leading(found, BY_NAME["theta"]) == {"a", "b"}
    found = rows("correct", a=(90.0, 85.0, 95.0), b=(84.0, 80.0, 99.0))
    assert leading(found, BY_NAME["correct"]) == {"a"}


def test_more_coverage_than_promised_does_not_lead() -> None:
    found = rows("covered", a=(100.0, 99.0, 100.0), b=(93.0, 90.0, 96.0), c=(4.0, 1.0, 9.0))
    assert leading(found, BY_NAME["covered"]) == {"b"}


@pytest.mark.long
def test_page_and_numbers(tasks: dict[str, list[Fold]], tmp_path: Path) -> None:
    row = Row("mean <path>", lambda seed: MeanPath(), ours=True)
    summary = summarised(run_jobs(jobs_of([row], tasks), tmp_path / "cache"))
    page = write_report(summary, tmp_path, title="A & B", ours=frozenset([row.name]), notes=["left out: x"])
    text = page.read_text(encoding="utf-8")
    assert "<h1>A &amp; B</h1>" in text
    assert "mean &lt;path&gt;" in text
    assert "left out: x" in text
    assert text.count("<svg") == len(tasks)
    assert "http" not in text.replace("http://www.w3.org", "").replace("http://purl.org", "").replace(
        "http://creativecommons.org", ""
    )
    numbers = json.loads((tmp_path / "movements.json").read_text(encoding="utf-8"))
    assert set(numbers) == set(tasks)
    assert numbers["table/across"][row.name]["measures"]["theta"]["value"] > 0.0
