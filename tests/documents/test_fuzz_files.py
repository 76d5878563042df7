"""A short run of `benchmarks/fuzz_files.py`, without what it measures of time and memory."""

from __future__ import annotations

import random
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks.fuzz_files import READERS, Kind, Outcome, Reader, beside_robots, damaged, kinds

ROUNDS = 3


@pytest.fixture(scope="module")
def known(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Kind]:
    return kinds(tmp_path_factory.mktemp("whole"))


@pytest.fixture(scope="module")
def reader() -> Iterator[Reader]:
    process = Reader()
    yield process
    process.close()


def outcome(reader: Reader, name: str, path: Path, content: bytes) -> Outcome:
    beside_robots(path.parent)
    path.write_bytes(content)
    found = reader.read(name, path)
    shutil.rmtree(path.parent)
    return found


def test_nothing_but_readings_and_rejections(tmp_path: Path, reader: Reader, known: dict[str, Kind]) -> None:
    assert known.keys() == READERS.keys()
    generator = random.Random(1)
    for _ in range(ROUNDS):
        for name, kind in known.items():
            path = tmp_path / "files" / f"{name}{kind.ending}"
            found = outcome(reader, name, path, damaged(kind, generator))
            assert found.end in ("read", "rejected"), found.raised


def test_whole_files_are_read(tmp_path: Path, reader: Reader, known: dict[str, Kind]) -> None:
    for name, kind in known.items():
        for content in kind.examples:
            found = outcome(reader, name, tmp_path / "files" / f"{name}{kind.ending}", content)
            assert found.end == "read", found.raised
