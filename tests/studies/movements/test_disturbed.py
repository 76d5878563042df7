import numpy as np
from numpy.testing import assert_allclose

from studies.movements.disturbed import SENSOR_NOISE_M, aborted, stopped


def test_an_aborted_movement_returns_along_its_way() -> None:
    for frames in (10, 11):
        x = np.arange(float(frames))[:, None]
        back = aborted(x)
        assert len(back) == frames
        assert_allclose(back[: (frames + 1) // 2], x[: (frames + 1) // 2], rtol=0, atol=0)
        assert_allclose(back[-1], x[frames % 2], rtol=0, atol=0)


def test_a_stopped_movement_stays_half_way() -> None:
    x = np.linspace(0.0, 1.0, 200)[:, None]
    held = stopped(x, np.random.default_rng(0))
    assert len(held) == 200
    assert_allclose(held[:100], x[:100], rtol=0, atol=0)
    assert_allclose(held[100:], np.broadcast_to(x[99], (100, 1)), rtol=0, atol=6 * SENSOR_NOISE_M)
    assert np.ptp(held[100:]) > 0.0
