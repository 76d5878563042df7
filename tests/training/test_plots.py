"""Plots for arrays: what they draw follows from the numbers."""

from __future__ import annotations

import matplotlib
import numpy as np
import pytest
from matplotlib import pyplot
from numpy.testing import assert_allclose

from paramove.phmm import QuadraticPHMM
from paramove.training import coverage, plot_coverage, plot_movement, plot_theta
from tests.phmm.movements import FEW, shown, wave

matplotlib.use("agg")


@pytest.fixture(autouse=True)
def _no_figures_left():
    yield
    pyplot.close("all")


@pytest.fixture(scope="module")
def model() -> QuadraticPHMM:
    return QuadraticPHMM(8, options=FEW).fit(*shown(0))


ASKED = np.array([[0.2, 0.3], [0.6, 0.7]])
UNSEEN = [wave(one, np.random.default_rng(number)) for number, one in enumerate(ASKED)]


def test_movements_lie_in_their_bands(model: QuadraticPHMM) -> None:
    axes = plot_movement(model, ASKED, UNSEEN, component=1)
    assert len(axes.lines) == 4
    assert_allclose(axes.lines[-1].get_ydata(), model.synthesize(ASKED[1], 100)[:, 1])
    band = axes.collections[-1].get_paths()[0].vertices
    assert band[:, 1].min() < axes.lines[-1].get_ydata().min() < axes.lines[-1].get_ydata().max() < band[:, 1].max()


def test_ellipses_lie_at_the_estimates(model: QuadraticPHMM) -> None:
    axes = plot_theta(model, UNSEEN, ASKED)
    assert_allclose([patch.center for patch in axes.patches], model.predict(UNSEEN))
    assert len(plot_theta(model, UNSEEN).lines) == 2


def test_one_parameter_has_error_bars() -> None:
    sequences, theta = shown(0)
    flat = QuadraticPHMM(8, options=FEW).fit(sequences, theta[:, 0])
    _, axes = pyplot.subplots()
    assert plot_theta(flat, UNSEEN, ASKED[:, 0], ax=axes) is axes
    assert len(axes.containers) == 2


def test_coverage_of_an_honest_model_is_the_diagonal() -> None:
    rng = np.random.default_rng(0)
    covariance = np.array([[2.0, 0.5], [0.5, 1.0]])
    estimated = rng.multivariate_normal([0.0, 0.0], covariance, 4000)
    theta, covariances = np.zeros((4000, 2)), np.broadcast_to(covariance, (4000, 2, 2))
    assert_allclose(coverage(theta, estimated, covariances), 0.95, atol=0.02)
    assert_allclose(coverage(theta, estimated, covariances, 0.5), 0.5, atol=0.03)
    assert coverage(theta, estimated, 0.01 * covariances) < 0.1
    axes = plot_coverage(theta, estimated, covariances, label="honest")
    x, y = axes.lines[-1].get_data()
    assert_allclose(y, x, atol=3.0)
    assert plot_coverage(theta, estimated, 0.1 * covariances, label="too sure", ax=axes) is axes
    assert (axes.lines[-1].get_ydata()[1:-1] < y[1:-1]).all()
    assert len(axes.collections) == 1
