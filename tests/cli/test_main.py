"""What the `paramove` script does before any command."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from paramove.cli import main as script
from paramove.documents import exit_codes


@pytest.mark.parametrize("own", [None, "4"])
def test_linear_algebra_has_one_thread_unless_the_user_says_otherwise(
    monkeypatch: pytest.MonkeyPatch, own: str | None
) -> None:
    names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
    for name in names:
        monkeypatch.delenv(name, raising=False)
    if own is not None:
        monkeypatch.setenv(names[0], own)
    seen = []
    monkeypatch.setattr(script, "build", lambda wanted: lambda prog_name: seen.append([os.environ[n] for n in names]))
    script.main()
    assert seen == [[own or "1", "1", "1"]]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full here")
def test_output_that_cannot_be_written_is_reported_with_an_exit_code():
    with open("/dev/full", "wb") as full:
        command = [sys.executable, "-m", "paramove.cli.main", "--version"]
        ended = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert ended.returncode == exit_codes.TEMPORARY
    assert ended.stderr == "the output cannot be written: No space left on device\n"
