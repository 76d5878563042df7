"""The simulated world with the nodes that watch it: real processes, the real launch file, simulated light."""

import os
import signal
from pathlib import Path

from ruamel.yaml import YAML

from tests.supervision.conftest import until
from tests.system.conftest import WATCHING

BY_WALL = ("begun_monotonic_s", "wall_s", "realtime_factor")
OVERLAYS = ("rule_learning", "--with", "sim", "--with", WATCHING, "--headless", "--seed", "5")


def pid_of(module, folder):
    """Process of a node of the run that lies in `folder`."""
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                command = (entry / "cmdline").read_bytes().decode().split("\0")
            except OSError:
                continue
            if module in command and str(folder) in command[-2]:
                return int(entry.name)
    return None


def test_same_seed_gives_the_same_world_and_ends_well(launcher):
    outcomes = []
    for _ in range(2):
        code, shown = launcher.run(*OVERLAYS)
        assert code == 0, shown
        assert "done: simulator has finished" in shown
        truth = launcher.truth()
        outcomes.append({key: value for key, value in truth.items() if key not in BY_WALL})
    assert outcomes[0] == outcomes[1]


def test_killed_tracker_comes_back_and_the_run_goes_on(launcher):
    process = launcher.start(*OVERLAYS, "--set", "simulator.max_duration_s=20")
    log = launcher.latest / "logs" / "colour_tracker.log"
    until(lambda: log.exists() and "ready" in log.read_text(), "the tracker is ready")
    os.kill(pid_of("nodes.colour_tracker", launcher.folder), signal.SIGKILL)
    shown = process.communicate(timeout=120)[0]
    assert process.returncode == 0, shown
    assert "was killed (SIGKILL); restart 1 in 0.1 s" in shown
    found = YAML(typ="safe").load((launcher.latest / "run.yaml").read_text())["outcome"]["nodes"]["colour_tracker"]
    assert (found["state"], found["exit_code"], found["restarts"]) == ("stopped", 0, 1)
