"""Programs, and a folder outside of pytest's, which only root may enter."""

import pytest

HOLD = "import sys; port = open(sys.argv[1], 'r+b', buffering=0); print('held', flush=True); sys.stdin.read()"
"""A program that has a device open until its input ends."""


@pytest.fixture
def open_folder(short_folder):
    """That every user may look into."""
    short_folder.chmod(0o755)
    return short_folder
