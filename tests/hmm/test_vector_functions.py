"""The vectorised exponential function and logarithms against numpy's."""

import numpy as np
from numpy.testing import assert_allclose

from paramove.hmm.vector_functions import UNDERFLOW, exp_of_negative, log_of_one_plus, log_of_positive


def test_exponential_function_is_exact_to_the_last_digits() -> None:
    rng = np.random.default_rng(0)
    values = np.concatenate([[0.0, -1e-300, -0.3465735, UNDERFLOW], -rng.exponential(30.0, 5000)])
    values = values[values >= UNDERFLOW]
    result, bits = np.empty_like(values), np.empty(len(values), np.int64)
    exp_of_negative(values, len(values), bits, result)
    assert_allclose(result, np.exp(values), rtol=5e-16, atol=0.0)


def test_what_underflows_is_zero() -> None:
    values, result = np.array([np.nextafter(UNDERFLOW, -np.inf), -1e308, -np.inf]), np.full(3, np.nan)
    exp_of_negative(values, 3, np.empty(3, np.int64), result)
    assert (result == 0.0).all()


def test_logarithm_is_exact_to_the_last_digits() -> None:
    values = np.concatenate([[0.0, 1.0], 10.0 ** -np.random.default_rng(0).uniform(0.0, 100.0, 5000)])
    result = np.empty_like(values)
    log_of_one_plus(values, len(values), result)
    assert_allclose(result, np.log1p(values), rtol=1e-15, atol=0.0)


def test_logarithm_of_positive_numbers_is_exact_to_the_last_digits() -> None:
    near_one = 1.0 + np.concatenate([10.0 ** -np.arange(1.0, 17.0), -(10.0 ** -np.arange(1.0, 17.0))])
    roots = np.sqrt([0.5, 2.0])
    border = np.concatenate([roots, np.nextafter(roots, 0.0), np.nextafter(roots, 3.0)])
    values = np.concatenate(
        [[1.0, 2.0, 0.5], near_one, border, np.linspace(1.0, 64.0, 5000), 10.0 ** np.arange(-300, 300)]
    )
    result, bits = np.empty_like(values), np.empty(len(values), np.int64)
    log_of_positive(values, len(values), bits, result)
    assert_allclose(result, np.log(values), rtol=1e-15, atol=0.0)
