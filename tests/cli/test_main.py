"""What the `paramove` script does before any command."""

from __future__ import annotations

import os

import pytest

from paramove.cli import main as script


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
