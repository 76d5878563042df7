"""Runs of arms that take turns at one table are judged in the frame of the first arm."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from paramove.bus import topics
from paramove.recording.writer import RecordingWriter
from paramove.runs import hand_over
from sim import shared_table
from sim.table_arms import TableArms
from tests.sim.test_table_arms import KOCH, PORT, SCENE, TWO

TURNS = """parameters:
  turns:
    - {left: {pick: [0.15, -0.06, 0.012], place: [0.19, 0.0, 0.012]}}
    - {right: {pick: [0.19, 0.0, 0.012], place: [0.15, -0.08, 0.012]}, left: {reach: [0.2, 0.0, 0.1]}}
"""
TABLE = f"parameters: {{arms: {{left: {{robot: {KOCH}}}, right: {{robot: {KOCH}, x: 0.38, yaw_deg: 180}}}}}}\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A run of which only the begin and the end are recorded; a test moves the red cube."""
    (tmp_path / "nodes").mkdir()
    (tmp_path / "nodes" / "turn_taker.yaml").write_text(TURNS)
    (tmp_path / "nodes" / "shared_table.yaml").write_text(TABLE)
    (tmp_path / "nodes" / "judge.yaml").write_text("parameters: {}\n")
    return tmp_path


def record(folder: Path, x: float, y: float) -> None:
    with (
        TableArms(SCENE, TWO | {"right": TWO["right"].model_copy(update={"robot": KOCH})}, folder, PORT) as table,
        RecordingWriter(folder / "truth.mcap", "test") as recording,
    ):
        table.write_model(folder / hand_over.MODEL_FILE)
        first = dict(table.truths(1))
        table.data.joint("red_cube").qpos[:2] = x, y
        last = dict(table.truths(2))
        body = next(one for one in last["left"].objects if one.name == "red_cube")
        body.x, body.y = x, y
        for number, states in enumerate((first, last), 1):
            for name, state in states.items():
                recording.write(topics.name_in(name, "truth/state"), state, number, number, number)


@pytest.mark.parametrize(("x", "y", "code"), [(0.23, 0.083, 0), (0.19, 0.0, 3)])
def test_what_changed_hands_counts_where_the_last_arm_should_put_it(
    folder: Path, x: float, y: float, code: int
) -> None:
    record(folder, x, y)
    assert hand_over.main([str(folder), "--no-video"]) == code
    (task,) = json.loads((folder / "run.json").read_text())["tasks"]
    assert task["thing"] == "red_cube"
    assert task["wanted"] == pytest.approx([0.23, 0.08, 0.012])
    assert task["good"] == (code == 0)
    assert (folder / "report.html").is_file()


def test_the_report_reads_the_model_that_the_table_writes() -> None:
    assert hand_over.MODEL_FILE == shared_table.MODEL_FILE


@pytest.mark.parametrize(
    ("missing", "message"),
    [
        ("table.mjb", "table.mjb: no model"),
        ("nodes/turn_taker.yaml", "turn_taker.yaml has no turns"),
        ("truth.mcap", "nothing to judge"),
    ],
)
def test_what_is_missing_of_a_run_is_named(
    folder: Path, missing: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    record(folder, 0.2, 0.0)
    (folder / missing).unlink()
    assert hand_over.main([str(folder), "--no-video"]) == 66
    assert message in capsys.readouterr().err
