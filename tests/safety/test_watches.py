"""The emergency stop's source, joints that do not follow, and what comes too often."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.safety_steps import MS, NAMES
from paramove.safety.gate_io import Measured
from paramove.safety.watches import EmergencyWatch, FollowingWatch, RateWatch


def test_the_newest_word_of_the_emergency_stop_stays() -> None:
    watch = EmergencyWatch(None, 0)
    assert watch.fault(10 * MS, None) is None
    pressed = watch.fault(20 * MS, True)
    assert pressed is not None
    assert (pressed.code, pressed.joint) == ("emergency_stop", "")
    assert pressed.detail == "the emergency stop is pressed; release it, then arm again"
    assert watch.fault(10**15, None) == pressed
    assert watch.fault(10**15, False) is None
    assert watch.fault(10**15 + 1, None) is None


def test_a_source_that_is_silent_counts_as_pressed() -> None:
    watch = EmergencyWatch(500.0, 100 * MS)
    assert watch.fault(600 * MS, None) is None
    silent = watch.fault(601 * MS, None)
    assert silent is not None
    assert (silent.code, silent.joint) == ("emergency_silent", "")
    for part in ("emergency stop", "501 ms, allowed 500 ms", "counts as pressed", "restart its source, then arm again"):
        assert part in silent.detail
    assert watch.fault(602 * MS, False) is None
    assert watch.fault(1102 * MS, None) is None
    assert watch.fault(1103 * MS, None) is not None


def test_time_that_goes_back_does_not_let_a_silent_source_live_longer() -> None:
    watch = EmergencyWatch(500.0, 10_000 * MS)
    assert watch.fault(1000 * MS, None) is None
    assert watch.fault(1501 * MS, None) is not None


def report(at_ms: int, error: tuple[float, float, float]) -> Measured:
    commanded = np.array([0.1, 0.2, 0.3])
    return Measured(at_ms * MS, commanded + error, commanded, True, 0)


def test_a_joint_that_is_away_for_long_is_named_with_error_and_limit() -> None:
    watch = FollowingWatch(NAMES, np.array([0.1, 0.2, np.inf]), 100.0)
    assert watch.fault(report(0, (0.09, -0.25, 9.0))) is None
    assert watch.fault(report(99, (0.09, -0.25, 9.0))) is None
    fault = watch.fault(report(100, (0.11, -0.25, 9.0)))
    assert fault is not None
    assert (fault.code, fault.joint) == ("following", "elbow")
    for part in ("joint elbow", "14.32 deg", "for 100 ms", "allowed 11.46 deg"):
        assert part in fault.detail
    assert fault.detail.endswith("; see what blocks it, then arm again")


def test_the_time_begins_anew_once_a_joint_was_there_again() -> None:
    watch = FollowingWatch(NAMES, np.full(3, 0.1), 100.0)
    assert watch.fault(report(0, (0.2, 0, 0))) is None
    assert watch.fault(report(60, (0.1, 0, 0))) is None
    assert watch.fault(report(70, (0.2, 0, 0))) is None
    assert watch.fault(report(169, (0.2, 0, 0))) is None
    assert watch.fault(report(170, (-0.2, 0, 0))) is not None


def test_a_joint_that_is_not_known_counts_as_away() -> None:
    watch = FollowingWatch(NAMES, np.full(3, 0.1), 100.0)
    lost = replace(report(0, (0, 0, 0)), positions=np.array([0.1, 0.2, np.nan]))
    assert list(watch.away(lost)) == [False, False, True]
    assert watch.fault(lost) is None
    fault = watch.fault(replace(lost, captured_ns=100 * MS))
    assert fault is not None
    assert fault.joint == "wrist"


def test_without_limits_nothing_is_watched() -> None:
    watch = FollowingWatch(NAMES, None, 100.0)
    assert not watch.away(report(0, (9, 9, 9))).any()
    assert watch.fault(report(0, (9, 9, 9))) is None
    assert watch.fault(report(1000, (9, 9, 9))) is None


@pytest.mark.parametrize(("per_s", "allowed"), [(100.0, 30), (15.0, 4), (0.5, 1)])
def test_one_more_than_the_allowed_within_a_quarter_second_is_too_many(per_s: float, allowed: int) -> None:
    watch = RateWatch(per_s)
    assert watch.allowed == allowed
    assert not any(watch.exceeded(i) for i in range(allowed))
    assert watch.exceeded(250 * MS - 1)
    at_once = RateWatch(per_s)
    assert [at_once.exceeded(0) for _ in range(allowed + 1)] == [False] * allowed + [True]
    late = RateWatch(per_s)
    assert not any(late.exceeded(i) for i in range(allowed))
    assert not late.exceeded(250 * MS)
    after_a_pause = RateWatch(per_s)
    assert not after_a_pause.exceeded(0)
    assert [after_a_pause.exceeded(9000 * MS) for _ in range(allowed + 1)] == [False] * allowed + [True]


def test_the_nominal_rate_passes_for_ever_and_time_that_goes_back_breaks_no_rate() -> None:
    watch = RateWatch(100.0)
    assert not any(watch.exceeded(10 * MS * i) for i in range(500))
    assert not watch.exceeded(0)
    assert not any(RateWatch(None).exceeded(0) for _ in range(1000))
