"""Model files that are sound, and yet of no use to the robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paramove.demonstrations import reaching
from paramove.demonstrations.reaching import train_reaching_model
from paramove.motion.reaching_file import load_reaching_model
from paramove.phmm import InterpolativePHMM, ModelFileError, MovementDescription, ParameterGrid, PolynomialPHMM
from tests.motion.reaching import reaching_model
from tests.motion.touching import DESCRIPTION, touches, touching_model

Change = Callable[[InterpolativePHMM], object]


def _described(**changes: Any) -> Change:
    def change(model: InterpolativePHMM) -> None:
        model.description = replace(model.description or MovementDescription(), **changes)

    return change


def _in_millimetres(model: InterpolativePHMM) -> None:
    model.means_ *= 1000.0
    model.grid_ = ParameterGrid(model.grid_.origin * 1000.0, model.grid_.edges * 1000.0, model.grid_.knots)


def _of_two_coordinates(model: InterpolativePHMM) -> None:
    grid = model.grid_
    model.grid_ = ParameterGrid(grid.origin[:2], grid.edges[:2, :2], grid.knots[:2])
    model.means_, model.covariances_ = model.means_[::2], model.covariances_[::2]
    model.durations_, model.parameter_bounds_ = model.durations_[::2], np.zeros((2, 2))
    model.log_frames_, model.residuals, model.performances_ = np.zeros(3), "independent", None


def _standing_still(model: InterpolativePHMM) -> None:
    model.means_[:] = model.means_.mean(axis=(0, 1))


def _without_targets(model: InterpolativePHMM) -> None:
    model.grid_ = ParameterGrid(model.grid_.origin + np.array([1.0, 0.0, 0.0]), model.grid_.edges, model.grid_.knots)
    model.means_[:] = model.means_.mean(axis=0) + 1e-9 * np.arange(8)[:, None, None]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_described(unit="mm"), "expected points in m, found 'mm'"),
        (_described(frame="camera"), "expected points in the frame 'demonstrator_table' .* found 'camera'"),
        (_described(point_names=("hand",) * 7), "needed also: shoulder, elbow"),
        (_described(point_names=("shoulder", "elbow", "knuckle", "index", "thumb")), "expected 15 numbers a frame"),
        (_described(arrival=-1.0), "gives arrival -1.0"),
        (_described(arrival=0.6), "a reaching action has 0 < arrival < grasp < 1"),
        (_in_millimetres, "expected an arm of 0.3 to 1.2 m, found 6"),
        (_of_two_coordinates, "expected a grid of targets with 3 coordinates, found 2"),
        (_standing_still, "expected a hand that opens and closes"),
        (_without_targets, "expected a movement that reaches different targets"),
    ],
)
def test_what_a_robot_cannot_use_is_refused_with_the_remedy(tmp_path: Path, change: Change, words: str) -> None:
    path = tmp_path / "reaching.npz"
    reaching_model().save(path)
    model = InterpolativePHMM.load(path)
    change(model)
    model.save(path)
    with pytest.raises(ModelFileError, match=words) as rejection:
        load_reaching_model(path)
    detail = str(rejection.value)
    assert detail.startswith(f"{path}: ")
    assert "Remedy: train it again: leave out the node's parameter movement.file" in detail
    assert "\n" not in detail
    assert not rejection.value.missing


def test_the_trained_model_is_of_use(tmp_path: Path) -> None:
    path = tmp_path / "reaching.npz"
    reaching_model().save(path)
    assert load_reaching_model(path).get_params() == reaching_model().get_params()


def test_a_missing_file_comes_with_the_remedy(tmp_path: Path) -> None:
    with pytest.raises(ModelFileError, match=r"there is no model file .* Remedy: train it again") as rejection:
        load_reaching_model(tmp_path / "none.npz")
    assert rejection.value.missing


def test_a_damaged_cache_is_trained_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cache = tmp_path / "reaching_0.npz"
    reaching_model().save(cache)
    cache.write_bytes(cache.read_bytes()[:5000])

    def asked(*_: Any, **__: Any) -> None:
        raise InterruptedError("demonstrations are asked for")

    monkeypatch.setattr(reaching, "reaching_grid_demonstrations", asked)
    with pytest.raises(InterruptedError, match="demonstrations are asked for"):
        train_reaching_model(0, cache=cache)


def test_a_model_of_touching_is_of_use(tmp_path: Path) -> None:
    path = tmp_path / "touching.npz"
    touching_model().save(path)
    assert load_reaching_model(path).get_params() == touching_model().get_params()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"unit": "mm"}, "expected points in m, found 'mm'"),
        ({"frame": "camera"}, "expected points in the frame 'demonstrator_table' or 'body' .* found 'camera'"),
        (
            {"point_names": ("shoulder", "elbow", "index", "thumb")},
            "expected 12 numbers a frame for 4 points, found 15",
        ),
        ({"arrival": 0.5, "grasp": 0.4}, "a reaching action has 0 < arrival < grasp < 1, or arrival 1 if it ends"),
    ],
)
def test_a_model_of_touching_that_does_not_suit(tmp_path: Path, changes: dict[str, Any], words: str) -> None:
    path = tmp_path / "touching.npz"
    touching_model().save(path)
    model = PolynomialPHMM.load(path)
    model.description = replace(model.description or MovementDescription(), **changes)
    model.save(path)
    with pytest.raises(ModelFileError, match=words) as rejection:
        load_reaching_model(path)
    assert "Remedy: train it again" in str(rejection.value)


def test_a_model_of_other_parameters_is_refused(tmp_path: Path) -> None:
    sequences, theta = touches(1)
    model = PolynomialPHMM(20, 2, 3, degree=1, resampled_frames=50, residuals="independent", description=DESCRIPTION)
    model.fit(sequences, theta[:, :2]).save(tmp_path / "two.npz")
    with pytest.raises(ModelFileError, match="expected targets with 3 coordinates, found 2"):
        load_reaching_model(tmp_path / "two.npz")


def test_a_movement_that_only_points_at_its_targets_is_refused(tmp_path: Path) -> None:
    sequences, theta = touches(1)
    model = PolynomialPHMM(20, 2, 3, degree=1, resampled_frames=50, residuals="independent", description=DESCRIPTION)
    model.fit(sequences, theta + np.array([1.5, 0.0, 0.0])).save(tmp_path / "pointing.npz")
    with pytest.raises(ModelFileError, match=r"reaches its targets, found 1\.4\d* m from"):
        load_reaching_model(tmp_path / "pointing.npz")


def test_a_movement_that_is_the_same_for_all_targets_is_refused(tmp_path: Path) -> None:
    touching_model().save(tmp_path / "still.npz")
    model = PolynomialPHMM.load(tmp_path / "still.npz")
    model.coefficients_[..., 1:] = 0.0
    model.save(tmp_path / "still.npz")
    with pytest.raises(ModelFileError, match="expected a movement that reaches different targets"):
        load_reaching_model(tmp_path / "still.npz")
