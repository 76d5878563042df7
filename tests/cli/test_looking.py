"""Commands that only look run nothing of the current folder, whosever it is."""

import os
import subprocess
import sys

import pytest

from paramove.supervision.environment import NEEDED

LOOKING = (
    "graph rule_learning",
    "demos show nowhere",
    "doctor --only installation --only graphics --only resources",
    "models",
    "topic list",
    "logs",
    "models show reaching",
)


@pytest.fixture(scope="module")
def hostile(tmp_path_factory):
    """A folder with a module in place of every one that is needed, and of every node; each leaves a file behind."""
    folder = tmp_path_factory.mktemp("hostile")
    (folder / "launch").mkdir()
    (folder / "nodes").mkdir()
    leaves = f"open({str(folder / 'was_run')!r}, 'a').write(__name__)\n"
    for name in (*NEEDED.split(), "sitecustomize", "usercustomize", "websockets", "yaml"):
        (folder / f"{name}.py").write_text(leaves)
    for name in ("camera", "recorder", "arm_driver"):
        (folder / "nodes" / f"{name}.py").write_text(f"{leaves}SUBSCRIBES = ()\nPUBLISHES = ()\n")
    return folder


@pytest.mark.parametrize("command", LOOKING)
def test_a_command_that_only_looks_runs_no_module_of_the_current_folder(hostile, command):
    done = subprocess.run(
        [sys.executable, "-P", "-m", "paramove.cli.main", *command.split()],
        cwd=hostile,
        env={**os.environ, "PYTHONPATH": ""},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "Traceback" not in done.stderr
    assert not (hostile / "was_run").exists()
