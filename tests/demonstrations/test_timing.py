"""Frame rates, and the absolute rule for where a movement begins."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from paramove.demonstrations import timing
from paramove.demonstrations.movement import DemonstrationError
from tests.demonstrations.movements import movement, reach


def onset(one, point="index"):
    """Number of frames that are cut before the movement begins."""
    return len(one.time) - len(timing.cut_by_speed(one, point).time)


def test_the_same_rate_changes_nothing():
    one = movement()
    assert timing.resampled(one, 50.0) is one


@settings(deadline=None, max_examples=30, derandomize=True)
@given(rate_hz=st.floats(12.0, 300.0))
def test_a_smooth_path_keeps_its_shape(rate_hz):
    one = timing.resampled(movement(), rate_hz)
    assert_allclose(np.diff(one.time), 1.0 / rate_hz, rtol=1e-9)
    assert -1e-9 < movement().time[-1] - one.time[-1] < 1.0 / rate_hz + 1e-9
    share = np.clip(one.time - 0.4, 0.0, 1.0)
    smooth = share**3 * (10 - 15 * share + 6 * share**2)
    exact = np.array([0.1, 0.0, -0.4]) + smooth[:, None] * np.array([0.3, 0.1, 0.3])
    assert_allclose(one.point("index"), exact, rtol=0.0, atol=2e-5)


def test_rates_that_leave_nothing_are_refused():
    with pytest.raises(DemonstrationError, match="less than two frames at"):
        timing.resampled(movement(), 0.5)
    with pytest.raises(ValueError, match="positive, finite frame rate"):
        timing.resampled(movement(), 0.0)


def test_the_speed_of_a_straight_line_is_its_speed():
    time = np.arange(100) / 50.0
    path = np.array([0.3, -0.4, 0.0]) * time[:, None]
    line = replace(movement(), time=time, positions=np.repeat(path[:, None], 5, axis=1))
    assert_allclose(timing.speeds(line), 0.5, rtol=1e-9)


def test_the_onset_is_where_the_true_speed_passes_3_cm_per_s():
    """Of the minimum-jerk way of 0.436 m in 1 s that begins at 0.4 s."""
    one = movement()
    share = np.clip(one.time - 0.4, 0.0, 1.0)
    speed = 30 * share**2 * (1 - share) ** 2 * np.linalg.norm([0.3, 0.1, 0.3])
    true = int(np.flatnonzero(speed > timing.SLOW)[0])
    assert abs(onset(one) - true) <= 2
    cut = timing.cut_by_speed(one, end=True)
    assert abs(len(cut.time) - int((speed > timing.SLOW).sum())) <= 4
    assert cut.time[0] == 0.0
    assert_allclose(cut.positions, one.positions[onset(one) :][: len(cut.time)], rtol=0.0, atol=0.0)


def test_noise_of_markers_is_no_movement():
    rng = np.random.default_rng(3)
    onsets = [
        onset(replace(movement(), positions=movement().positions + rng.normal(0.0, 5e-4, (91, 5, 3))))
        for _ in range(20)
    ]
    assert max(onsets) - min(onsets) <= 4


def test_a_slow_drift_before_the_movement_is_not_its_begin():
    time, positions = reach((0.4, 0.1, -0.1))
    drift = positions.copy()
    drift[:, :, 0] += 0.02 * np.minimum(time, 0.4)[:, None]  # 2 cm/s
    assert onset(replace(movement(), positions=drift)) >= 18


def test_what_never_moves_is_refused_with_its_speed():
    still = replace(movement(source="a.mcap"), positions=0.1 * movement().positions)
    with pytest.raises(DemonstrationError, match=r"a.mcap: index never exceeds 15 cm/s \(its largest speed is 8"):
        onset(still)
    with pytest.raises(DemonstrationError, match="there is no point 'thumb'; there are sternum, shoulder"):
        onset(movement(), "thumb")


def test_a_movement_that_is_under_way_begins_at_once():
    one = movement()
    assert onset(replace(one, time=one.time[45:] - one.time[45], positions=one.positions[45:])) == 0
