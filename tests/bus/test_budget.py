"""The rate budget of a topic, by the messages' own stamps."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from paramove.bus.budget import ALLOWANCE, BURST, COUNTED_BYTES, FloodGuard, RateBudget

SECOND_NS = 10**9


@settings(deadline=None, derandomize=True, max_examples=200)
@given(st.lists(st.integers(0, 2 * SECOND_NS), min_size=1, max_size=400), st.floats(0.5, 1000))
def test_never_more_than_the_allowance_and_a_burst(gaps_ns: list[int], rate_hz: float) -> None:
    budget = RateBudget(rate_hz)
    now_ns = admitted = 0
    for gap_ns in gaps_ns:
        now_ns += gap_ns
        admitted += budget.admits(1, now_ns)
    assert admitted <= BURST + ALLOWANCE * rate_hz * (now_ns - gaps_ns[0]) / SECOND_NS + 1e-6
    assert admitted >= min(len(gaps_ns), BURST)


def test_the_nominal_rate_is_always_admitted_whenever_it_is_read() -> None:
    budget = RateBudget(15)
    assert all(budget.admits(1, number * SECOND_NS // 15) for number in range(10_000))


def test_a_flood_is_cut_to_the_allowance() -> None:
    budget = RateBudget(15)
    admitted = sum(budget.admits(1, number * 10_000) for number in range(1_000_000))  # 100 kHz for 10 s
    assert admitted == BURST + ALLOWANCE * 15 * 10 - 1


def test_a_new_epoch_begins_anew_and_time_that_runs_back_gives_nothing() -> None:
    budget = RateBudget(1)
    assert sum(budget.admits(1, 100 * SECOND_NS - number * SECOND_NS) for number in range(50)) == BURST
    assert budget.admits(2, 0)


def test_no_rate_no_limit() -> None:
    budget = RateBudget(None)
    assert all(budget.admits(1, 0) for _ in range(10_000))


def test_a_large_message_counts_as_many_of_the_counted_size() -> None:
    guard = FloodGuard(1)
    assert [guard.admits(16 * COUNTED_BYTES) for _ in range(2)] == [True, False]
    assert [guard.admits(100) for _ in range(5)] == [True] * 4 + [False]
