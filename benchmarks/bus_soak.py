"""The loss soak of `benchmarks/bus.py --soak`: a publisher and its subscribers, each a process with its own bus."""

from __future__ import annotations

import argparse
import gc
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from array import array
from dataclasses import replace
from pathlib import Path
from typing import Any

import psutil
import zmq

from benchmarks import bus_peers
from benchmarks.bus_peers import PAYLOAD_BYTES, paced
from paramove.bus import Bus, BusSettings, Received, Subscriber, topics
from paramove.msgs.hoap3_wire_pb2 import StreamBatch

SMALL = topics.WIRE_HOAP3_STREAM
IMAGES = replace(topics.CAMERA_IMAGE_RAW, rate_hz=30)
IMAGE_BYTES = bus_peers.IMAGES.size
IMAGE_EVERY = 33
"""Messages at 1 kHz per image: 30 images a second."""
ROOT = Path(__file__).resolve().parent.parent
VARIANTS = ("healthy", "sleeping", "stopped")


def batch() -> StreamBatch:
    """A message of 216 bytes."""
    message = StreamBatch(epoch=1, first_index=1)
    while message.ByteSize() < PAYLOAD_BYTES:
        message.frames += b"\0"
    return message


def report(what: Any) -> None:
    sys.stdout.write(json.dumps(what) + "\n")
    sys.stdout.flush()


def publish(folder: Path, seconds: float, subscribers: int) -> None:
    """Publishes both topics once all subscribers are there; stays until a line on standard input."""
    with Bus("speaker", BusSettings(folder=folder), (), (SMALL, IMAGES)) as bus:
        publishers = [bus.exchange.publishers[topic.name] for topic in (SMALL, IMAGES)]
        while min(publisher.subscriptions for publisher in publishers) < subscribers:
            bus.exchange.wait(0.1)
        small, image = batch(), IMAGES.type(data=b"\1" * IMAGE_BYTES)
        gc.collect()
        gc.freeze()
        process, memory, longest_ns = psutil.Process(), 0, 0
        for number in paced(int(1000 * seconds)):
            before_ns = time.perf_counter_ns()
            bus.publish(SMALL, small)
            if number % IMAGE_EVERY == 0:
                bus.publish(IMAGES, image)
            longest_ns = max(longest_ns, time.perf_counter_ns() - before_ns)
            if number == 1000:  # after the first images, whose memory stays
                memory = process.memory_info().rss
        grown = process.memory_info().rss - memory
        report(
            {"said": [item.sequence for item in publishers], "grown_mb": grown / 1e6, "longest_ms": longest_ns * 1e-6}
        )
        while not zmq.select([sys.stdin], [], [], 0.01)[0]:
            bus.exchange.wait(0.01)


