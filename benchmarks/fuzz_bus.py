"""Feeds damaged and random bytes to the envelope, every decoder and a subscriber; anything but a rejection fails.

    python benchmarks/fuzz_bus.py [--seconds 60] [--seed 0]

Inputs are mutations (bits, bytes, cuts, repetitions, splices, lengths, nesting) of good messages of every type of the
topic table. Two kinds: damaged header and payload together, and a damaged payload behind a header that fits, as a
defective publisher would send it. What decodes is encoded, decoded again and printed. Prints executions per second and
memory; the exit code is 1 and the seed is named if something was raised that is not a rejection.
"""

from __future__ import annotations

import argparse
import random
import resource
import sys
import time
from collections import Counter
from collections.abc import Callable
from typing import Any

from google.protobuf.message import DecodeError  # type: ignore[import-untyped]

from paramove.bus import (
    SIZE,
    Envelope,
    RateBudget,
    RejectedError,
    SequenceCounter,
    pack,
    schema_hash,
    to_marks,
    topics,
    unpack,
)
from paramove.msgs.clock_pb2 import TickDone

MAX_BYTES = 2**16
KINDS: list[Any] = [*dict.fromkeys([topic.type for topic in topics.TOPICS] + [topics.status("x").type, TickDone])]


def example(kind: Any, generator: random.Random, depth: int = 3) -> Any:
    """A message with random fields set to random values, also to those at the edges."""
    message = kind()
    for field in message.DESCRIPTOR.fields:
        if generator.random() < 0.2:
            continue
        value = getattr(message, field.name)
        repeated = hasattr(value, "extend")
        for _ in range(generator.randrange(1, 4) if repeated else 1):
            if field.message_type is not None:
                if depth:
                    part = value.add() if repeated else value
                    part.CopyFrom(example(type(part), generator, depth - 1))
            elif repeated:
                value.append(_value(field, generator))
            else:
                setattr(message, field.name, _value(field, generator))
    return message


def _value(field: Any, generator: random.Random) -> Any:
    if field.enum_type is not None:
        return generator.choice(field.enum_type.values).number
    if field.cpp_type == field.CPPTYPE_STRING:
        text = "".join(generator.choices("aé\0\n{}<€", k=generator.randrange(8)))
        return text.encode() if field.type == field.TYPE_BYTES else text
    if field.cpp_type == field.CPPTYPE_BOOL:
        return generator.random() < 0.5
    if field.cpp_type in (field.CPPTYPE_DOUBLE, field.CPPTYPE_FLOAT):
        return generator.choice([0.0, -0.0, 1.5, 1e30, float("inf"), float("nan")])
    return generator.choice([0, 1, 127, 128, 2**31 - 1])


def mutate(content: bytes, other: bytes, generator: random.Random, max_bytes: int = MAX_BYTES) -> bytes:
    """One to four mutations."""
    mutated = bytearray(content)
    for _ in range(generator.choice([1, 1, 1, 2, 4])):
        at = generator.randrange(len(mutated) + 1)
        mutation = generator.randrange(8)
        if mutation == 0 and at < len(mutated):
            mutated[at] ^= 1 << generator.randrange(8)
        elif mutation == 1 and at < len(mutated):
            mutated[at] = generator.choice([0, 1, 0x7F, 0x80, 0xFF])
        elif mutation == 2:
            del mutated[at:]
        elif mutation == 3:
            del mutated[at : at + generator.randrange(1, 9)]
        elif mutation == 4:
            mutated[at:at] = generator.randbytes(generator.randrange(1, 9))
        elif mutation == 5:
            mutated[at:at] = mutated[at : at + generator.randrange(64)] * generator.randrange(1, 50)
        elif mutation == 6:
            mutated[at:] = other[generator.randrange(len(other) + 1) :]
        else:
            bomb = [
                b"\xff\xff\xff\xff\x07",
                b"\xff" * 9 + b"\x01",
                b"\x0b" * 300,
                b"\x0a\x7f" * 100,
                b"\x1a\x00" * 2000,
            ]
            mutated[at:at] = generator.choice(bomb)
    return bytes(mutated[:max_bytes])


