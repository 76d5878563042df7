"""One host that gives its topics to many: what arrives how late, and what its relay costs.

    python benchmarks/hosts.py [--hosts 1,2,5,10] [--seconds 10] [--json FILE]

One process publishes 100 messages of 216 bytes and 15 images of 60 kB a second. A relay forwards them to as many relays
as there are hosts, over the loopback with ZeroMQ's CURVE, each with a subscriber. All share this machine's processors,
so with many hosts the latencies are above those of machines of their own; the processor time of the giving relay is
not. `direct` is the same without relays: subscribers beside the publisher.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import multiprocessing
import socket
import sys
import tempfile
import time
from collections.abc import Iterator
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import zmq
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # run as a program, only this folder is known

from benchmarks.bus_soak import batch
from paramove.bus import Bus, BusSettings, BusVisitor, topics
from paramove.hosts import HostKeys, Peer, Relay, RelaySettings

COMMANDS = topics.WIRE_HOAP3_STREAM  # does not cross in a run; here it is a message of the usual size
IMAGES = topics.CAMERA_IMAGE
SETTLE_S = 2.0
IMAGE_BYTES = 60_000


def relay(folder: str, name: str, settings: dict[str, Any], results: Connection) -> None:
    """A host's relay in a process of its own, until the parent sends a word."""
    with Bus(f"relay_{name}", BusSettings(folder=Path(folder))) as bus, Relay(bus, RelaySettings(**settings)) as its:
        results.send("ready")
        while not results.poll():
            its.step()
            bus.idle(0.0)
    results.send(sum(psutil.Process().cpu_times()[:2]))


def subscriber(folder: str, results: Connection) -> None:
    """A subscriber in a process of its own."""
    latencies_ms: dict[str, list[float]] = {COMMANDS.name: [], IMAGES.name: []}
    with BusVisitor(Path(folder), "benchmark") as visitor:
        subscribers = [visitor.subscriber(topic) for topic in (COMMANDS, IMAGES)]
        poller = zmq.Poller()
        for one in subscribers:
            poller.register(one.socket, zmq.POLLIN)
        results.send("ready")
        while not results.poll():
            poller.poll(50)
            collect(subscribers, latencies_ms)
        results.send((latencies_ms, sum(one.counter.lost for one in subscribers)))


def collect(subscribers: list[Any], latencies_ms: dict[str, list[float]]) -> None:
    """What has come in, with its age: the captured time crosses unchanged on one machine but for the clock's bound."""
    for one in subscribers:
        while (received := one.receive()) is not None:
            latencies_ms[received.topic.name].append(1e-6 * (time.monotonic_ns() - received.captured_ns))


def free_ports() -> int:
    """A port that is free with the next one."""
    while True:
        with socket.socket() as one, socket.socket() as next_one:
            one.bind(("127.0.0.1", 0))
            port = int(one.getsockname()[1])
            with contextlib.suppress(OSError, OverflowError):
                next_one.bind(("127.0.0.1", port + 1))
                return port


@contextlib.contextmanager
def hosts(root: Path, count: int) -> Iterator[tuple[Path, list[tuple[str, Path, dict[str, Any]]]]]:
    """Folder of the giving host, and name, folder and settings of each relay, the giving one first."""
    names = ["giver", *(f"host_{number}" for number in range(count))]
    keys = {name: HostKeys(root / name / "keys") for name in names}
    ports = {name: free_ports() for name in names}
    rows = {topic.name: topic.name for topic in (COMMANDS, IMAGES)}
    relays = []
    for name in names:
        (root / name / "bus").mkdir(parents=True, mode=0o700)
        others = names[1:] if name == "giver" else ["giver"]
        peers = {}
        for other in others:
            keys[name].trust(other, keys[other].own().public)
            wants, gives = (rows, {}) if name == "giver" else ({}, rows)
            public = keys[other].own().public
            peers[other] = Peer(address="127.0.0.1", port=ports[other], key=public, wants=wants, gives=gives)
        settings = RelaySettings(address="127.0.0.1", port=ports[name], peers=peers, keys=keys[name].folder)
        relays.append((name, root / name / "bus", settings.model_dump(mode="json")))
    yield root / "giver" / "bus", relays


def measure(count: int, seconds: float, with_relays: bool) -> dict[str, Any]:
    """Latencies over all hosts, and the giving relay's processor time per second."""
    make = multiprocessing.get_context("spawn")
    with tempfile.TemporaryDirectory(prefix="pm-") as root, hosts(Path(root), count) as (folder, relays):
        started: list[tuple[Any, tuple[Any, ...]]] = [
            (relay, (str(its), name, settings)) for name, its, settings in relays if with_relays
        ]
        started += [(subscriber, (str(its if with_relays else folder),)) for _, its, _ in relays[1:]]
        children, pipes = [], []
        for target, arguments in started:
            here, there = make.Pipe()
            children.append(make.Process(target=target, args=(*arguments, there)))
            children[-1].start()
            pipes.append(here)
        with BusVisitor(folder, "benchmark") as visitor:
            publishers = [visitor.publisher(COMMANDS), visitor.publisher(IMAGES)]
            image = CompressedImage(data=b"\1" * IMAGE_BYTES)
            for pipe in pipes:
                pipe.recv()
            begun_s = time.monotonic()
            for number in range(round(100 * (SETTLE_S + seconds))):
                due_s = begun_s + 0.01 * number
                time.sleep(max(0.0, due_s - time.monotonic()))
                now_ns = time.monotonic_ns()
                publishers[0].publish(batch(), now_ns, now_ns)
                if number % 7 == 0:
                    publishers[1].publish(image, now_ns, now_ns)
            ended_s = time.monotonic()
        for pipe in pipes:
            pipe.send("end")
        results = [pipe.recv() for pipe in pipes]
        for child in children:
            child.join()
    last, received = round(100 * seconds), results[-count:]
    samples = {
        name: np.concatenate([latencies[name][-some:] for latencies, _ in received])
        for name, some in ((COMMANDS.name, last), (IMAGES.name, last // 7))
    }
    return {
        "hosts": count,
        "kind": "relays" if with_relays else "direct",
        "commands_ms": np.percentile(samples[COMMANDS.name], [50, 99]).round(2).tolist(),
        "images_ms": np.percentile(samples[IMAGES.name], [50, 99]).round(2).tolist(),
        "lost": sum(lost for _, lost in received),
        "giver_cpu": round(results[0] / (ended_s - begun_s), 3) if with_relays else None,
    }


def main() -> None:
    """The table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hosts", default="1,2,5,10", help="numbers of receiving hosts")
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    rows = [
        measure(int(count), options.seconds, with_relays)
        for count in options.hosts.split(",")
        for with_relays in (False, True)
    ]
    table = Table("hosts", "", "216 B, p50 / p99, ms", "60 kB, p50 / p99, ms", "lost", "relay's processor time, s/s")
    for row in rows:
        times = [" / ".join(f"{value:.1f}" for value in row[key]) for key in ("commands_ms", "images_ms")]
        cpu = "–" if row["giver_cpu"] is None else f"{row['giver_cpu']:.2f}"
        table.add_row(str(row["hosts"]), row["kind"], *times, str(row["lost"]), cpu)
    Console().print(table)
    if options.json:
        options.json.write_text(json.dumps(rows, indent=2) + "\n")


if __name__ == "__main__":
    main()
