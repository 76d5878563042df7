"""Putting a planner together from files that do not fit."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from paramove.motion import setup
from paramove.motion.setup import MovementSource, plans_for
from paramove.robots import SurfaceParameters
from paramove.robots.description import DescriptionError
from tests.motion.reaching import ROBOT_FOLDER, at, reaching_model
from tests.motion.touching import touching_model


@pytest.fixture
def movement(tmp_path: Path) -> MovementSource:
    reaching_model().save(tmp_path / "reaching.npz")
    return MovementSource(file=tmp_path / "reaching.npz")


def test_an_arm_that_the_robot_lacks_is_named(movement: MovementSource) -> None:
    with pytest.raises(DescriptionError, match="describes the arms right, left, found side 'middle'"):
        plans_for(ROBOT_FOLDER, "middle", movement, SurfaceParameters())


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("<mujoco", "<mujko", "XML"),
        ('<site name="right_gripper"', '<site name="gripper"', "right_gripper|site"),
        ('joint name="right_elbow"', 'joint name="elbow"', "right_elbow"),
    ],
)
def test_a_model_file_without_what_the_description_names(
    tmp_path: Path, movement: MovementSource, old: str, new: str, words: str
) -> None:
    folder = tmp_path / "robot"
    shutil.copytree(ROBOT_FOLDER, folder)
    model = folder / "hoap3.xml"
    text = model.read_text(encoding="utf-8")
    assert old in text
    model.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(DescriptionError, match=f"hoap3.xml (does not fit|has no) .*({words})"):
        plans_for(folder, "right", movement, SurfaceParameters())


def test_movement_is_trained_where_nothing_can_be_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The cache folder cannot be made because a file is in its place."""
    (tmp_path / "taken").touch()
    asked: list[object] = []
    monkeypatch.setattr(setup, "user_cache_path", lambda name: tmp_path / "taken" / name)
    monkeypatch.setattr(setup, "train_reaching_model", lambda seed, cache=None: asked.append((seed, cache)))
    MovementSource(seed=3).trained()
    assert asked == [(3, None)]
    assert "cannot be stored in" in caplog.text


def test_a_file_and_a_model_are_too_much() -> None:
    with pytest.raises(
        ValidationError, match=r"give either a file or a model, found file one\.npz and model 'table_reach'"
    ):
        MovementSource(file=Path("one.npz"), model="table_reach")


def test_the_named_model_is_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[object] = []
    monkeypatch.setattr(setup, "user_cache_path", lambda name: tmp_path / name)
    monkeypatch.setattr(setup, "people_model", lambda *arguments: asked.append(arguments))
    MovementSource(model="table_reach").trained()
    assert asked == [("table_reach", tmp_path / "paramove")]
    with pytest.raises(ValidationError, match="Input should be 'synthetic' or 'table_reach'"):
        MovementSource.model_validate({"model": "table_tennis"})


def test_a_file_of_people_drives_the_arm(tmp_path: Path) -> None:
    touching_model().save(tmp_path / "touching.npz")
    source = MovementSource(file=tmp_path / "touching.npz")
    plans = plans_for(ROBOT_FOLDER, "right", source, SurfaceParameters())
    motion = plans.fetch(at((0.178, 0.0)), np.zeros((0, 2)))
    assert motion.phases[0][0] == "approach"
