"""Another unit, another frame rate, a beginning that is given as a movement: what is reported."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from paramove.hmm import resample
from paramove.phmm import (
    ExtrapolationWarning,
    InterpolativePHMM,
    LinearPHMM,
    MovementClassifier,
    ParametricHMM,
    UnlikelyMovementWarning,
)
from paramove.phmm.plausibility import TrainingRange
from tests.phmm.movements import CLASSES, FEW, shown, wave

every_class = pytest.mark.parametrize("kind", CLASSES, ids=lambda kind: kind.__name__)
UNSEEN = resample(wave(np.array([0.3, 0.7]), np.random.default_rng(77)), 100)


@pytest.fixture(scope="module")
def models() -> dict[type[ParametricHMM], ParametricHMM]:
    sequences, theta = shown(0)
    recorded = [resample(x, 80 + 10 * (number % 5)) for number, x in enumerate(sequences)]
    return {kind: kind(10, options=FEW).fit(recorded, theta) for kind in CLASSES}


@every_class
def test_a_genuine_movement_has_no_remarks(models: dict[type[ParametricHMM], ParametricHMM], kind: type) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        models[kind].estimate(UNSEEN)
        models[kind].predict([UNSEEN])
        models[kind].estimate(UNSEEN[:50], finished=False)
    assert models[kind].remarks(UNSEEN) == ()


@every_class
@pytest.mark.parametrize(
    ("sequence", "words"),
    [(UNSEEN[::3], "34 frames"), (UNSEEN[:40], "40 frames.*complete"), (resample(UNSEEN, 300), "300 frames")],
    ids=["a third of the frame rate", "a beginning", "three times the frame rate"],
)
def test_what_is_hardly_a_movement_is_reported(
    models: dict[type[ParametricHMM], ParametricHMM], kind: type, sequence: np.ndarray, words: str
) -> None:
    with pytest.warns(UnlikelyMovementWarning, match=words):
        models[kind].estimate(sequence)


def test_a_beginning_at_a_third_of_the_frame_rate_is_reported(
    models: dict[type[ParametricHMM], ParametricHMM],
) -> None:
    far = resample(wave(np.array([0.95, 0.95]), np.random.default_rng(7)), 100)
    with pytest.warns(UnlikelyMovementWarning, match=r"[2-9]\.\d times as far"):
        models[LinearPHMM].estimate(far[::3], finished=False)


@every_class
def test_millimetres_for_metres_are_refused(
    models: dict[type[ParametricHMM], ParametricHMM], kind: type, tmp_path: Path
) -> None:
    models[kind].save(tmp_path / "model.npz")
    for model in (models[kind], ParametricHMM.load(tmp_path / "model.npz")):
        with pytest.raises(ValueError, match="unit of the training"):
            model.estimate(1000.0 * UNSEEN)
        with pytest.warns(UnlikelyMovementWarning, match="in their unit"):
            model.estimate(0.001 * UNSEEN)


def test_only_the_model_of_the_action_remarks() -> None:
    slow, theta = shown(0)
    quick = [resample(0.5 * x + 1.0, 20) for x in slow]
    labels = ["slow"] * len(slow) + ["quick"] * len(quick)
    classifier = MovementClassifier(LinearPHMM(8, options=FEW))
    classifier.fit(slow + quick, np.concatenate([theta, theta]), labels)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert classifier.classify(quick[0]).action == "quick"
    with pytest.raises(ValueError, match="unit of the training"):
        classifier.classify(1000.0 * quick[0])


def test_noise_is_no_speed() -> None:
    rng = np.random.default_rng(0)
    seen = TrainingRange.of([UNSEEN])
    assert seen.remarks(UNSEEN + 0.05 * rng.standard_normal(UNSEEN.shape), True) == ()


def test_without_the_range_of_the_training_nothing_is_unusual(
    models: dict[type[ParametricHMM], ParametricHMM], tmp_path: Path
) -> None:
    models[InterpolativePHMM].save(tmp_path / "model.npz")
    with np.load(tmp_path / "model.npz", allow_pickle=False) as stored:
        arrays = {name: stored[name] for name in stored.files if name != "learned_training_range"}
    np.savez(tmp_path / "bare.npz", **arrays)
    bare = ParametricHMM.load(tmp_path / "bare.npz")
    assert bare.training_range_ is None
    assert bare.remarks(UNSEEN[:40]) == ()


def test_theta_far_outside_the_training_warns() -> None:
    rng = np.random.default_rng(0)
    theta = np.repeat(np.linspace(0.0, 1.0, 3), 3)[:, None]
    sequences = [
        np.linspace(0, 1, 60)[:, None] * (one + np.array([1.0, 2.0, 3.0])) + rng.normal(0, 0.01, (60, 3))
        for one in theta
    ]
    model = LinearPHMM(5).fit(sequences, theta)
    for inside in (-1.0, 0.0, 0.5, 2.0):
        model.synthesize([inside], 10)
    for outside in (-1.1, 2.1, 70.0):
        with pytest.warns(ExtrapolationWarning, match="component 1"):
            model.synthesize([outside], 10)
