"""Grids in parameter space."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from paramove.phmm import ParameterGrid

PROPERTY = settings(max_examples=40, deadline=None, derandomize=True)


@PROPERTY
@given(st.integers(0, 2**31))
def test_targets_in_a_turned_cuboid_are_reproduced(seed: int) -> None:
    """Equations (5.1, corrected) and (5.6): interpolating the corners of the cuboid at theta gives theta."""
    rng = np.random.default_rng(seed)
    edges = rng.uniform(0.1, 1.0, 3)[:, None] * Rotation.random(rng=rng).as_matrix()
    origin = rng.standard_normal(3)
    grid = ParameterGrid.from_corners([origin, *(origin + edges)], (2, 3, 2))
    theta = origin + rng.uniform(-0.3, 1.3, (5, 3)) @ edges
    coordinates = grid.coordinates(theta)
    assert_allclose(grid.theta(coordinates), theta, rtol=0.0, atol=1e-9)
    indices, weights = grid.weights(coordinates, clamped=False)
    assert_allclose(weights.sum(axis=1), 1.0, rtol=0.0, atol=1e-9)
    assert_allclose(np.einsum("mc,mcp->mp", weights, grid.points()[indices]), theta, rtol=0.0, atol=1e-9)
    assert (grid.weights(coordinates, clamped=True)[1] >= 0).all()


def test_bilinear_weights_follow_the_formulas() -> None:
    grid = ParameterGrid.from_lines([0.0, 0.5, 1.0], [0.0, 0.5, 1.0])
    indices, weights = grid.weights(np.array([[0.8, 0.2]]), clamped=False)  # the example of thesis 3.4.4
    u, v = (0.8 - 0.5) / 0.5, 0.2 / 0.5
    named = dict(zip(map(tuple, grid.points()[indices[0]]), weights[0], strict=True))
    expected = {(0.5, 0.0): (1 - u) * (1 - v), (1.0, 0.0): u * (1 - v), (0.5, 0.5): (1 - u) * v, (1.0, 0.5): u * v}
    assert named.keys() == expected.keys()
    for corner, weight in expected.items():
        assert_allclose(named[corner], weight, rtol=1e-12, atol=0.0)


def test_distorted_cuboids_are_refused() -> None:
    with pytest.raises(ValueError, match="right angles"):
        ParameterGrid.from_corners([[0.0, 0.0], [1.0, 0.0], [0.5, 1.0]], (2, 2))


def test_lines_that_do_not_increase_are_refused() -> None:
    with pytest.raises(ValueError, match="dimension 1 needs at least two increasing values"):
        ParameterGrid.from_lines([0.0, 1.0], [0.3, 0.3])


def test_grid_is_found_from_labels() -> None:
    points = ParameterGrid.from_lines([-0.2, 0.1, 0.4], [3.0, 5.0]).points()
    grid = ParameterGrid.from_theta(np.random.default_rng(0).permutation(np.repeat(points, 3, axis=0)))
    assert grid.shape == (3, 2)
    assert_allclose(grid.points(), points, rtol=0.0, atol=1e-12)


def test_regions_cover_the_grid_and_its_margin_once() -> None:
    grid = ParameterGrid.from_lines([0.0, 1.0, 4.0], [0.0, 2.0])
    regions = list(grid.regions(0.25))
    assert len(regions) == 4 * 4
    assert_allclose(sum(np.ptp(bounds, axis=1).prod() for _, bounds in regions), 1.5 * 1.5)
    assert {tuple(grid.cell(middle)) for middle, _ in regions} == {(0, 0), (1, 0)}
    for middle, bounds in regions:
        assert ((bounds[:, 0] < middle) & (middle < bounds[:, 1])).all()


def test_a_cell_is_that_of_the_weights() -> None:
    grid = ParameterGrid.from_lines([0.0, 1.0, 4.0], [0.0, 2.0, 3.0, 5.0])
    for position in np.random.default_rng(0).uniform(-0.3, 1.3, (50, 2)):
        indices, _ = grid.weights(position[None], clamped=False)
        assert indices.min() == np.ravel_multi_index(tuple(grid.cell(position)), grid.shape)
