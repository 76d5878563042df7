"""A short run of `benchmarks/fuzz_bus.py`, and the same by hypothesis, on the envelope and every decoder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import zmq
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.fuzz_bus import KINDS, Fuzzer, fuzz, memory_mib
from paramove.bus import topics
from paramove.bus.envelope import RejectedError
from paramove.bus.subscriber import Subscriber, decoded
from tests.bus.conftest import RawPublisher, Wait


def test_nothing_but_refusals() -> None:
    before = memory_mib()
    fuzzer = Fuzzer(seed=1)
    for _ in range(15_000):
        fuzzer.step()
    assert memory_mib() - before < 100
    assert {"crc", "length", "magic", "schema", "size", "decoded", "not decoded"} <= fuzzer.outcomes.keys()


def test_the_same_seed_tries_the_same() -> None:
    first, second, third = Fuzzer(7), Fuzzer(7), Fuzzer(8)
    for fuzzer in (first, second, third):
        for _ in range(500):
            fuzzer.step()
    assert first.outcomes == second.outcomes != third.outcomes


def test_a_crash_is_told_with_its_seed(monkeypatch: pytest.MonkeyPatch) -> None:
    def crash(*_: object) -> None:
        raise IndexError("made up")

    monkeypatch.setattr(Fuzzer, "_receive", crash)
    told: list[str] = []
    assert fuzz(1.0, 3, told.append) == 1
    assert told[0].startswith("seed 3, execution 1: IndexError: made up")


@settings(deadline=None, derandomize=True, max_examples=300)
@given(st.sampled_from(KINDS), st.binary(max_size=300))
def test_any_payload_decodes_or_is_refused(kind: Any, payload: bytes) -> None:
    try:
        message = decoded(topics.Topic("x", kind, None, topics.Profile.QUEUE), payload)
    except RejectedError:
        return
    assert type(kind.FromString(message.SerializeToString())) is kind


def test_a_subscriber_survives_a_thousand_inputs(context: zmq.Context[Any], folder: Path, wait: Wait) -> None:
    """The same inputs over a real socket; afterwards a speaker that starts anew is heard."""
    speaker = RawPublisher(context, folder, topics.TRUTH_STATE)
    subscriber = Subscriber(context, folder, topics.TRUTH_STATE)
    wait(speaker.subscribed)
    fuzzer = Fuzzer(2)

    def say(_: Any, header: bytes, payload: bytes) -> None:
        if fuzzer._generator.random() < 0.5:
            speaker.say(payload, published_ns=fuzzer.executions * 10**9)
        else:
            speaker.socket.send_multipart([b"truth/state\0" + header, payload])

    fuzzer._receive = say  # type: ignore[method-assign]
    for number in range(1000):
        fuzzer.step()
        if number % 100 == 99:
            wait(lambda: subscriber.receive() is None)
    speaker.epoch, speaker.sequence = 2**31, 0
    speaker.say(b"")
    wait(lambda: (heard := subscriber.receive()) and not heard.message.ByteSize() and heard.sequence == 1)
    assert subscriber.counter.rejected.total() > 500
