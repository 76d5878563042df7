"""Ten thousand random steps of the gate, judged by the checker of `benchmarks/safety_steps.py`."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.safety_steps import Checker, Episode, NotAllowedError, limits_at
from paramove.safety.gate_io import State, Targets
from paramove.safety.limits import MotionLimits
from tests.safety.small_arm import HOME, PATH


@settings(deadline=None, max_examples=50, derandomize=True)
@given(st.integers(min_value=0, max_value=2**32 - 1))
def test_nothing_given_is_ever_outside_the_limits(seed: int) -> None:
    Episode(seed).run(200)


def test_the_episodes_are_worth_judging() -> None:
    """Every state is reached, most kinds of fault are found, and enough is given."""
    counts = sum((run.counts for run in map(_run, range(20))), start=Episode(0).counts)
    assert {state.value for state in State} <= set(counts)
    assert counts["given"] > 500
    assert len([what for what in counts if what.startswith("fault ")]) >= 20


def _run(seed: int) -> Episode:
    episode = Episode(seed)
    episode.run(200)
    return episode


def _run_many() -> None:
    for seed in range(40):
        _run(seed)


def rows(change: float, *, at: int = 20, count: int = 40) -> Targets:
    changed = PATH[:count].copy()
    changed[at:, 0] += change
    return Targets(0, changed, 0)


@pytest.mark.parametrize(
    ("targets", "word"),
    [
        (rows(np.nan), "not finite"),
        (rows(0.05), "velocity"),
        (rows(0.002), "acceleration"),
        (Targets(0, PATH[:20], 0), "acceleration"),
        (Targets(3, PATH[:20], 0), "gap"),
        (Targets(-1, PATH[:20], 0), "negative"),
        (Targets(0, np.outer(np.linspace(0, 1.6, 500) ** 2, [1, 0, 0]), 0), "position"),
        (Targets(0, np.outer(np.cumsum(np.cumsum(np.tile([4e-3, -4e-3], 4))), [1, 0, 0]), 8), "jerk"),
    ],
)
def test_the_checker_finds_what_is_wrong(targets: Targets, word: str) -> None:
    with pytest.raises(NotAllowedError, match=word):
        Checker(limits_at(0.01), HOME).given(targets)


@pytest.mark.parametrize("code", ["joint_limit", "velocity", "acceleration", "jerk"])
def test_a_gate_without_one_of_its_rules_is_found_out(code: str, monkeypatch: pytest.MonkeyPatch) -> None:
    first = MotionLimits._first

    def forgetful(self: MotionLimits, rule: str, *arguments: object) -> object:
        return None if rule == code else first(self, rule, *arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(MotionLimits, "_first", forgetful)
    with pytest.raises(NotAllowedError):
        _run_many()
