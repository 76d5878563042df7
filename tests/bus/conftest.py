"""A bus folder of its own for each test, short enough for a socket path."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import zmq


@pytest.fixture
def folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="bus-") as path:
        yield Path(path)


class KeepingContext(zmq.Context[Any]):
    """Keeps every socket made until the end, so that none is lost to the garbage collector unclosed."""

    def __init__(self) -> None:
        super().__init__()
        self.made: list[zmq.Socket[Any]] = []

    def socket(self, *args: Any, **kwargs: Any) -> Any:
        made = super().socket(*args, **kwargs)
        self.made.append(made)
        return made

    def __setattr__(self, key: str, value: Any) -> None:
        object.__setattr__(self, key, value)


@pytest.fixture
def context() -> Iterator[zmq.Context[Any]]:
    made = KeepingContext()
    yield made
    for opened in made.made:
        opened.close(linger=0)
    made.term()


Wait = Callable[..., Any]


@pytest.fixture
def wait() -> Wait:
    """`wait(condition, *also)` calls everything again and again until `condition()` is true; returns what it gave."""

    def until(condition: Callable[[], Any], *also: Callable[[], Any], seconds: float = 10.0) -> Any:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            for call in also:
                call()
            if result := condition():
                return result
            zmq.Poller().poll(1)
        raise AssertionError(f"not within {seconds} s: {condition}")

    return until