def handle(folder: Path, sleeping: bool) -> None:
    """Receives both topics until it knows of as many messages as standard input states; reports its counts."""
    latencies = {SMALL.name: array("q"), IMAGES.name: array("q")}
    with Bus("sleeper" if sleeping else f"listener_{os.getpid()}", BusSettings(folder=folder), (SMALL, IMAGES)) as bus:
        published: list[int] | None = None
        for event in bus.events(tick=True):
            if isinstance(event, Received):
                if not any(latencies.values()):
                    report("hearing")
                latencies[event.topic.name].append(time.monotonic_ns() - event.published_ns)
                if sleeping and published is None and len(latencies[SMALL.name]) % 5000 == 1:
                    time.sleep(5)
            elif published is None and zmq.select([sys.stdin], [], [], 0)[0]:
                published = json.loads(sys.stdin.readline())
            known = [bus.exchange.subscribers[topic.name].counter.sequence for topic in (SMALL, IMAGES)]
            if known == published and not isinstance(event, Received):
                bus.stop()
        result = {}
        for topic in (SMALL, IMAGES):
            counter = bus.exchange.subscribers[topic.name].counter
            sorted_ns = sorted(latencies[topic.name]) or [0]
            result[topic.name] = {
                "received": counter.messages,
                "lost": counter.lost,
                "duplicated": counter.repeated,
                "refused": counter.rejected.total(),
                "p50_us": sorted_ns[len(sorted_ns) // 2] * 1e-3,
                "p99_us": sorted_ns[int(0.99 * len(sorted_ns))] * 1e-3,
                "max_ms": sorted_ns[-1] * 1e-6,
            }
        report(result)


def _start(*arguments: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "benchmarks.bus_soak", *arguments]
    return subprocess.Popen(command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def _show_the_end(folder: Path, published: list[int]) -> None:
    """A further subscription sends a welcome to all subscribers, which shows what was lost last."""
    with zmq.Context() as context:
        others = [Subscriber(context, folder, topic) for topic in (SMALL, IMAGES)]
        while [other.counter.sequence for other in others] != published:
            for other in others:
                other.receive_raw()
            time.sleep(0.01)
        time.sleep(0.5)
        for other in others:
            other.close()


def soak(seconds: float, variant: str) -> dict[str, Any]:
    """Runs one soak.

    Args:
        seconds: How long the publisher runs.
        variant: `healthy`, or one more subscriber that is `sleeping` five seconds at a time, or `stopped` (SIGSTOP).
    """
    begun = os.getloadavg()[0]
    further: list[str] = {"healthy": [], "sleeping": ["sleeping"], "stopped": ["stopped"]}[variant]
    with tempfile.TemporaryDirectory(prefix="bus-") as name:
        folder = Path(name)
        publisher = _start("publish", name, "--seconds", str(seconds), "--subscribers", str(2 + len(further)))
        subscribers = {
            condition: _start("subscribe", name, *(["--sleeping"] if condition == "sleeping" else []))
            for condition in ("healthy", "healthy too", *further)
        }
        for condition, process in subscribers.items():
            assert process.stdout is not None
            process.stdout.readline()  # it has subscribed
            if condition == "stopped":
                process.send_signal(signal.SIGSTOP)
        assert publisher.stdout is not None
        reported = json.loads(publisher.stdout.readline())
        if variant == "stopped":
            subscribers["stopped"].send_signal(signal.SIGCONT)
        for process in subscribers.values():
            assert process.stdin is not None
            process.stdin.write(json.dumps(reported["said"]) + "\n")
            process.stdin.flush()
        while any(process.poll() is None for process in subscribers.values()):
            _show_the_end(folder, reported["said"])
        counts = {condition: json.loads(process.communicate()[0]) for condition, process in subscribers.items()}
        publisher.communicate("\n")
    load = f"{begun:.1f} to {os.getloadavg()[0]:.1f}"
    return {"variant": variant, "seconds": seconds, "load": load, "cpus": os.cpu_count(), **reported, "heard": counts}


def summary_text(result: dict[str, Any]) -> str:
    """The result for people."""
    lines = [
        f"soak {result['variant']}, {result['seconds']:g} s, load {result['load']} on {result['cpus']} cpus: "
        f"publisher grew by {result['grown_mb']:.1f} MB, longest publish {result['longest_ms']:.1f} ms"
    ]
    for condition, topics_heard in result["heard"].items():
        for (topic, counts), published in zip(topics_heard.items(), result["said"], strict=True):
            exact = "exact" if counts["received"] + counts["lost"] + counts["refused"] == published else "NOT EXACT"
            lines.append(
                f"  {condition:12} {topic:18} published {published}, received {counts['received']}, "
                f"lost {counts['lost']}, duplicated {counts['duplicated']}, rejected {counts['refused']} ({exact}); "
                f"p50 {counts['p50_us']:.0f} us, p99 {counts['p99_us']:.0f} us, max {counts['max_ms']:.1f} ms"
            )
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("role", choices=["publish", "subscribe"])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seconds", type=float)
    parser.add_argument("--subscribers", type=int)
    parser.add_argument("--sleeping", action="store_true")
    arguments = parser.parse_args()
    if arguments.role == "publish":
        publish(arguments.folder, arguments.seconds, arguments.subscribers)
    else:
        handle(arguments.folder, arguments.sleeping)


if __name__ == "__main__":
    main()
