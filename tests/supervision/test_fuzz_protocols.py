"""A short run of `benchmarks/fuzz_protocols.py`, each target by itself."""

from __future__ import annotations

import random
import tempfile
from pathlib import Path

import pytest

from benchmarks.fuzz_protocols import READERS, TARGETS, Readers, fuzz
from paramove.documents import MessageReader

STEPS = {"readers": 1000, "control": 15, "launcher": 3, "agent": 3, "relay": 60, "simulated": 60}


@pytest.mark.parametrize("name", TARGETS)
def test_nothing_but_messages_and_rejections(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for variable in ("XDG_RUNTIME_DIR", "PARAMOVE_SSH"):
        monkeypatch.setenv(variable, "/nowhere")  # set again in the end
    with tempfile.TemporaryDirectory(prefix="pm-", dir="/tmp") as folder:
        target = TARGETS[name](random.Random(1), Path(folder))
        for _ in range(STEPS[name]):
            target.step()
        target.end()
    assert target.outcomes


def test_every_reader_of_the_library_is_tried() -> None:
    sources = (Path(__file__).parents[2] / "src").rglob("*.py")
    made = sum(source.read_text(encoding="utf-8").count(" = MessageReader(") for source in sources)
    assert made == len(READERS)


def test_a_failure_is_reported_with_its_seed_and_input(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise IndexError("made up")

    monkeypatch.setattr(MessageReader, "read", fail)
    monkeypatch.setattr(Readers, "__init__", lambda self, *_: self.__dict__.update(latest=b"sent", executions=7))
    monkeypatch.setattr(Readers, "step", lambda _: READERS["about"].read(b""))
    written: list[str] = []
    assert fuzz(1.0, 3, written.append) == 1
    line = written[-1].splitlines()[-1]
    assert line.startswith("seed 3, readers, input 7: ")
    stored = Path(line.rpartition(" ")[2])
    assert stored.read_bytes() == b"sent"
    stored.unlink()
