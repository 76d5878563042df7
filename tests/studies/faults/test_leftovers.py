"""What a run has left behind is found: processes, sockets, locks."""

import fcntl
import os
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from studies.faults.leftovers import left_over

DOMAIN = f"leftovers-{os.getpid()}"


@pytest.fixture
def runtime() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="pm-", dir="/tmp") as folder:
        (Path(folder) / DOMAIN).mkdir()
        yield Path(folder)


def test_nothing_is_left_of_nothing(runtime: Path) -> None:
    assert left_over(DOMAIN, runtime) == []
    assert left_over(DOMAIN, runtime / "absent") == []


def test_a_living_process_of_the_domain_is_found(runtime: Path) -> None:
    waits = [sys.executable, "-c", "import sys; print('here', flush=True); sys.stdin.read()"]
    domain = os.environ | {"PARAMOVE_DOMAIN": DOMAIN}
    process = subprocess.Popen(waits, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=domain)
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == b"here\n"  # a program that has only just begun has no environment yet
        (found,) = left_over(DOMAIN, runtime)
        assert f"process {process.pid}" in found
    finally:
        process.communicate()
    assert left_over(DOMAIN, runtime) == []


def test_an_open_socket_is_reported_and_a_stale_one_is_not(runtime: Path) -> None:
    path = runtime / DOMAIN / "clock"
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as listener:
        listener.bind(str(path))
        listener.listen()
        assert left_over(DOMAIN, runtime) == ["socket clock is open"]
    assert path.is_socket()
    assert left_over(DOMAIN, runtime) == []


@pytest.mark.parametrize("where", ["{}/clock.lock", "{}.lock", "truth-{}/x/truth.state.lock"])
def test_a_held_lock_is_found_and_a_free_one_is_not(runtime: Path, where: str) -> None:
    path = runtime / where.format(DOMAIN)
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        assert left_over(DOMAIN, runtime) == [f"lock {path.name} is held"]
    assert left_over(DOMAIN, runtime) == []