class Fuzzer:
    """Same seed, same inputs.

    Attributes:
        executions: Inputs tried.
        outcomes: How they ended: a reason of rejection, "decoded", "not decoded".
    """

    def __init__(self, seed: int) -> None:
        self._generator = random.Random(seed)
        self.executions = 0
        self.outcomes: Counter[str] = Counter()
        self._counter = SequenceCounter()
        self._budget = RateBudget(15)
        self._corpus = [(kind, example(kind, self._generator).SerializeToString()) for kind in KINDS for _ in range(8)]

    def step(self) -> None:
        """Tries one input; any exception but a rejection propagates."""
        kind, content = self._generator.choice(self._corpus)
        other = self._generator.choice(self._corpus)[1]
        self.executions += 1
        try:
            if self._generator.random() < 0.5:
                self._envelope(kind, content, other)
            else:
                self._decoder(kind, mutate(content, other, self._generator))
        except RejectedError as error:
            self.outcomes[error.reason.value] += 1

    def _envelope(self, kind: Any, content: bytes, other: bytes) -> None:
        envelope = Envelope(schema_hash(kind), 1, 2, self.executions, 3, 4, self._generator.randrange(4))
        whole = mutate(pack(envelope, content) + content, other, self._generator)
        split = SIZE if self._generator.random() < 0.8 else self._generator.randrange(len(whole) + 1)
        self._receive(kind, whole[:split], whole[split:])

    def _decoder(self, kind: Any, content: bytes) -> None:
        edges = [0, 1, self.executions, 2**63, 2**64 - 1]
        epoch = self._generator.randrange(2**32) if self._generator.random() < 0.01 else 2
        time_ns = self._generator.choice([0, -(2**63), 2**63 - 1, self.executions])
        envelope = Envelope(
            schema_hash(kind), 1, epoch, self._generator.choice(edges), time_ns, time_ns, self._generator.randrange(256)
        )
        self._receive(kind, pack(envelope, content), content)

    def _receive(self, kind: Any, header: bytes, payload: bytes) -> None:
        """What a subscriber does, and a reader of the message after it."""
        envelope = unpack(header, payload, schema_hash(kind), MAX_BYTES)
        self._counter.accept(envelope)
        self._budget.admits(envelope.epoch, envelope.published_ns)
        try:
            message = kind.FromString(payload)
        except (DecodeError, ValueError):
            self.outcomes["not decoded"] += 1
            return
        self.outcomes["decoded"] += 1
        again = kind.FromString(message.SerializeToString(deterministic=True))
        if len(payload) < 2000:
            str(again)
        if kind is TickDone:
            to_marks(again.published)


def memory_mib() -> float:
    """Largest resident memory of this process so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def fuzz(seconds: float, seed: int, write: Callable[[str], object]) -> int:
    """Fuzzes and prints the counts; returns the exit code."""
    fuzzer = Fuzzer(seed)
    started_s = time.monotonic()
    before = memory_mib()
    try:
        while time.monotonic() - started_s < seconds:
            for _ in range(500):
                fuzzer.step()
    except Exception as error:
        write(f"seed {seed}, execution {fuzzer.executions}: {type(error).__name__}: {error}\n")
        return 1
    elapsed_s = time.monotonic() - started_s
    write(
        f"{fuzzer.executions} executions in {elapsed_s:.0f} s ({fuzzer.executions / elapsed_s:.0f}/s), seed {seed}, "
        f"{len(KINDS)} message types, 0 crashes, memory {memory_mib():.0f} MiB (began with {before:.0f})\n"
    )
    for outcome, count in fuzzer.outcomes.most_common():
        write(f"  {outcome:12} {count}\n")
    return 0


def run(about: str | None, fuzz: Callable[[float, int, Callable[[str], object]], int]) -> None:
    """The command line of a fuzzer: its time and its seed; ends with its exit code.

    Args:
        about: Docstring of the program. fuzz: Gets both, and what writes a text.
    """
    parser = argparse.ArgumentParser(description=(about or "").splitlines()[0])
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    sys.exit(fuzz(arguments.seconds, arguments.seed, sys.stdout.write))


if __name__ == "__main__":
    run(__doc__, fuzz)
