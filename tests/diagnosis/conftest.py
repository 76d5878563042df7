"""Programs, and folders outside of pytest's, which only root may enter and whose names are too long for sockets."""

import tempfile
from pathlib import Path

import pytest

HOLD = "import sys; port = open(sys.argv[1], 'r+b', buffering=0); print('held', flush=True); sys.stdin.read()"
"""A program that has a device open until its input ends."""


@pytest.fixture
def short_folder():
    with tempfile.TemporaryDirectory(prefix="p", dir="/tmp") as folder:
        yield Path(folder)


@pytest.fixture
def open_folder(short_folder):
    """That every user may look into."""
    short_folder.chmod(0o755)
    return short_folder
