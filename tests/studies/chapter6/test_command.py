"""`python -m studies chapter6`: what it asks for, what it prints, and its exit codes."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from paramove.documents.exit_codes import JUDGED_A_FAILURE
from sim.persons import clips
from studies.__main__ import app
from studies.chapter6 import experiments, report
from tests.studies.chapter6.synthetic_tracks import result


def run(*arguments: str, width: str = "200"):
    return CliRunner().invoke(app, ["chapter6", *arguments], env={"COLUMNS": width})


@pytest.fixture
def synthetic(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """All clips are there, tracks come from nowhere and are exact with all cameras."""
    monkeypatch.setattr("studies.chapter6.command.user_cache_path", lambda name: tmp_path / "cache")
    monkeypatch.setattr(experiments, "_is_there", lambda folder: True)
    monkeypatch.setattr(experiments, "_clip_digest", str)
    monkeypatch.setattr(experiments, "train", lambda selection, data: None)
    monkeypatch.setattr(clips, "read_clip", lambda folder: None)
    monkeypatch.setattr(report, "strip", lambda clip, shown, title: "")
    monkeypatch.setattr(experiments.Piece, "run", exact)
    return tmp_path


def exact(piece: experiments.Piece):
    return result(piece.kind, piece.number, piece.views, piece.likelihood)


def test_missing_clips_end_with_66_and_the_command_that_renders_them(tmp_path: Path) -> None:
    answer = run("--kind", "pointing", "--clips", str(tmp_path))
    assert answer.exit_code == 66
    assert f"python -m sim.performances --kind pointing --out {tmp_path}" in answer.stderr


def test_an_unknown_kind_is_a_wrong_use(tmp_path: Path) -> None:
    answer = run("--kind", "juggling", "--clips", str(tmp_path))
    assert answer.exit_code == 2
    assert "pouring" in answer.stderr


def test_met_goals_end_with_0_and_are_written(synthetic: Path) -> None:
    numbers = synthetic / "numbers.json"
    arguments = (
        "--kind",
        "pointing",
        "--first",
        "2",
        "--quick",
        "--out",
        str(synthetic / "out"),
        "--json",
        str(numbers),
    )
    answer = run(*arguments, "--jobs", "1")
    assert answer.exit_code == 0, answer.output
    assert "more goals are not judged" in answer.output
    stored = json.loads(numbers.read_text(encoding="utf-8"))
    assert all(goal["met"] in (True, None) for goal in stored["goals"])
    assert (synthetic / "out" / "report.html").is_file()
    assert json.loads((synthetic / "out" / "chapter6.json").read_text(encoding="utf-8")) == stored
    assert len(list((synthetic / "cache" / "chapter6" / "tracks").glob("*.json"))) == 2


def test_finished_tracks_are_kept_when_it_is_interrupted(synthetic: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []

    def interrupted(piece: experiments.Piece):
        calls.append(piece.label)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return exact(piece)

    monkeypatch.setattr(experiments.Piece, "run", interrupted)
    arguments = ("--kind", "pointing", "--quick", "--jobs", "1", "--out", str(synthetic / "out"))
    answer = run(*arguments)
    assert answer.exit_code == 130
    assert str(synthetic) in answer.output
    assert run(*arguments).exit_code == 0
    assert len(calls) == 3, "the first track is not computed again"


def test_a_missed_goal_ends_with_3(synthetic: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def off(piece: experiments.Piece):
        return result(piece.kind, piece.number, piece.views, piece.likelihood, error=(0.05, 0.0, 0.0))

    monkeypatch.setattr(experiments.Piece, "run", off)
    answer = run("--kind", "pouring", "--quick", "--jobs", "1", "--out", str(synthetic / "out"))
    assert answer.exit_code == JUDGED_A_FAILURE
    assert "5.00 cm" in answer.output
