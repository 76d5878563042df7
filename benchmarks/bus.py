"""Latency and losses of the bus.

    python benchmarks/bus.py [--seconds 5] [--images] [--json FILE]
    python benchmarks/bus.py --soak 600 [--variant healthy|sleeping|stopped|all] [--json FILE]

The first measures the latency at 1 kHz with messages of 216 bytes, or with images of 1 MB, 30 a second. One process
publishes, another subscribes; both read the same monotonic clock. `raw` sends the same bytes with libzmq PUB and SUB
and nothing else, so the difference is what the envelope, its checks and the protobuf decoding cost, and of images what
shared memory saves. rospy (with a roscore running), zenoh, LCM and iceoryx2 follow where they are installed, each as it
comes.

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

from benchmarks import bus_soak
from benchmarks.bus_peers import IMAGES, PEERS, SMALL, Load, describe, installed, paced, stamped
from benchmarks.bus_soak import VARIANTS, batch, soak, summary_text
from paramove.bus import Publisher, Subscriber

TOPICS = {SMALL: bus_soak.SMALL, IMAGES: bus_soak.IMAGES}


def publish_bus(folder: Path, messages: int, load: Load) -> None:
    """The publisher of the bus: waits for its subscriber, then publishes."""
    context: zmq.Context[Any] = zmq.Context()
    publisher = Publisher(context, folder, TOPICS[load], "publisher")
    while publisher.subscriptions == 0:
        publisher.socket.poll()
        publisher.serve()
    message = batch() if load is SMALL else TOPICS[load].type(data=b"\1" * load.size)
    for _ in paced(messages, load.period_ns):
        now_ns = time.monotonic_ns()
        publisher.publish(message, now_ns, now_ns)
    publisher.close()
    context.term()


def publish_raw(folder: Path, messages: int, load: Load) -> None:
    """The publisher of ZeroMQ alone."""
    context: zmq.Context[Any] = zmq.Context()
    socket = context.socket(zmq.XPUB)
    socket.bind(f"ipc://{folder / 'raw'}")
    socket.recv()
    for _ in paced(messages, load.period_ns):
        socket.send(stamped(load.size))
    socket.close(linger=1000)
    context.term()


def subscribe_bus(folder: Path, messages: int, load: Load) -> tuple[list[int], int]:
    """Latencies in ns, and how many messages were lost."""
    context: zmq.Context[Any] = zmq.Context()
    subscriber = Subscriber(context, folder, TOPICS[load])
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


def subscribe_raw(folder: Path, messages: int, load: Load) -> tuple[list[int], int]:
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


def measure(
    kind: str, handle: Callable[[Path, int, Load], tuple[list[int], int]], messages: int, load: Load
) -> dict[str, Any]:
    """Starts the publisher in a process of its own and subscribes in this one."""
    with (
        tempfile.TemporaryDirectory(prefix="bus-") as folder,
        subprocess.Popen(_publishing(kind, folder, messages, load)),
    ):
        latencies, lost = handle(Path(folder), messages, load)
    return summary(kind, latencies, lost, load)


def _publishing(kind: str, folder: str, messages: int, load: Load) -> list[str]:
    command = [sys.executable, __file__, "--publish", kind, "--folder", folder, "--messages", str(messages)]
    return [*command, "--images"] if load is IMAGES else command


def measure_peer(kind: str, messages: int, load: Load) -> dict[str, Any]:
    """The same for another bus; its error instead of numbers if it does not work here."""
    if not installed(kind):
        return {"kind": kind, "note": "not installed"}
    with subprocess.Popen(_publishing(kind, ".", messages, load), stdin=subprocess.PIPE) as publisher:
        assert publisher.stdin is not None

        def go() -> None:
            assert publisher.stdin is not None
            publisher.stdin.write(b"\n")
            publisher.stdin.flush()

        try:
            latencies = PEERS[kind][1](messages, load, go)
        except Exception as error:
            return {"kind": kind, "note": describe(error)}
        finally:
            publisher.stdin.close()
            publisher.terminate()
    if not latencies:
        return {"kind": kind, "note": "installed, but no message arrived"}
    return summary(kind, latencies, messages - len(latencies), load)


def summary(kind: str, latencies: list[int], lost: int, load: Load) -> dict[str, Any]:
    """The numbers of one measurement; latencies in ns."""
    latencies.sort()
    return {
        "kind": kind,
        "messages": len(latencies) + lost,
        "payload_bytes": load.size,
        "lost": lost,
        "p50_us": round(statistics.median(latencies) * 1e-3, 1),
        "p99_us": round(latencies[int(0.99 * len(latencies))] * 1e-3, 1),
        "max_us": round(latencies[-1] * 1e-3, 1),
    }


def latency(seconds: float, load: Load) -> list[dict[str, Any]]:
    """Measures everything once and prints it."""
    messages = int(seconds * 1e9 / load.period_ns)
    results = []
    for kind in ("raw", "bus", *PEERS):
        if kind in PEERS:
            result = measure_peer(kind, messages, load)
        else:
            result = measure(kind, {"raw": subscribe_raw, "bus": subscribe_bus}[kind], messages, load)
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
    parser.add_argument("--images", action="store_true", help="measure the latency of images")
    parser.add_argument("--soak", type=float, metavar="SECONDS", help="measure losses instead, for so long")
    parser.add_argument("--variant", choices=[*VARIANTS, "all"], default="healthy", help="of the soak")
    parser.add_argument("--json", type=Path, help="also write the results here")
    parser.add_argument("--publish", choices=["bus", "raw", *PEERS], help=argparse.SUPPRESS)
    parser.add_argument("--folder", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--messages", type=int, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    load = IMAGES if arguments.images else SMALL
    if arguments.publish in PEERS:
        PEERS[arguments.publish][0](arguments.messages, load)
        return
    if arguments.publish:
        {"bus": publish_bus, "raw": publish_raw}[arguments.publish](arguments.folder, arguments.messages, load)
        return
    if arguments.soak:
        results = []
        for variant in VARIANTS if arguments.variant == "all" else [arguments.variant]:
            results.append(soak(arguments.soak, variant))
            sys.stdout.write(summary_text(results[-1]))
            sys.stdout.flush()
    else:
        results = latency(arguments.seconds, load)
    if arguments.json:
        content = {"cpus": os.cpu_count(), "libzmq": zmq.zmq_version(), "results": results}
        arguments.json.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
