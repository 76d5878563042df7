"""Processes of the real demo, killed while it runs in real time at half the pace: what follows, but not how soon.

`python -m studies kills` does all cases and measures the times.
"""

import os
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from paramove.supervision.launch_file import load
from paramove.workspace import Workspace
from studies.faults.kill_cases import cases_of
from studies.faults.kill_run import KillResult, KillRun

ROOT = Path(__file__).parents[2]
FILE = load(Workspace.at(ROOT), "rule_learning", ["sim", "real_time"]).file

pytestmark = pytest.mark.slow


@pytest.fixture
def runtime(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    with tempfile.TemporaryDirectory(prefix="pm-", dir="/tmp") as folder:
        monkeypatch.setenv("XDG_RUNTIME_DIR", folder)
        yield


def killed(node: str, moment: str, folder: Path) -> KillResult:
    cases = cases_of(FILE, [node], ["KILL"], [moment])
    (result,) = KillRun(ROOT, folder, f"kill-{os.getpid()}", seed=0, pace=0.5).perform(cases)
    assert result.problems == [], (folder / "output.log").read_text(errors="replace")[-3000:]
    assert result.step is not None
    assert result.step.within_limits
    return result


@pytest.mark.usefixtures("runtime")
def test_arm_driver_killed_in_motion_comes_back_disarmed_and_the_run_ends_so(tmp_path: Path) -> None:
    result = killed("arm_driver", "moving", tmp_path)
    assert re.search(r"arm_driver was killed \(SIGKILL\) and is back: .*disarmed", result.detail), result.detail
    assert result.exit_code == 1


@pytest.mark.long
@pytest.mark.usefixtures("runtime")
def test_camera_killed_comes_back_and_the_run_goes_on(tmp_path: Path) -> None:
    result = killed("camera", "rest", tmp_path)
    assert result.ready_s is not None
    assert "was killed (SIGKILL); restart 1 in " in (tmp_path / "output.log").read_text()
    outcome = YAML(typ="safe").load((Path(result.run_folder) / "run.yaml").read_text())["outcome"]["nodes"]["camera"]
    assert (outcome["state"], outcome["exit_code"], outcome["restarts"]) == ("stopped", 0, 1)


@pytest.mark.long
@pytest.mark.usefixtures("runtime")
def test_simulator_killed_ends_the_run_and_is_named(tmp_path: Path) -> None:
    result = killed("simulator", "moving", tmp_path)
    assert "simulator was killed (SIGKILL)" in result.detail
    assert result.exit_code == 1


@pytest.mark.usefixtures("runtime")
def test_nothing_outlives_a_killed_launcher(tmp_path: Path) -> None:
    result = killed("launcher", "moving", tmp_path)
    assert "the launcher was killed" in result.detail
