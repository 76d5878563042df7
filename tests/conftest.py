"""What tests of several packages use, and in which order they run."""

import gc
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from tests.own_workspace import UserWorkspace

signal.signal(signal.SIGHUP, signal.SIG_DFL)  # `nohup make test` ignores it, and so would the programs that tests start


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Thousands of modules and tests are made that stay: nobody need look through them for garbage again and again."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_collection_modifyitems(items):
    """The long ones come first, whole systems before all: at the end no processor waits for the last of them."""
    items.sort(key=lambda item: (item.get_closest_marker("slow") is None, "system" not in item.path.parts))


@pytest.fixture
def started():
    """Starts programs; returns each and what it says first."""
    running = []

    def start(code, *arguments):
        pipe = subprocess.PIPE
        program = subprocess.Popen([sys.executable, "-c", code, *arguments], stdin=pipe, stdout=pipe, text=True)
        running.append(program)
        return program, program.stdout.readline().strip()

    yield start
    for program in running:
        program.communicate()


@pytest.fixture
def short_folder():
    """Outside of pytest's folders, whose names are too long for sockets."""
    with tempfile.TemporaryDirectory(prefix="p", dir="/tmp") as folder:
        yield Path(folder)


@pytest.fixture
def user_workspace(tmp_path, monkeypatch):
    return UserWorkspace(tmp_path, monkeypatch)
