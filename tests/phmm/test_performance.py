"""What is learned about whole demonstrations: outlier scores and p-values, of tiny and shuffled training sets too."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.phmm import LinearPHMM, ParametricHMM, QuadraticPHMM
from paramove.phmm.performance import pace_features, part_averages, part_begins, state_averages
from paramove.phmm.search_kernels import responsibilities_at
from tests.phmm.movements import shown, trained, untrained, wave


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


def test_a_stranger_movement_is_less_typical() -> None:
    performances = trained(QuadraticPHMM).performances_
    found = [performances.log_p_value(outlier_score) for outlier_score in (0.0, 0.5, 1.3, 3.0, 100.0, 1e12)]
    assert (np.diff(found) < 0.0).all()
    assert np.isfinite(found).all()
    assert found[2] > np.log(0.05) > np.log(0.001) > found[4]


def test_pace_is_a_logarithm_of_ways() -> None:
    straight = np.outer(np.linspace(0.0, 2.0, 61), [1.0, 0.0, 0.0])
    assert_allclose(pace_features(straight), np.log(0.2 * np.sqrt(1.0 / 3.0) * 1.02), rtol=1e-9)


def test_parts_of_a_movement_that_is_asked_about_are_those_of_the_training() -> None:
    """Training averages in numpy, for several numbers of parts at once; the search for theta does it compiled."""
    sequences, theta = shown(0)
    model = untrained(QuadraticPHMM).fit(sequences, theta)
    regression = model.performances_.complete
    n_parts = model.performances_.n_parts(3)
    x = model._checked(sequences[5])
    movement = model._prepared(x)
    gamma = responsibilities_at(model.monomials_.starts[0], movement)
    expected = part_averages(*state_averages(gamma, x), x, n_parts)
    found = regression.aligned_parts(x, movement, part_begins(model.n_states, n_parts), 1, 1.0)
    assert_allclose(found, expected, rtol=1e-10, atol=1e-12)
