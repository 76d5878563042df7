"""A terminal in the workspace, and a person who does what a command asks for."""

from __future__ import annotations

import atexit
import contextlib
import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from tests.docs.markdown import ROOT
from tests.robots.dynamixel.koch_arm import PLAN, Step

RUNTIME = tempfile.TemporaryDirectory(prefix="paramove-docs-")  # sockets lie there; short, as their paths must be
atexit.register(RUNTIME.cleanup)
ENVIRONMENT = {
    **os.environ,
    "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
    "XDG_RUNTIME_DIR": RUNTIME.name,
    "PARAMOVE_DOMAIN": "docs",
    "COLUMNS": "120",
    "NO_COLOR": "1",
}
REQUEST = "Enter when it is done, q to end.\n"
LAST_JOINT = f"  {PLAN.servos[-1].joint}: "


def started(command: str, environment: Mapping[str, str], source: int = subprocess.PIPE) -> subprocess.Popen[str]:
    """A line typed in bash, whose output is read and whose input is written."""
    return subprocess.Popen(
        ["bash", "-euo", "pipefail", "-c", command],
        cwd=ROOT,
        env=dict(environment),
        stdin=source,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def at_terminal(command: str, keys: str, environment: Mapping[str, str]) -> tuple[int, str]:
    """Exit code and output of a command whose input is a terminal, at which these keys were pressed."""
    keyboard, terminal = os.openpty()
    try:
        os.write(keyboard, keys.encode())
        with started(command, environment, terminal) as running:
            output, _ = running.communicate(timeout=300)
    finally:
        os.close(keyboard)
        os.close(terminal)
    return running.returncode, output


def attended(command: str, steps: Iterable[Step], environment: Mapping[str, str]) -> tuple[int, str]:
    """Exit code and output of a command whose requests a person follows: each is read before the next step is taken."""
    with started(command, environment) as running:
        assert running.stdin is not None
        assert running.stdout is not None
        said = []
        for act, line in steps:
            for answer in iter(running.stdout.readline, ""):
                said.append(answer)
                if answer.endswith(REQUEST) or answer.startswith(LAST_JOINT):
                    break
            act()
            running.stdin.write(line)
            running.stdin.flush()
        rest, _ = running.communicate(timeout=300)
    return running.returncode, "".join(said) + rest


def heard(running: subprocess.Popen[str], *words: str) -> None:
    """Read on until a line has all these words."""
    seen = []
    assert running.stdout is not None
    for line in running.stdout:
        seen.append(line)
        if all(word in line for word in words):
            return
    raise AssertionError(f"{words} was not said:\n{''.join(seen)}")


@contextlib.contextmanager
def launched(command: str, environment: Mapping[str, str]) -> Iterator[subprocess.Popen[str]]:
    """An application, which ends with the test, and after five minutes in any case: then nothing is to be read."""
    with started(f"exec {command}", environment) as running:
        ends = threading.Timer(300.0, running.kill)
        ends.start()
        try:
            yield running
        finally:
            ends.cancel()
            if running.poll() is None:
                running.terminate()
