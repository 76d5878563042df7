"""Stalls of the feeder, late, lost, repeated and overtaken batches: a short run of `benchmarks/stream_stalls.py`."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from benchmarks.stream_stalls import NotSmoothError, judge, run, swing


def test_every_under_run_is_a_smooth_stop() -> None:
    seen: Counter[str] = Counter()
    for seed in range(200):
        frames, happened = run(np.random.default_rng(seed))
        judge(frames)
        seen += happened
    assert seen["under-run"] > 100
    assert min(seen[what] for what in ("lost", "repeated", "overtaken", "refused", "played to its end")) > 20


@pytest.mark.parametrize("word", ["velocity", "acceleration", "jerk"])
def test_the_judge_finds_what_is_not_smooth(word: str) -> None:
    robot = swing().robot
    held = robot.units.to_counts(robot.base_pose).astype(np.float64)
    frames = np.repeat(held[None], 200, axis=0)
    elbow = robot.index("right_elbow")
    if word == "velocity":
        frames[100:, elbow] += 60
    elif word == "acceleration":
        frames[:, elbow] += np.linspace(0, 2000, 200).round()  # at 10 counts/ms into rest
    else:
        # ±2870 deg/s², within what a stop may use, changing sides every 24 ms.
        speed = np.cumsum(np.tile(np.repeat([0.6, -0.6], 24), 4))
        frames[:192, elbow] += np.cumsum(speed).round()
        frames[192:] = frames[191]
    with pytest.raises(NotSmoothError, match=f"{word} of right_elbow"):
        judge(frames)


def test_the_undisturbed_swing_is_smooth() -> None:
    judge(swing().robot.units.to_counts(swing().path).astype(np.float64))
