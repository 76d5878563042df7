"""The simulated world with the nodes that watch it: real processes, the real launch file, simulated light."""

import pytest

from tests.system.conftest import WATCHING

BY_WALL = ("begun_monotonic_s", "wall_s", "realtime_factor")
OVERLAYS = ("rule_learning", "--with", "sim", "--with", WATCHING, "--headless", "--seed", "5")


@pytest.mark.slow
def test_same_seed_gives_the_same_world_and_ends_well(launcher):
    outcomes = []
    for _ in range(2):
        code, shown = launcher.run(*OVERLAYS)
        assert code == 0, shown
        assert "done: simulator has finished" in shown
        truth = launcher.truth()
        outcomes.append({key: value for key, value in truth.items() if key not in BY_WALL})
    assert outcomes[0] == outcomes[1]
