import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from studies.__main__ import app
from tests.demonstrations.synthetic_recordings import write_pointing, write_table


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("studies.movements.command.user_cache_path", lambda name: tmp_path / "cache")
    write_table(tmp_path / "data")
    write_pointing(tmp_path / "data")
    return tmp_path


def test_real(folder: Path) -> None:
    arguments = ["real", "--data", str(folder / "data"), "--out", str(folder / "out"), "--task", "table/across"]
    result = CliRunner().invoke(app, [*arguments, "--method", "linear", "--json", str(folder / "numbers.json")])
    assert result.exit_code == 0, result.output
    assert "table/across" in result.output
    assert (folder / "out" / "report.html").is_file()
    numbers = json.loads((folder / "numbers.json").read_text(encoding="utf-8"))
    assert list(numbers) == ["table/across"]
    (row,) = numbers["table/across"].values()
    assert row["folds"] == 3
    assert row["measures"]["end"]["value"] < 5.0


def test_no_recordings(folder: Path) -> None:
    result = CliRunner().invoke(app, ["real", "--data", str(folder / "nowhere"), "--out", str(folder / "out")])
    assert result.exit_code == 66
    assert "nowhere" in result.output


def test_no_such_method(folder: Path) -> None:
    result = CliRunner().invoke(app, ["real", "--method", "oracle"])
    assert result.exit_code == 2
    assert "quadratic" in result.output


def test_peers_that_are_not_installed_are_named(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from studies.movements import sweep

    monkeypatch.setattr(sweep, "missing_libraries", lambda row: list(row.libraries))
    result = CliRunner().invoke(app, ["peers", "--on", "raster", "--out", str(folder / "out")])
    assert result.exit_code == 66
    assert "sktime" in result.output
    assert "paramove[peers]" in result.output
