"""Variables with the terminal's size swallow no output and end no command."""

import os
import subprocess
import sys

import pytest

from paramove.terminal_size import drop_unusable_sizes

ODD = ["0", "1", "-5", "", "zero", "²", "٣", "1e3", "999999999999", "9" * 5000]


@pytest.mark.parametrize("name", ["COLUMNS", "LINES", "TERMINAL_WIDTH"])
@pytest.mark.parametrize("value", ODD, ids=range(len(ODD)))
def test_an_unusable_size_is_dropped(name, value):
    variables = {name: value, "TERM": "dumb"}
    drop_unusable_sizes(variables)
    assert variables == {"TERM": "dumb"}


@pytest.mark.parametrize(("name", "value"), [("COLUMNS", "80"), ("COLUMNS", "020"), ("LINES", "24")])
def test_a_usable_size_is_kept(name, value):
    variables = {name: value}
    drop_unusable_sizes(variables)
    assert variables == {name: value}


@pytest.mark.parametrize(
    "command",
    [
        ["-m", "paramove.cli.main", "--help"],
        ["-m", "paramove.cli.main", "doctor", "--only", "resources"],
        ["-m", "paramove.cli.launch", "no_such_application"],
        ["-m", "studies", "--help"],
    ],
    ids=" ".join,
)
def test_every_command_prints_as_without_them(command):
    without = {name: text for name, text in os.environ.items() if name not in ("COLUMNS", "LINES", "TERMINAL_WIDTH")}
    odd = without | {"COLUMNS": "0", "LINES": "0", "TERMINAL_WIDTH": "wide", "TERM": "none-such"}
    expected = subprocess.run([sys.executable, *command], capture_output=True, text=True, env=without, timeout=60)
    found = subprocess.run([sys.executable, *command], capture_output=True, text=True, env=odd, timeout=60)
    assert expected.stdout + expected.stderr
    assert found.returncode == expected.returncode
    assert len(found.stdout.splitlines()) == len(expected.stdout.splitlines())
    assert len(found.stderr.splitlines()) == len(expected.stderr.splitlines())
