"""What tests of several packages use."""

import subprocess
import sys

import pytest


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
