"""The offset of another clock lies within its bound, whatever the ways there and back take."""

from __future__ import annotations

import itertools
import math
import random

from hypothesis import given, settings
from hypothesis import strategies as st

from paramove.hosts.clock_offset import MOST_DRIFT, MOST_SLEW, REFERENCE_NS, ClockOffset

MS = 1_000_000
delays_ns = st.integers(0, 300 * MS)
pauses_ns = st.integers(0, 30_000 * MS)


def exchange(clock, offset_ns, drift, rounds, begin_ns=10**12):
    """Beats whose ways take what `rounds` gives; returns the time here after the last one."""
    now_ns = begin_ns
    for pause_ns, way_ns, back_ns in rounds:
        sent_ns = now_ns + pause_ns
        at_ns = sent_ns + way_ns
        there_ns = at_ns + offset_ns + round(drift * (at_ns - begin_ns))
        now_ns = at_ns + back_ns
        clock.add(sent_ns, there_ns, now_ns)
    return now_ns


@given(
    st.integers(-(10**14), 10**14),
    st.floats(-MOST_DRIFT, MOST_DRIFT),
    st.lists(st.tuples(pauses_ns, delays_ns, delays_ns), min_size=1, max_size=50),
    pauses_ns,
)
def test_the_truth_lies_within_the_bound(offset_ns, drift, rounds, later_ns):
    clock = ClockOffset()
    now_ns = exchange(clock, offset_ns, drift, rounds) + later_ns
    truth_ns = offset_ns + drift * (now_ns - 10**12)
    assert abs(clock.offset_ns(now_ns) - truth_ns) <= clock.bound_ns(now_ns) + 10
    replies_ns = (10**12 + elapsed_ns for elapsed_ns in itertools.accumulate(map(sum, rounds)))
    bounds = [
        (0.5 + MOST_DRIFT) * (way_ns + back_ns) + MOST_DRIFT * (now_ns - reply_ns)
        for (_, way_ns, back_ns), reply_ns in zip(rounds, replies_ns, strict=True)
    ]
    assert clock.bound_ns(now_ns) <= min(bounds) + 10  # so no reply was taken for a jump of the clock
    if clock.drift is not None:
        found, bound = clock.drift
        assert abs(found - drift) <= bound + 1e-9


class SlewedClock:
    """A clock whose rate NTP changes every few seconds, in either direction."""

    def __init__(self, begin_ns, rates, seconds_each):
        self._rates = rates
        self._each_ns = round(1e9 * seconds_each)
        self._begin_ns = begin_ns

    def at(self, true_ns):
        """Its time at a time of no clock's."""
        time_ns, left_ns = self._begin_ns, true_ns
        rates = itertools.cycle(self._rates)
        while left_ns:
            lasts_ns = min(left_ns, self._each_ns)
            time_ns += lasts_ns + round(next(rates) * lasts_ns)
            left_ns -= lasts_ns
        return time_ns


slews = st.lists(st.sampled_from([-MOST_SLEW, 0.0, MOST_SLEW]), min_size=1, max_size=6)


@settings(deadline=None, derandomize=True)
@given(slews, slews, st.floats(0.3, 30.0), st.integers(0, 10**17), st.integers(20_000, 20 * MS), st.integers(0, 99))
def test_the_truth_lies_within_the_bound_while_ntp_slews_both_clocks(here, there, seconds_each, ahead_ns, way_ns, seed):
    draw = random.Random(seed)
    own, other = SlewedClock(10**15, here, seconds_each), SlewedClock(10**15 + ahead_ns, there, 0.7 * seconds_each)
    clock = ClockOffset()
    true_ns = 0
    for _ in range(60):
        true_ns += draw.randrange(1000 * MS)
        sent_ns = own.at(true_ns)
        true_ns += draw.randrange(1, way_ns)
        there_ns = other.at(true_ns)
        true_ns += draw.randrange(1, way_ns)
        clock.add(sent_ns, there_ns, own.at(true_ns))
        for later_ns in (0, draw.randrange(1000 * MS)):
            now_ns = own.at(true_ns + later_ns)
            truth_ns = other.at(true_ns + later_ns) - now_ns
            assert abs(clock.offset_ns(now_ns) - truth_ns) <= clock.bound_ns(now_ns)
    assert clock.jumps == 0


def test_nothing_is_known_before_the_first_reply():
    clock = ClockOffset()
    assert clock.bound_ns(5) == math.inf
    assert clock.drift is None


def test_one_quick_round_trip_makes_up_for_many_slow_ones():
    clock = ClockOffset()
    now_ns = exchange(clock, 7 * MS, 0.0, [(10 * MS, 90 * MS, 10 * MS)] * 20 + [(10 * MS, MS, MS)])
    assert clock.bound_ns(now_ns) <= 1.01 * MS
    now_ns = exchange(clock, 7 * MS, 0.0, [(10 * MS, 90 * MS, 10 * MS)] * 20, now_ns)
    assert clock.bound_ns(now_ns) <= 4 * MS  # it may have drifted since


def test_the_drift_shows_after_a_while():
    clock = ClockOffset()
    exchange(clock, 0, 3e-5, [(100 * MS, MS // 10, MS // 10)] * (60 * 10))
    found, bound = clock.drift
    assert abs(found - 3e-5) < bound < 2e-5
    assert REFERENCE_NS < 60_000 * MS


def test_a_clock_that_jumps_is_estimated_anew():
    clock = ClockOffset()
    now_ns = exchange(clock, 0, 0.0, [(10 * MS, MS, MS)] * 10)
    assert clock.jumps == 0
    now_ns = exchange(clock, 900 * MS, 0.0, [(10 * MS, MS, MS)] * 2, now_ns)
    assert abs(clock.offset_ns(now_ns) - 900 * MS) <= clock.bound_ns(now_ns) < 2 * MS
    assert clock.jumps == 1
