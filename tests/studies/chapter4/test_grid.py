"""The movements of chapter 4."""

import numpy as np
from numpy.testing import assert_allclose

from studies.chapter4.grid import ACTIONS, grid


def test_the_sets_of_the_thesis() -> None:
    movements = grid(0)
    for action in ACTIONS:
        assert len(movements.train[action].sequences) == 90
        assert len(np.unique(movements.train[action].theta, axis=0)) == 9
    assert sum(len(movements.test[action].sequences) for action in ACTIONS) == 280
    assert len(np.unique(movements.test["pointing"].theta, axis=0)) == 35


def test_corners_and_fewer_repetitions() -> None:
    training = grid(0).train["reaching"]
    corners = training.at_corners()
    assert len(corners.sequences) == 40
    assert set(corners.theta.ravel().tolist()) == {0.0, 1.0}
    fewer = training.repeated(3)
    assert len(fewer.sequences) == 27
    assert_allclose(fewer.theta[::3], training.theta[::10], rtol=0.0, atol=0.0)
    assert fewer.sequences[3] is training.sequences[10]
