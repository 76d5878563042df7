"""Noise on every frame: how much there is; models that expect it find theta and reject no genuine movement."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from paramove.hmm import resample
from paramove.phmm import (
    CubicPHMM,
    InterpolativePHMM,
    LinearPHMM,
    ModelFileError,
    ParametricHMM,
    QuadraticPHMM,
    has_p_values,
)
from paramove.phmm.noise import (
    AddedNoise,
    NoiseLevel,
    distances_with_noise,
    moving_average,
    noise_variance,
)
from paramove.phmm.performance import Pace, movement_parts, noisy_pace, pace_features
from tests.phmm.movements import shown, trained, wave

NOISE = 0.06
"""Fifteen times the noise of `wave`."""
KINDS: tuple[type[ParametricHMM], ...] = (LinearPHMM, QuadraticPHMM, CubicPHMM, InterpolativePHMM)
every_kind = pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)


@pytest.fixture(scope="module")
def models() -> dict[type[ParametricHMM], ParametricHMM]:
    return {kind: trained(kind) for kind in KINDS}


def unseen(count: int, seed: int) -> tuple[list[np.ndarray], np.ndarray]:
    rng = np.random.default_rng(seed)
    theta = rng.uniform(0.1, 0.9, (count, 2))
    return [wave(one, rng) for one in theta], theta


@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.floats(1e-4, 0.5), st.integers(0, 2**31))
def test_third_differences_tell_the_noise_of_a_smooth_movement(deviation: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    smooth = np.sin(np.linspace(0.0, 3.0, 300)[:, None] * np.arange(1.0, 8.0))
    found = noise_variance(smooth + deviation * rng.standard_normal(smooth.shape))
    assert_allclose(np.sqrt(found), deviation, rtol=0.12)


def test_a_reversal_or_a_gap_is_no_noise() -> None:
    smooth = np.sin(np.linspace(0.0, 3.0, 100)[:, None] * np.arange(1.0, 8.0))
    jumping = smooth + np.where(np.arange(100)[:, None] > 40, 5.0, 0.0)
    turned = np.concatenate([smooth[:50], smooth[49::-1]])
    for x in (jumping, turned):
        assert noise_variance(x) < 2.0 * noise_variance(smooth) + 1e-12


def test_too_few_frames_tell_nothing() -> None:
    rng = np.random.default_rng(0)
    assert noise_variance(rng.standard_normal((3, 21))) == 0.0
    assert noise_variance(rng.standard_normal((6, 3))) == 0.0
    assert noise_variance(rng.standard_normal((6, 21))) > 0.1


def test_only_what_is_clearly_more_than_in_training_counts() -> None:
    sequences, _ = shown(0)
    level, rng = NoiseLevel.of(sequences), np.random.default_rng(1)
    assert all(level.added(one) is None for one in (*sequences, *unseen(20, 5)[0]))
    x = sequences[0]
    assert level.added(x + 0.005 * rng.standard_normal(x.shape)) is None
    assert_allclose(np.sqrt(level.added(x + 0.1 * rng.standard_normal(x.shape)).variance), 0.1, rtol=0.3)


@pytest.mark.parametrize("n_frames", [None, 40, 100, 77])
def test_covariance_of_averages_is_that_of_drawn_noise(n_frames: int | None) -> None:
    """Interpolation to other numbers of frames lowers the noise of a frame and makes neighbours alike."""
    rng = np.random.default_rng(0)
    noise = AddedNoise(0.25, np.zeros((60, 2)), n_frames)

    drawn = 0.5 * rng.standard_normal((4000, 60, 2))
    seen = drawn if n_frames is None else np.stack([resample(one, n_frames) for one in drawn])
    found = np.cov(np.stack([movement_parts(one) for one in drawn]).T)
    expected = noise.of_averages(movement_parts)
    assert_allclose(found, expected, rtol=0.0, atol=0.08 * np.diagonal(expected).max())
    assert_allclose(np.diagonal(found), np.diagonal(expected), rtol=0.12)
    assert_allclose(noise.of_frames, seen.var(), rtol=0.03)


def test_moving_averages_are_means_of_frames_around() -> None:
    x = np.random.default_rng(0).standard_normal((20, 3))
    found, counts = moving_average(x, 5)
    assert_allclose(found[7], x[5:10].mean(axis=0), rtol=1e-9)
    assert_allclose(found[1], x[:3].mean(axis=0), rtol=1e-9)
    assert_allclose([found[0], found[-1]], [x[0], x[-1]], rtol=1e-9)
    assert np.array_equal(counts[[0, 1, 7, 19]], [1.0, 3.0, 5.0, 1.0])


def test_distances_with_noise_are_those_of_drawn_noise() -> None:
    rng = np.random.default_rng(0)
    root = rng.standard_normal((12, 12))
    moments, noise = root @ root.T, np.diag(rng.uniform(0.5, 30.0, 12))
    y = rng.standard_normal((500, 12)) @ root.T
    clean = np.einsum("ki,ij,kj->k", y, np.linalg.inv(moments), y)
    noisy = y + rng.standard_normal(y.shape) * np.sqrt(np.diagonal(noise))
    seen = np.einsum("ki,ij,kj->k", noisy, np.linalg.inv(moments + noise), noisy)
    found = distances_with_noise(clean, moments, moments, noise)
    assert_allclose([found.mean(), found.std()], [seen.mean(), seen.std()], rtol=0.15)
    assert_allclose(distances_with_noise(clean, moments, moments, 1e-12 * noise), clean, rtol=1e-3)


def test_pace_without_its_noise_is_pace() -> None:
    rng = np.random.default_rng(0)
    smooth = np.sin(np.linspace(0.0, 2.0, 200)[:, None] * np.linspace(0.5, 2.0, 21))
    known = Pace(pace_features(smooth), 1e-4 * np.eye(10), np.full(30, 10.0))
    distances = []
    for _ in range(200):
        x = smooth + 0.02 * rng.standard_normal(smooth.shape)
        assert np.abs(noisy_pace(x, 0.02**2).features - pace_features(smooth)).max() < 0.3
        distances.append(known.expecting(0.02**2, x).distance(x))
    assert 7.0 < np.mean(distances) < 16.0
    resting = np.concatenate([smooth[:100], np.repeat(smooth[100:101], 100, axis=0)])
    resting += 0.02 * rng.standard_normal(resting.shape)
    assert known.expecting(0.02**2, resting).distance(resting) > 200.0


@every_kind
def test_a_sequence_without_noise_is_judged_as_if_there_were_none(
    models: dict[type[ParametricHMM], ParametricHMM], kind: type[ParametricHMM], monkeypatch: pytest.MonkeyPatch
) -> None:
    model, sequences = models[kind], unseen(6, 3)[0]
    found = [model.estimate(x) for x in sequences]
    monkeypatch.setattr(model, "training_noise_", None)
    for x, known in zip(sequences, found, strict=True):
        assert all(np.array_equal(one, other) for one, other in zip(model.estimate(x), known, strict=True))


@every_kind
def test_noise_that_is_expected_moves_theta_less_and_regions_hold_it(
    models: dict[type[ParametricHMM], ParametricHMM], kind: type[ParametricHMM], monkeypatch: pytest.MonkeyPatch
) -> None:
    model, (sequences, theta), rng = models[kind], unseen(30, 3), np.random.default_rng(4)
    noisy = [x + NOISE * rng.standard_normal(x.shape) for x in sequences]
    found = [model.estimate(x) for x in noisy]
    inside = [
        (one.theta - place) @ np.linalg.solve(one.covariance, one.theta - place) < 5.991
        for one, place in zip(found, theta, strict=True)
    ]
    assert np.mean(inside) >= 0.8
    monkeypatch.setattr(model, "training_noise_", None)
    unaware = np.array([model.estimate(x).theta for x in noisy])
    errors = np.linalg.norm(np.array([one.theta for one in found]) - theta, axis=1)
    assert errors.mean() < 0.05
    assert errors.mean() <= np.linalg.norm(unaware - theta, axis=1).mean()


@pytest.mark.parametrize("kind", [LinearPHMM, QuadraticPHMM, InterpolativePHMM])
def test_noise_makes_no_genuine_movement_strange_and_no_stopped_one_genuine(
    models: dict[type[ParametricHMM], ParametricHMM], kind: type[ParametricHMM]
) -> None:
    model, rng = models[kind], np.random.default_rng(5)
    assert has_p_values(model)
    genuine = unseen(30, 3)[0]
    stopped = [np.concatenate([x[:20], np.repeat(x[20:21], 20, axis=0)]) for x in genuine]
    share = [
        np.mean([model.examine(x + NOISE * rng.standard_normal(x.shape)).p_value < 0.01 for x in movements])
        for movements in (genuine, stopped)
    ]
    assert share[0] <= 0.1
    assert share[1] >= 0.95
    begun = genuine[0][:30] + NOISE * rng.standard_normal((30, 3))
    assert model.examine(begun, finished=False).p_value > 0.01


@every_kind
def test_the_noise_of_the_training_is_kept_in_files(
    models: dict[type[ParametricHMM], ParametricHMM], kind: type[ParametricHMM], tmp_path: Path
) -> None:
    model, file = models[kind], tmp_path / "model.npz"
    noisy = unseen(1, 3)[0][0] + NOISE * np.random.default_rng(6).standard_normal((40, 3))
    model.save(file)
    again = ParametricHMM.load(file)
    assert again.training_noise_ == model.training_noise_
    assert np.array_equal(again.estimate(noisy).theta, model.estimate(noisy).theta)
    with np.load(file, allow_pickle=False) as stored:
        arrays = {name: stored[name] for name in stored.files}
    np.savez(file, **{**arrays, "learned_training_noise": -np.ones(2)})
    with pytest.raises(ModelFileError, match="expected 2 numbers from 0 on in training_noise"):
        ParametricHMM.load(file)
    del arrays["learned_training_noise"]
    np.savez(file, **arrays)
    assert ParametricHMM.load(file).training_noise_ is None
