"""Motion blending and the redirect action."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.demonstrations import (
    POINT_NAMES,
    Demonstrator,
    Variation,
    blended,
    corner_pairs,
    nine_pairs,
    redirect_demonstrations,
    redirect_from_model,
    table_place,
    table_targets,
    train_pointing_model,
)
from paramove.demonstrations.blending import phase
from paramove.phmm import InterpolativePHMM
from studies.chapter4.redirect import target_misses

exact = Demonstrator(variation=Variation.none())


@pytest.fixture(scope="module")
def pointing() -> InterpolativePHMM:
    return train_pointing_model(0)


def test_places_are_those_of_the_raster() -> None:
    targets, coordinates = table_targets(3, 5)
    assert_allclose(table_place(coordinates), targets, rtol=0.0, atol=0.0)
    assert_allclose(table_place([1.0, 0.0]) - table_place([0.0, 1.0]), [-0.30, -0.80, 0.0], rtol=0.0, atol=1e-12)


def test_corner_pairs_hold_every_pair_of_corners_once() -> None:
    pairs = corner_pairs()
    assert pairs.shape == (16, 4)
    assert len(np.unique(pairs, axis=0)) == 16
    assert [0.0, 1.0, 0.0, 1.0] in pairs.tolist()
    moving = corner_pairs(staying=False)
    assert moving.shape == (12, 4)
    assert (moving[:, :2] != moving[:, 2:]).any(axis=1).all()


def test_of_nine_pairs_any_two_components_show_all_their_levels_together() -> None:
    pairs = nine_pairs()
    for one in range(4):
        for other in range(one):
            assert len(np.unique(pairs[:, [one, other]], axis=0)) == 9


def test_a_movement_blended_with_itself_keeps_its_path() -> None:
    movement = exact.demonstrate("pointing", table_place([0.5, 0.5]), np.random.default_rng(0))
    made = blended(movement, movement, 120)
    gap = np.linalg.norm(made[:, None] - movement[None], axis=2).min(axis=1)
    assert gap.max() < 0.015  # of 21 coordinates, between frames of a movement at up to 6 cm per frame
    assert_allclose(made[[0, -1]], movement[[0, -1]], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("pair", [[0.0, 1.0, 1.0, 1.0], [0.25, 0.8, 0.8, 0.3], [1.0, 0.0, 1.0, 0.0]])
def test_redirect_points_at_its_start_and_then_at_its_end(pair: list[float]) -> None:
    shown = redirect_demonstrations(pair, np.random.default_rng(0), demonstrator=exact)
    assert shown.sequences[0].shape == (80, 3 * len(POINT_NAMES))
    assert shown.description.parameter_names == ("start_u", "start_v", "end_u", "end_v")
    assert max(target_misses(shown.sequences[0], np.array(pair))) < 0.005
    assert_allclose(shown.sequences[0][0], shown.sequences[0][-1], rtol=0.0, atol=1e-9)


def test_movements_of_different_speed_and_noise_are_blended_too() -> None:
    shown = redirect_demonstrations(corner_pairs(), np.random.default_rng(0))
    misses = np.array([target_misses(one, pair) for one, pair in zip(shown.sequences, shown.theta, strict=True)])
    assert misses.mean() < 0.01  # the person misses by 0.8 cm on average
    steps = [np.linalg.norm(np.diff(one, axis=0), axis=1).max() for one in shown.sequences]
    assert max(steps) < 0.25  # m of 21 coordinates in 1/80 of the movement: no jumps


def test_the_pointing_models_redirect_reaches_both_places(pointing: InterpolativePHMM) -> None:
    shown = redirect_from_model(pointing, corner_pairs())
    misses = np.array([target_misses(one, pair) for one, pair in zip(shown.sequences, shown.theta, strict=True)])
    assert misses.max() < 0.01


def test_phase_runs_through_three_parts_in_order() -> None:
    movement = exact.demonstrate("pointing", table_place([0.2, 0.7]), np.random.default_rng(0))
    values = phase(movement)
    assert (np.diff(values) >= -1e-12).all()
    assert_allclose(values[[0, -1]], [0.0, 3.0], rtol=0.0, atol=1e-12)
    held = (values >= 1.0) & (values <= 2.0)
    assert 0.12 < held.mean() < 0.25  # the demonstrator stays for 0.155 of the movement


def test_what_cannot_be_blended_is_refused() -> None:
    line = np.linspace(0.0, 1.0, 100)[:, None]
    with pytest.raises(ValueError, match="goes out, stays at a position and returns"):
        blended(line, line)
    movement = exact.demonstrate("pointing", table_place([0.5, 0.5]), np.random.default_rng(0))
    with pytest.raises(ValueError, match="dimensions, found 21 and 20"):
        blended(movement, movement[:, :20])
    with pytest.raises(ValueError, match="start_u"):
        redirect_demonstrations([0.0, 1.0], np.random.default_rng(0))
