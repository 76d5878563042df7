"""Lost and found by the best likelihood of each frame."""

import numpy as np
import pytest

from paramove.action_space.track_health import HealthOptions, TrackHealth
from paramove.documents.input_error import InputError
from paramove.observation import Presence


def followed(levels, rate_hz, options=None):
    """Whether the track was lost after each frame."""
    health, lost = TrackHealth(options), []
    for frame, level in enumerate(levels):
        health.update(frame / rate_hz, 0.0 if frame == 0 else 1.0 / rate_hz, float(level))
        lost.append(health.lost)
    return health, np.array(lost)


def levels(rate_hz, *stretches, seed=0):
    """Stretches (seconds, level) with noise of one nat."""
    rng = np.random.default_rng(seed)
    return np.concatenate([level + rng.standard_normal(round(s * rate_hz)) for s, level in stretches])


@pytest.mark.parametrize("rate_hz", [8.0, 50.0])
def test_a_lasting_drop_is_a_lost_track_and_recovery_clears_it(rate_hz):
    health, lost = followed(levels(rate_hz, (4.0, -10.0), (2.0, -40.0), (2.0, -10.0)), rate_hz)
    times = np.arange(len(lost)) / rate_hz
    assert 4.3 < times[lost][0] < 4.8
    assert 6.1 < times[lost][-1] < 6.6
    assert np.count_nonzero(np.diff(lost.astype(int)) == 1) == 1
    assert not health.lost


@pytest.mark.parametrize("rate_hz", [8.0, 50.0])
def test_a_short_drop_is_none(rate_hz):
    assert not followed(levels(rate_hz, (3.0, -10.0), (0.3, -40.0), (2.0, -10.0)), rate_hz)[1].any()


@pytest.mark.parametrize("rate_hz", [8.0, 50.0])
@pytest.mark.parametrize("seed", range(10))
def test_usual_noise_loses_nothing(rate_hz, seed):
    assert not followed(levels(rate_hz, (30.0, -10.0), seed=seed), rate_hz)[1].any()


def test_a_new_track_learns_what_is_usual_first():
    assert not followed([-30.0, -25.0, -12.0, -10.0, -10.0], 8.0)[1].any()


def test_an_absolute_level_needs_no_learning():
    options = HealthOptions(min_log_likelihood=-20.0)
    assert followed(levels(8.0, (2.0, -50.0)), 8.0, options)[1].any()


def test_options_are_checked():
    with pytest.raises(InputError, match="lost_after_s"):
        HealthOptions(lost_after_s=0.0)


def test_where_but_the_background_is_seen_there_is_no_arm():
    health = TrackHealth()
    for frame in range(20):
        health.update(frame / 15, 1 / 15, -20.0, presence=Presence(0.6, 1.2))
    assert not health.lost
    health.update(20 / 15, 1 / 15, -20.0, presence=Presence(-0.8, 0.1))
    assert not health.lost
    health.update(21 / 15, 1 / 15, -20.0, presence=Presence(-0.8, 0.1))
    assert health.lost
    assert "background" in health.absence
    for frame in range(22, 28):
        health.update(frame / 15, 1 / 15, -20.0, presence=Presence(0.6, 1.2))
    assert not health.lost


def test_pictures_that_change_far_beyond_an_arm_are_no_arm_until_they_are_as_before():
    health = TrackHealth()
    for frame in range(20):
        health.update(frame / 15, 1 / 15, -20.0, presence=Presence(0.6, 1.2))
    for frame in range(20, 23):
        health.update(frame / 15, 1 / 15, -20.0, presence=Presence(0.6, 2.6))
    assert health.lost
    for frame in range(23, 33):
        health.update(frame / 15, 1 / 15, -20.0, presence=Presence(0.6, 2.3))
    assert health.lost
    assert "2.3 times the arm's area" in health.absence
