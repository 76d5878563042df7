"""Folders outside of pytest's, which ordinary users may not enter and whose names are too long for sockets."""

import tempfile
from pathlib import Path

import pytest


@pytest.fixture
def short_folder():
    with tempfile.TemporaryDirectory(prefix="p", dir="/tmp") as folder:
        yield Path(folder)


@pytest.fixture
def open_folder(short_folder):
    """That every user may look into."""
    short_folder.chmod(0o755)
    return short_folder
