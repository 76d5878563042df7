"""Out-and-back movements that were not finished."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.demonstrations import Demonstrator, table_place
from studies.chapter4.unfinished import TIP, aborted, half_way, stopped


def tip_of(x: np.ndarray) -> np.ndarray:
    return x.reshape(len(x), -1, 3)[:, TIP]


@pytest.fixture(scope="module")
def movement() -> np.ndarray:
    return Demonstrator().demonstrate("pointing", table_place((0.5, 0.5)), np.random.default_rng(0))


def test_half_way_is_half_of_the_way_out_not_of_the_time(movement: np.ndarray) -> None:
    way = np.linalg.norm(np.diff(tip_of(movement), axis=0), axis=1)
    farthest = int(np.linalg.norm(tip_of(movement) - tip_of(movement)[0], axis=1).argmax())
    frame = half_way(movement)
    assert_allclose(way[:frame].sum(), 0.5 * way[:farthest].sum(), rtol=0.05)
    assert frame < 0.35 * len(movement)


def test_who_aborts_returns_the_same_way_and_rests(movement: np.ndarray) -> None:
    x = aborted(movement, np.random.default_rng(1))
    frame = half_way(movement)
    assert x.shape == movement.shape
    assert_allclose(x[: frame + 1], movement[: frame + 1], rtol=0.0, atol=0.0)
    assert_allclose(x[2 * frame], movement[0], rtol=0.0, atol=0.0)
    assert_allclose(x[2 * frame + 1 :], np.broadcast_to(movement[0], x[2 * frame + 1 :].shape), rtol=0.0, atol=0.01)
    assert np.linalg.norm(tip_of(x)[-1] - tip_of(movement)[0]) < 0.01


def test_who_stops_holds(movement: np.ndarray) -> None:
    x = stopped(movement, np.random.default_rng(1))
    frame = half_way(movement)
    assert x.shape == movement.shape
    assert np.linalg.norm(tip_of(x)[-1] - tip_of(movement)[frame]) < 0.01
    assert np.linalg.norm(tip_of(x)[-1] - tip_of(movement)[0]) > 0.1
