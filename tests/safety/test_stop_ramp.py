"""The controlled stop: along the path, within its limits, at rest at the end."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from paramove.safety.limits import MotionLimits
from paramove.safety.stop_ramp import stop_ramp
from tests.robots.hoap3.movements import HOAP3, swing

LIMITS = MotionLimits.of(HOAP3)
PATH = swing(HOAP3, duration_s=1.1)


@settings(deadline=None, max_examples=60, derandomize=True)
@given(at=st.integers(min_value=8, max_value=1000))
def test_every_stop_of_a_fast_swing_is_within_the_limits_and_on_the_path(at: int) -> None:
    ramp = stop_ramp(PATH[at], PATH[at + 1 :], LIMITS)
    rows = np.concatenate(
        [PATH[at - 8 : at + 1], ramp, np.repeat((ramp if len(ramp) else PATH[at : at + 1])[-1:], 8, axis=0)]
    )
    acceleration = np.abs(rows[8:] - 2 * rows[4:-4] + rows[:-8]) / 16e-6
    assert (acceleration <= LIMITS.stop_acceleration * 1.001).all()
    assert (np.abs(np.diff(rows, axis=0)) <= LIMITS.velocity * 1e-3 * 1.001).all()
    assert len(ramp) <= 400
    # Each row of the ramp lies on the path: its place by one joint gives the others.
    joint = HOAP3.index("right_elbow")
    for row in ramp[:: max(1, len(ramp) // 20)]:
        place = np.interp(row[joint], PATH[:, joint], np.arange(len(PATH)))
        on_path = PATH[int(place)] + (place % 1) * (PATH[min(int(place) + 1, len(PATH) - 1)] - PATH[int(place)])
        np.testing.assert_allclose(row, on_path, rtol=0, atol=1e-6)


def test_at_rest_nothing_is_needed() -> None:
    assert len(stop_ramp(PATH[0], np.repeat(PATH[:1], 5, axis=0), LIMITS)) == 0


def test_where_the_path_is_cut_the_ramp_goes_straight_on_and_stays_in_range() -> None:
    ramp = stop_ramp(PATH[500], PATH[501:504], LIMITS)
    assert (ramp <= LIMITS.upper).all()
    rows = np.concatenate([PATH[490:501], ramp])
    acceleration = np.abs(rows[8:] - 2 * rows[4:-4] + rows[:-8]) / 16e-6
    assert (acceleration <= LIMITS.stop_acceleration * 1.001).all()
    np.testing.assert_allclose(ramp[-1], ramp[-2], rtol=0, atol=1e-5)
