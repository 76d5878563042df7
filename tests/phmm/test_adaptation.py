"""A model of other persons, adapted to a new person by three movements."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.hmm import NotFittedError, resample
from paramove.phmm import LinearPHMM, ParametricHMM, QuadraticPHMM
from paramove.phmm.adaptation import Adaptation
from paramove.phmm.features import Monomials
from tests.phmm.movements import CLASSES, FEW, raster, wave

every_class = pytest.mark.parametrize("kind", CLASSES, ids=lambda kind: kind.__name__)


class Person:
    """Moves as `wave`, from another place and with a size and a pace of their own."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng([seed, 8])
        self.offset, self.size = 0.15 * rng.standard_normal(3), 1.0 + 0.1 * rng.standard_normal()
        self.n_frames = int(rng.integers(60, 140))

    def moved(self, theta: np.ndarray, seed: int) -> list[np.ndarray]:
        rng = np.random.default_rng([seed, 9])
        return [self.offset + self.size * resample(wave(one, rng), self.n_frames) for one in theta]


@pytest.fixture(scope="module")
def trained() -> dict[type[ParametricHMM], ParametricHMM]:
    theta = raster(3, 2, 1)
    sequences = [x for person in range(6) for x in Person(person).moved(theta, person)]
    labels, groups = np.tile(theta, (6, 1)), np.repeat(np.arange(6), len(theta))
    return {kind: kind(10, options=FEW).fit(sequences, labels, groups) for kind in CLASSES}


SHOWN = np.array([[0.2, 0.2], [0.8, 0.3], [0.5, 0.9]])
ASKED = np.random.default_rng(5).uniform(0.05, 0.95, (30, 2))


def errors(model: ParametricHMM, person: Person) -> tuple[float, float, float]:
    """Of synthesis and theta, and how many of the 95 % regions hold theta."""
    moved = person.moved(ASKED, 77)
    made = [
        np.sqrt(((model.synthesize(one, person.n_frames) - x) ** 2).mean()) for one, x in zip(ASKED, moved, strict=True)
    ]
    found = [model.estimate(x) for x in moved]
    missed = [one.theta - truth for one, truth in zip(found, ASKED, strict=True)]
    inside = [m @ np.linalg.solve(one.covariance, m) < 5.99 for m, one in zip(missed, found, strict=True)]
    return float(np.mean(made)), float(np.linalg.norm(missed, axis=1).mean()), float(np.mean(inside))


@every_class
def test_three_movements_of_a_person_are_enough(
    trained: dict[type[ParametricHMM], ParametricHMM], kind: type[ParametricHMM], tmp_path: Path
) -> None:
    model, person = trained[kind], Person(51)
    before = model.natural_frames(ASKED).mean()
    adapted = model.adapt(person.moved(SHOWN, 1), SHOWN)
    (synthesis, theta, _), (own_synthesis, own_theta, inside) = errors(model, person), errors(adapted, person)
    assert own_synthesis < 0.6 * synthesis
    assert own_theta < 0.8 * theta
    assert inside >= 0.8
    assert abs(adapted.natural_frames(ASKED).mean() - person.n_frames) < abs(before - person.n_frames)
    begun = [x[: len(x) // 2] for x in person.moved(ASKED, 78)]
    early, unadapted = (
        np.mean([np.linalg.norm(one.estimate(x, finished=False).theta - t) for x, t in zip(begun, ASKED, strict=True)])
        for one in (adapted, model)
    )
    assert early < 1.15 * unadapted  # increments know no place anyway
    adapted.save(tmp_path / "own.npz")
    again = ParametricHMM.load(tmp_path / "own.npz")
    x = person.moved(ASKED[:1], 79)[0]
    assert np.array_equal(again.estimate(x).theta, adapted.estimate(x).theta)
    assert np.array_equal(model.synthesize([0.5, 0.5]), trained[kind].synthesize([0.5, 0.5]))


def test_without_labels_only_synthesis_adapts(trained: dict[type[ParametricHMM], ParametricHMM]) -> None:
    model, person = trained[QuadraticPHMM], Person(51)
    adapted = model.adapt(person.moved(SHOWN, 1))
    assert errors(adapted, person)[0] < errors(model, person)[0]
    x = person.moved(ASKED[:1], 3)[0]
    assert_allclose(adapted.estimate(x).theta, model.estimate(x).theta, rtol=0.0, atol=0.0)
    assert_allclose(adapted.estimate(x).covariance, model.estimate(x).covariance, rtol=0.0, atol=0.0)


def test_many_movements_outweigh_the_prior() -> None:
    monomials, rng = Monomials.of_degree(2, np.array([[-1.0, -1.0], [1.0, 1.0]])), np.random.default_rng(0)
    theta = rng.uniform(-1.0, 1.0, (400, 2))
    truth = np.zeros((4, 6))
    truth[:, :3] = rng.standard_normal((4, 3))
    adaptation = Adaptation.of(monomials, theta)
    assert_allclose(adaptation.change(monomials.at(theta) @ truth.T), truth, rtol=0.0, atol=0.05)
    assert np.diagonal(adaptation.uncertainty).max() < 0.01
    assert_allclose(Adaptation.of(monomials, theta[:1]).change(np.zeros((1, 4))), 0.0, atol=0.0)


def test_what_does_not_fit_is_named(trained: dict[type[ParametricHMM], ParametricHMM]) -> None:
    model, shown = trained[LinearPHMM], Person(51).moved(SHOWN, 1)
    with pytest.raises(NotFittedError):
        LinearPHMM().adapt(shown, SHOWN)
    with pytest.raises(ValueError, match=r"expected shape \(3, P\), found \(2, 2\)"):
        model.adapt(shown, SHOWN[:2])
    with pytest.raises(ValueError, match="theta has 2 finite components"):
        model.adapt(shown, [0.1, 0.2, 0.3])
    with pytest.raises(ValueError, match="3 dimensions per frame, the sequence has 2"):
        model.adapt([one[:, :2] for one in shown], SHOWN)
    with pytest.raises(ValueError, match="unit of the training"):
        model.adapt([1000.0 * one for one in shown], SHOWN)
    with pytest.raises(ValueError, match="no sequences"):
        model.adapt([], np.zeros((0, 2)))
