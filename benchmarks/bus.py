"""Latency of the bus at 1 kHz with messages of 216 bytes, beside ZeroMQ alone on the same kind of socket.

    python benchmarks/bus.py [--seconds 5] [--json FILE]

A process says, another hears; both read the same monotonic clock. `raw` sends the same bytes with libzmq PUB and SUB
and nothing else, so the difference is what the envelope, its checks and the protobuf decoding cost.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import statistics
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import zmq

from paramove.bus import topics
from paramove.bus.publisher import Publisher
from paramove.bus.subscriber import Subscriber
from paramove.msgs.hoap3_wire_pb2 import StreamBatch

PAYLOAD_BYTES = 216
PERIOD_NS = 1_000_000


def _batch() -> StreamBatch:
    batch = StreamBatch(epoch=1, first_index=1)
    while batch.ByteSize() < PAYLOAD_BYTES:
        batch.frames += b"\0"
    return batch


def _paced(messages: int) -> Iterator[int]:
    """Counts up once a millisecond, by absolute times."""
    start_ns = time.monotonic_ns()
    for number in range(messages):
        left_ns = start_ns + number * PERIOD_NS - time.monotonic_ns()
        if left_ns > 0:
            time.sleep(left_ns * 1e-9)
        yield number


def speak_bus(folder: Path, messages: int) -> None:
    """The speaker of the bus: waits for its listener, then says."""
    context: zmq.Context[Any] = zmq.Context()
    publisher = Publisher(context, folder, topics.WIRE_HOAP3_STREAM, "speaker")
    while publisher.subscriptions == 0:
        publisher.socket.poll()
        publisher.serve()
    batch = _batch()
    for _ in _paced(messages):
        now_ns = time.monotonic_ns()
        publisher.publish(batch, now_ns, now_ns)
    publisher.close()
    context.term()


def speak_raw(folder: Path, messages: int) -> None:
    """The speaker of ZeroMQ alone."""
    context: zmq.Context[Any] = zmq.Context()
    socket = context.socket(zmq.XPUB)
    socket.bind(f"ipc://{folder / 'raw'}")
    socket.recv()
    filler = b"\0" * (PAYLOAD_BYTES - 8)
    for _ in _paced(messages):
        socket.send(struct.pack("<q", time.monotonic_ns()) + filler)
    socket.close(linger=1000)
    context.term()


def hear_bus(folder: Path, messages: int) -> tuple[list[int], int]:
    """Latencies in ns, and how many messages were lost."""
    context: zmq.Context[Any] = zmq.Context()
    subscriber = Subscriber(context, folder, topics.WIRE_HOAP3_STREAM)
    latencies = []
    while subscriber.counter.messages + subscriber.counter.lost < messages and subscriber.socket.poll(5000):
        while (heard := subscriber.receive()) is not None:
            latencies.append(time.monotonic_ns() - heard.published_ns)
    lost = messages - len(latencies)
    subscriber.close()
    context.term()
    return latencies, lost


def hear_raw(folder: Path, messages: int) -> tuple[list[int], int]:
    """Latencies in ns, and how many messages were lost."""
    context: zmq.Context[Any] = zmq.Context()
    socket = context.socket(zmq.SUB)
    socket.connect(f"ipc://{folder / 'raw'}")
    socket.subscribe(b"")
    latencies = []
    while len(latencies) < messages and socket.poll(5000):
        with contextlib.suppress(zmq.Again):
            (sent_ns,) = struct.unpack("<q", socket.recv(zmq.NOBLOCK)[:8])
            latencies.append(time.monotonic_ns() - sent_ns)
    socket.close()
    context.term()
    return latencies, messages - len(latencies)


def measure(kind: str, hear: Callable[[Path, int], tuple[list[int], int]], messages: int) -> dict[str, Any]:
    """Starts the speaker in a process of its own and hears it in this one."""
    with tempfile.TemporaryDirectory(prefix="bus-") as folder:
        command = [sys.executable, __file__, "--speak", kind, "--folder", folder, "--messages", str(messages)]
        with subprocess.Popen(command):
            latencies, lost = hear(Path(folder), messages)
    latencies.sort()
    return {
        "kind": kind,
        "messages": messages,
        "payload_bytes": PAYLOAD_BYTES,
        "lost": lost,
        "p50_us": round(statistics.median(latencies) * 1e-3, 1),
        "p99_us": round(latencies[int(0.99 * len(latencies))] * 1e-3, 1),
        "max_us": round(latencies[-1] * 1e-3, 1),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seconds", type=float, default=5.0, help="of each of the two measurements")
    parser.add_argument("--json", type=Path, help="also write the results here")
    parser.add_argument("--speak", choices=["bus", "raw"], help=argparse.SUPPRESS)
    parser.add_argument("--folder", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--messages", type=int, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.speak:
        {"bus": speak_bus, "raw": speak_raw}[arguments.speak](arguments.folder, arguments.messages)
        return
    messages = int(1000 * arguments.seconds)
    results = [measure("raw", hear_raw, messages), measure("bus", hear_bus, messages)]
    for result in results:
        sys.stdout.write(
            "{kind}: p50 {p50_us} us, p99 {p99_us} us, max {max_us} us, {lost} of {messages} lost\n".format(**result)
        )
    if arguments.json:
        content = {"cpus": os.cpu_count(), "libzmq": zmq.zmq_version(), "results": results}
        arguments.json.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
