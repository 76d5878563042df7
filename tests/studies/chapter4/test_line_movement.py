"""Linear PHMMs of the line movement."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from studies.chapter2.movement import prototype
from studies.chapter4.line_movement import BOUND, FIGURES, distance_from_curve, trained_line


def test_the_true_curve_is_nowhere_off_and_a_shifted_one_by_its_shift() -> None:
    curve = prototype(0.2, np.linspace(0.0, 2.0, 100))
    assert distance_from_curve(curve, 0.2) < 0.01
    flat = prototype(0.0, np.linspace(0.0, 2.0, 100))
    assert_allclose(distance_from_curve(flat + np.array([0.0, 0.05]), 0.0), 0.05 / BOUND, rtol=1e-3)


@pytest.mark.parametrize("figure", [FIGURES[0], FIGURES[1]], ids=lambda figure: figure.number)
def test_six_states_only_approximate(figure) -> None:
    model = trained_line(figure, 0)
    off = distance_from_curve(model.synthesize([BOUND], 100, path="linear"), BOUND)
    assert (off < 0.1) == (figure.states == 21)
