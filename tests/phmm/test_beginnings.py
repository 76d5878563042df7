"""Beginnings of movements: theta while a movement goes on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from paramove.documents import Floats
from paramove.phmm import ParametricHMM, QuadraticPHMM
from paramove.phmm.beginnings import FIRST_FRAMES, FRACTIONS, Beginnings

SIZE = np.array([0.8, 0.3])


def movements(seed: int, repetitions: int, *, common_start: bool = True) -> tuple[list[Floats], Floats]:
    """Reaches of various durations from about one start (or from anywhere, by an increment) to 4 x 4 places."""
    rng = np.random.default_rng(seed)
    theta = np.array([(u, v) for u in np.linspace(0, 1, 4) for v in np.linspace(0, 1, 4) for _ in range(repetitions)])
    sequences = []
    for place in theta:
        s = np.linspace(0.0, 1.0, int(rng.integers(40, 71)))[:, None]
        progress = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        start = (0.002 if common_start else 0.3) * rng.standard_normal(2)
        moved = np.append(place * SIZE, 0.3 + 0.2 * place[0])
        lift = np.append(0.0, 0.1) * np.sin(np.pi * progress)
        path = progress * moved
        path[:, :2] += start + lift
        sequences.append(path + 0.001 * rng.standard_normal(path.shape))
    return sequences, theta


def fitted(seed: int, repetitions: int = 3, **kind: bool) -> QuadraticPHMM:
    return QuadraticPHMM(resampled_frames=100).fit(*movements(seed, repetitions, **kind))


def errors(model: QuadraticPHMM, fraction: float, **kind: bool) -> Floats:
    """Of theta after that fraction of unseen movements, m."""
    sequences, theta = movements(99, 2, **kind)
    found = [model.estimate(x[: round(fraction * len(x))], finished=False).theta for x in sequences]
    return np.linalg.norm((np.array(found) - theta) * SIZE, axis=1)


@pytest.fixture(scope="module")
def model() -> QuadraticPHMM:
    return fitted(1)


def test_theta_becomes_exact_while_the_movement_goes_on(model: QuadraticPHMM) -> None:
    means = [float(errors(model, fraction).mean()) for fraction in (0.4, 0.7, 1.0)]
    assert means[0] < 0.08
    assert means[1] < 0.02
    assert means[2] < 0.01


def test_regions_cover_theta_of_unseen_movements(model: QuadraticPHMM) -> None:
    sequences, theta = movements(98, 4)
    for fraction in (0.3, 0.6, 0.9):
        found = [model.estimate(x[: round(fraction * len(x))], finished=False) for x in sequences]
        missed = [one.theta - place for one, place in zip(found, theta, strict=True)]
        inside = [d @ np.linalg.solve(one.covariance, d) < 5.991 for d, one in zip(missed, found, strict=True)]
        assert np.mean(inside) >= 0.85


def test_increments_are_chosen_where_movements_begin_anywhere(model: QuadraticPHMM) -> None:
    free = fitted(2, common_start=False)
    assert free.performances_ is not None
    assert model.performances_ is not None
    assert free.performances_.beginnings.increments
    assert not model.performances_.beginnings.increments
    assert errors(free, 0.9, common_start=False).mean() < 0.03


def test_a_beginning_that_takes_longer_than_any_movement_is_examined(model: QuadraticPHMM) -> None:
    sequences, theta = movements(97, 1)
    held = np.concatenate([sequences[5], np.repeat(sequences[5][-1:], 200, axis=0)])
    examined = model.examine(held, finished=False)
    assert np.isfinite(examined.estimate.theta).all()
    assert examined.p_value < 0.01
    whole = model.examine(sequences[5], finished=False)
    assert whole.p_value > 0.01
    assert np.linalg.norm((whole.estimate.theta - theta[5]) * SIZE) < 0.02


def test_too_short_a_beginning_is_refused_with_the_number_it_needs(model: QuadraticPHMM) -> None:
    sequences, _ = movements(97, 1)
    with pytest.raises(ValueError, match=f"{FIRST_FRAMES} frames, found {FIRST_FRAMES - 1}"):
        model.estimate(sequences[0][: FIRST_FRAMES - 1], finished=False)
    assert np.isfinite(model.estimate(sequences[0][:FIRST_FRAMES], finished=False).covariance).all()


def test_beginnings_survive_a_file(model: QuadraticPHMM, tmp_path: Path) -> None:
    model.save(tmp_path / "model.npz")
    again = ParametricHMM.load(tmp_path / "model.npz")
    begun = movements(97, 1)[0][3][:30]
    assert np.array_equal(again.estimate(begun, finished=False).theta, model.estimate(begun, finished=False).theta)


@pytest.mark.parametrize("scalars", [np.zeros(2), np.zeros((3, 1))])
def test_damaged_arrays_are_refused(model: QuadraticPHMM, scalars: Floats) -> None:
    assert model.performances_ is not None
    arrays = model.performances_.beginnings.arrays()
    with pytest.raises(ValueError, match="3 numbers in beginnings"):
        Beginnings.from_arrays(arrays | {"beginnings": scalars}, model.monomials_)
    del arrays[f"beginning{len(FRACTIONS) - 1}_root"]
    with pytest.raises(KeyError):
        Beginnings.from_arrays(arrays, model.monomials_)
