"""The vectorised exponential function and logarithm of the chain's recursions against numpy's."""

import numpy as np
from numpy.testing import assert_allclose

from paramove.hmm.chain_kernels import UNDERFLOW, _exp_of_negative, _log_of_one_plus


def test_exponential_function_is_exact_to_the_last_digits() -> None:
    rng = np.random.default_rng(0)
    values = np.concatenate([[0.0, -1e-300, -0.3465735, UNDERFLOW], -rng.exponential(30.0, 5000)])
    values = values[values >= UNDERFLOW]
    result, bits = np.empty_like(values), np.empty(len(values), np.int64)
    _exp_of_negative(values, len(values), bits, result)
    assert_allclose(result, np.exp(values), rtol=5e-16, atol=0.0)


def test_what_underflows_is_zero() -> None:
    values, result = np.array([np.nextafter(UNDERFLOW, -np.inf), -1e308, -np.inf]), np.full(3, np.nan)
    _exp_of_negative(values, 3, np.empty(3, np.int64), result)
    assert (result == 0.0).all()


def test_logarithm_is_exact_to_the_last_digits() -> None:
    values = np.concatenate([[0.0, 1.0], 10.0 ** -np.random.default_rng(0).uniform(0.0, 100.0, 5000)])
    result = np.empty_like(values)
    _log_of_one_plus(values, len(values), result)
    assert_allclose(result, np.log1p(values), rtol=1e-15, atol=0.0)
