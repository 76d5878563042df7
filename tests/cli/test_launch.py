"""`paramove launch --check`: what is found before anything starts."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from paramove.cli.main import build
from paramove.documents import exit_codes

ROOT = Path(__file__).parents[2]


def test_a_robot_that_is_not_its_model_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    robot = tmp_path / "koch"
    shutil.copytree(ROOT / "robot_description/koch_v1_1", robot)
    text = (robot / "robot.yaml").read_text(encoding="utf-8")
    (robot / "robot.yaml").write_text(text.replace("end_effector: end_effector", "end_effector: tip"), encoding="utf-8")
    answer = CliRunner().invoke(build("launch"), ["launch", "dynamixel_arm", "--robot", str(robot), "--check"])
    assert answer.exit_code == exit_codes.CONFIGURATION, answer.output
    assert "no site 'tip'" in answer.output
    assert "end_effector" in answer.output
