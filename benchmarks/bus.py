"""Latency and losses of the bus.

    python benchmarks/bus.py [--seconds 5] [--json FILE]
    python benchmarks/bus.py --soak 600 [--variant healthy|sleeping|stopped|all] [--json FILE]

The first measures the latency at 1 kHz with messages of 216 bytes. One process publishes, another subscribes; both read
the same monotonic clock. `raw` sends the same bytes with libzmq PUB and SUB and nothing else, so the difference is what
the envelope, its checks and the protobuf decoding cost. rospy (with a roscore running), zenoh and LCM follow where they
are installed, each as it comes.

The second publishes 1000 such messages and 30 images of 1 MB a second to two subscribers, and to a third one that
sleeps or is stopped, and compares what they have counted with what was published.
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
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # run as a program, only this folder is known

import zmq

from benchmarks.bus_peers import PAYLOAD_BYTES, PEERS, describe, installed, paced
from benchmarks.bus_soak import VARIANTS, batch, soak, summary_text
from paramove.bus import Publisher, Subscriber, topics


def publish_bus(folder: Path, messages: int) -> None:
    """The publisher of the bus: waits for its subscriber, then publishes."""
    context: zmq.Context[Any] = zmq.Context()
    publisher = Publisher(context, folder, topics.WIRE_HOAP3_STREAM, "speaker")
    while publisher.subscriptions == 0:
        publisher.socket.poll()
        publisher.serve()
    message = batch()
    for _ in paced(messages):
        now_ns = time.monotonic_ns()
        publisher.publish(message, now_ns, now_ns)
    publisher.close()
    context.term()


def publish_raw(folder: Path, messages: int) -> None:
    """The publisher of ZeroMQ alone."""
    context: zmq.Context[Any] = zmq.Context()
    socket = context.socket(zmq.XPUB)
    socket.bind(f"ipc://{folder / 'raw'}")
    socket.recv()
    filler = b"\0" * (PAYLOAD_BYTES - 8)
    for _ in paced(messages):
        socket.send(struct.pack("<q", time.monotonic_ns()) + filler)
    socket.close(linger=1000)
    context.term()


def subscribe_bus(folder: Path, messages: int) -> tuple[list[int], int]:
    """Latencies in ns, and how many messages were lost."""
    context: zmq.Context[Any] = zmq.Context()
    subscriber = Subscriber(context, folder, topics.WIRE_HOAP3_STREAM)
    latencies: list[int] = []
    while subscriber.counter.messages + subscriber.counter.lost < messages and subscriber.socket.poll(5000):
        received = subscriber.receive(ready=True)  # as the bus does it
        while received is not None:
            latencies.append(time.monotonic_ns() - received.published_ns)
            received = subscriber.receive()
    lost = messages - len(latencies)
    subscriber.close()
    context.term()
    return latencies, lost


def subscribe_raw(folder: Path, messages: int) -> tuple[list[int], int]:
    """Latencies in ns, and how many messages were lost."""
    context: zmq.Context[Any] = zmq.Context()
    socket = context.socket(zmq.SUB)
    socket.connect(f"ipc://{folder / 'raw'}")
    socket.subscribe(b"")
    latencies: list[int] = []
    while len(latencies) < messages and socket.poll(5000):
        with contextlib.suppress(zmq.Again):
            (sent_ns,) = struct.unpack("<q", socket.recv(zmq.NOBLOCK)[:8])
            latencies.append(time.monotonic_ns() - sent_ns)
    socket.close()
    context.term()
    return latencies, messages - len(latencies)


def measure(kind: str, handle: Callable[[Path, int], tuple[list[int], int]], messages: int) -> dict[str, Any]:
    """Starts the publisher in a process of its own and subscribes in this one."""
    with tempfile.TemporaryDirectory(prefix="bus-") as folder:
        command = [sys.executable, __file__, "--publish", kind, "--folder", folder, "--messages", str(messages)]
        with subprocess.Popen(command):
            latencies, lost = handle(Path(folder), messages)
    return summary(kind, latencies, lost)


def measure_peer(kind: str, messages: int) -> dict[str, Any]:
    """The same for another bus; its error instead of numbers if it does not work here."""
    if not installed(kind):
        return {"kind": kind, "note": "not installed"}
    command = [sys.executable, __file__, "--publish", kind, "--folder", ".", "--messages", str(messages)]
    with subprocess.Popen(command, stdin=subprocess.PIPE) as publisher:
        assert publisher.stdin is not None

        def go() -> None:
            assert publisher.stdin is not None
            publisher.stdin.write(b"\n")
            publisher.stdin.flush()

        try:
            latencies = PEERS[kind][1](messages, go)
        except Exception as error:
            return {"kind": kind, "note": describe(error)}
        finally:
            publisher.stdin.close()
            publisher.terminate()
    if not latencies:
        return {"kind": kind, "note": "installed, but no message arrived"}
    return summary(kind, latencies, messages - len(latencies))


def summary(kind: str, latencies: list[int], lost: int) -> dict[str, Any]:
    """The numbers of one measurement; latencies in ns."""
    latencies.sort()
    return {
        "kind": kind,
        "messages": len(latencies) + lost,
        "payload_bytes": PAYLOAD_BYTES,
        "lost": lost,
        "p50_us": round(statistics.median(latencies) * 1e-3, 1),
        "p99_us": round(latencies[int(0.99 * len(latencies))] * 1e-3, 1),
        "max_us": round(latencies[-1] * 1e-3, 1),
    }


def latency(seconds: float) -> list[dict[str, Any]]:
    """Measures everything once and prints it."""
    messages = int(1000 * seconds)
    results = []
    for kind in ("raw", "bus", *PEERS):
        if kind in PEERS:
            result = measure_peer(kind, messages)
        else:
            result = measure(kind, {"raw": subscribe_raw, "bus": subscribe_bus}[kind], messages)
        results.append(result)
        if "note" in result:
            sys.stdout.write(f"{kind:6} {result['note']}\n")
        else:
            ratio = result["p50_us"] / results[0]["p50_us"]
            sys.stdout.write(
                "{kind:6} p50 {p50_us} us, p99 {p99_us} us, max {max_us} us, {lost} of {messages} lost".format(**result)
                + f", p50 {ratio:.2f} times raw\n"
            )
    return results


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seconds", type=float, default=5.0, help="of each measurement of latency")
    parser.add_argument("--soak", type=float, metavar="SECONDS", help="measure losses instead, for so long")
    parser.add_argument("--variant", choices=[*VARIANTS, "all"], default="healthy", help="of the soak")
    parser.add_argument("--json", type=Path, help="also write the results here")
    parser.add_argument("--publish", choices=["bus", "raw", *PEERS], help=argparse.SUPPRESS)
    parser.add_argument("--folder", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--messages", type=int, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.publish in PEERS:
        PEERS[arguments.publish][0](arguments.messages)
        return
    if arguments.publish:
        {"bus": publish_bus, "raw": publish_raw}[arguments.publish](arguments.folder, arguments.messages)
        return
    if arguments.soak:
        results = []
        for variant in VARIANTS if arguments.variant == "all" else [arguments.variant]:
            results.append(soak(arguments.soak, variant))
            sys.stdout.write(summary_text(results[-1]))
            sys.stdout.flush()
    else:
        results = latency(arguments.seconds)
    if arguments.json:
        content = {"cpus": os.cpu_count(), "libzmq": zmq.zmq_version(), "results": results}
        arguments.json.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
