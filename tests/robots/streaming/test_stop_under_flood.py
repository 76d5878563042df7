"""A stop overtakes whatever floods an arm's driver: real nodes and sockets, another process that floods."""

from __future__ import annotations

import pytest

from benchmarks.stop_under_flood import Case, scene

LIMIT_S = 1.0
"""For a busy machine; `benchmarks/stop_under_flood.py` measures. Before stops overtook, it took 4 s and more."""


@pytest.mark.parametrize(
    ("robot", "kind"), [("hoap3", "invalid"), ("hoap3", "checked"), ("open_manipulator_x", "invalid")]
)
def test_a_stop_overtakes_a_flood_of_trajectories(robot: str, kind: str) -> None:
    with scene(Case(robot, kind, hosts=1)) as one:
        stop = one.stopped(after_s=0.1)
    assert stop.played_s - stop.begun_s < LIMIT_S
