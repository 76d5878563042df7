"""What is learned about whole demonstrations: outlier scores and p-values, of tiny and shuffled training sets too."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.phmm import LinearPHMM, ParametricHMM, QuadraticPHMM
from paramove.phmm.performance import movement_parts, pace_features
from tests.phmm.movements import shown, trained, untrained, wave
from tests.phmm.table import table_movements


def test_distances_of_parts_and_of_pace_belong_to_the_same_movement() -> None:
    """One movement of strange ways and one of strange pace, wherever they stand among the others."""
    sequences, theta = shown(0)
    for far, hasty in ((0, 35), (17, 4)):
        spoilt = list(sequences)
        spoilt[far] = spoilt[far] + [0.0, 0.3, 0.0]
        progress = np.linspace(0.0, 1.0, 40)
        times = np.clip(progress + 0.12 * np.sin(2.0 * np.pi * progress), 0.0, 1.0)
        spoilt[hasty] = np.column_stack([np.interp(times, progress, column) for column in spoilt[hasty].T])
        model = untrained(QuadraticPHMM).fit(spoilt, theta, np.arange(36) % 5)
        performances = model.performances_
        assert performances.complete.distances.shape == performances.pace.distances.shape == (36,)
        assert set(performances.complete.distances.argsort()[-2:]) == {far, hasty}  # haste changes ways too
        assert performances.pace.distances.argmax() == hasty


def test_the_p_value_does_not_depend_on_the_order_of_the_training() -> None:
    sequences, theta = shown(0)
    groups = np.arange(36) % 5
    order = np.random.default_rng(0).permutation(36)
    model = untrained(QuadraticPHMM).fit(sequences, theta, groups)
    other = untrained(QuadraticPHMM).fit([sequences[k] for k in order], theta[order], groups[order])
    for outlier_score in (0.7, 1.3, 2.0, 5.0):
        assert_allclose(
            other.performances_.log_p_value(outlier_score),
            model.performances_.log_p_value(outlier_score),
            rtol=1e-3,
        )


@pytest.mark.parametrize("count", [2, 3, 4])
@pytest.mark.parametrize("groups", [None, [0, 0, 0, 0], [0, 1, 0, 1], [2, 1, 0, 3]])
def test_tiny_training_sets_examine_and_come_back_from_files(
    count: int, groups: list[int] | None, tmp_path: Path
) -> None:
    rng = np.random.default_rng(0)
    theta = np.array([[0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.0, 0.0]])[:count]
    model = untrained(LinearPHMM).fit([wave(one, rng) for one in theta], theta, groups and groups[:count])
    assert model.performances_.complete.distances.shape == (count,)
    x = wave(np.array([0.4, 0.6]), rng)
    model.save(tmp_path / "model.npz")
    again = ParametricHMM.load(tmp_path / "model.npz")
    for finished, sequence in ((True, x), (False, x[:20])):
        found = model.examine(sequence, finished=finished)
        assert 0.0 <= found.p_value <= 1.0
        assert np.isfinite(found.log_p_value)
        assert np.isfinite(found.outlier_score)
        assert again.examine(sequence, finished=finished)[1:] == found[1:]


@pytest.mark.parametrize("finished", [True, False])
@pytest.mark.parametrize("repetitions", [1, 3])
def test_a_component_of_theta_that_never_varies_is_no_obstacle(repetitions: int, finished: bool) -> None:
    rng = np.random.default_rng(3)
    theta = np.repeat([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]], repetitions, axis=0)
    sequences = [wave(one, rng) for one in theta]
    x = wave(np.array([0.4, 0.0]), rng)
    x = x if finished else x[:20]
    found = untrained(LinearPHMM).fit(sequences, theta).examine(x, finished=finished).estimate
    without = untrained(LinearPHMM).fit(sequences, theta[:, :1]).estimate(x, finished=finished)
    assert_allclose(found.theta[0], without.theta[0], atol=0.1)
    assert (np.linalg.eigvalsh(found.covariance) > 0.0).all()


def test_a_stranger_movement_is_less_typical() -> None:
    performances = trained(QuadraticPHMM).performances_
    found = [performances.log_p_value(outlier_score) for outlier_score in (0.0, 0.5, 1.3, 3.0, 100.0, 1e12)]
    assert (np.diff(found) < 0.0).all()
    assert np.isfinite(found).all()
    assert found[2] > np.log(0.05) > np.log(0.001) > found[4]


def test_pace_is_a_logarithm_of_ways() -> None:
    straight = np.outer(np.linspace(0.0, 2.0, 61), [1.0, 0.0, 0.0])
    assert_allclose(pace_features(straight), np.log(0.2 * np.sqrt(1.0 / 3.0) * 1.02), rtol=1e-9)


def test_parts_are_means_of_fifths_and_the_last_frame() -> None:
    x = np.column_stack([np.linspace(0.0, 1.0, 101), np.linspace(2.0, 0.0, 101) ** 2])
    found = movement_parts(x).reshape(6, 2)
    assert_allclose(found[:, 0], [0.1, 0.3, 0.5, 0.7, 0.9, 1.0], rtol=0.0, atol=0.005)
    assert_allclose(found[-1], x[-1], rtol=1e-12)
    assert_allclose(movement_parts(x[:2]).reshape(6, 2)[-1], x[1], rtol=1e-12)


@pytest.mark.parametrize("reach", [0.0, 0.15])
def test_regions_of_tidy_movements_hold_theta(reach: float) -> None:
    """Scripted movements vary by a sensor's noise alone, or also by where they begin and end."""
    inside, errors = [], []
    for seed in range(4):
        rng = np.random.default_rng(seed)

        def tidy(theta: np.ndarray, rng: np.random.Generator = rng) -> np.ndarray:
            s = np.linspace(0.0, 1.0, 40)[:, None] ** 2 * (3.0 - 2.0 * np.linspace(0.0, 1.0, 40)[:, None])
            begin, end = reach * rng.standard_normal((2, 3)) / 10.0
            return begin + s * (np.array([*theta, 0.1]) + end - begin) + 0.001 * rng.standard_normal((40, 3))

        theta = np.repeat([[u, v] for u in (0.0, 0.4, 0.8) for v in (0.0, 0.15, 0.3)], 4, axis=0)
        model = untrained(QuadraticPHMM).fit([tidy(one) for one in theta], theta)
        for place in rng.uniform([0.0, 0.0], [0.8, 0.3], (60, 2)):
            found = model.estimate(tidy(place))
            missed = found.theta - place
            inside.append(missed @ np.linalg.solve(found.covariance, missed) < np.array([1.386, 3.219, 5.991]))
            errors.append(float(np.linalg.norm(missed)))
    covered = np.mean(inside, axis=0)
    assert_allclose(covered[:2], [0.5, 0.8], rtol=0.0, atol=0.12)
    assert covered[2] >= 0.88
    assert np.mean(errors) < (0.0004 if reach == 0.0 else 0.025)


def test_p_values_of_new_movements_are_about_uniform() -> None:
    """Of unseen targets over the table, from nine with five repetitions each."""
    found: list[float] = []
    for seed in range(3):
        model = QuadraticPHMM(20, 4, 6).fit(*table_movements(3, 3, 5, seed=seed))
        found += [model.examine(one).p_value for one in table_movements(5, 4, 3, seed=100 + seed)[0]]
    below = [float(np.mean(np.array(found) < level)) for level in (0.01, 0.05, 0.2, 0.5)]
    assert below[0] <= 0.03
    assert 0.02 <= below[1] <= 0.1
    assert 0.1 <= below[2] <= 0.3
    assert 0.3 <= below[3] <= 0.7
