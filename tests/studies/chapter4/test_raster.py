"""The movements of chapter 4."""

import numpy as np
from numpy.testing import assert_allclose

from studies.chapter4.raster import ACTIONS, raster


def test_the_sets_of_the_thesis() -> None:
    shown = raster(0)
    for action in ACTIONS:
        assert len(shown.train[action].sequences) == 90
        assert len(np.unique(shown.train[action].places, axis=0)) == 9
    assert sum(len(shown.test[action].sequences) for action in ACTIONS) == 280
    assert len(np.unique(shown.test["pointing"].places, axis=0)) == 35


def test_corners_and_fewer_repetitions() -> None:
    shown = raster(0).train["reaching"]
    corners = shown.at_corners()
    assert len(corners.sequences) == 40
    assert set(corners.places.ravel().tolist()) == {0.0, 1.0}
    fewer = shown.repeated(3)
    assert len(fewer.sequences) == 27
    assert_allclose(fewer.places[::3], shown.places[::10], rtol=0.0, atol=0.0)
    assert fewer.sequences[3] is shown.sequences[10]
