"""Overhead of a lockstep tick: how long trivial nodes take to be done with one.

    python benchmarks/lockstep.py [--members 9] [--ticks 300] [--json FILE]

Starts as many processes. Each subscribes to a topic of the simulator and one of its neighbour, and publishes once a
tick.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from paramove.bus import TICK_PERIOD_NS, Bus, BusSettings, LockstepBarrier, Tick, topics

CHAIN = (
    topics.OBJECTS_TRACKED,
    topics.GESTURES,
    topics.RULES,
    topics.SPEECH,
    topics.RELOCATION_GOAL,
    topics.RELOCATION_STATUS,
    topics.ARM_TRAJECTORY,
    topics.ARM_TRAJECTORY_STATUS,
    topics.ARM_JOINT_STATES,
)


def member(number: int, members: int, folder: str) -> None:
    """One trivial node."""
    own, neighbour = CHAIN[number], CHAIN[(number - 1) % members]
    settings = BusSettings(folder=Path(folder), clock="simulated", lockstep=True)
    with Bus(f"member_{number}", settings, (topics.WIRE_HOAP3_STATE, neighbour), (own,)) as bus:
        signal.signal(signal.SIGTERM, lambda *_: bus.stop())
        bus.ready("trivial")
        for event in bus.events(tick=True):
            if isinstance(event, Tick):
                bus.publish(own, own.type())


def measure(members: int, ticks: int) -> dict[str, float]:
    """Milliseconds a tick takes, and CPU milliseconds of the simulator's side."""
    with tempfile.TemporaryDirectory(prefix="bus-") as folder:
        names = tuple(f"member_{number}" for number in range(members))
        settings = BusSettings(folder=Path(folder), clock="simulated", lockstep=True, members=names)
        neighbour = CHAIN[:members]
        with Bus("simulator", settings, neighbour, (topics.CLOCK, topics.WIRE_HOAP3_STATE)) as bus:
            barrier = LockstepBarrier(bus)
            command = [sys.executable, __file__, "--folder", folder, "--members", str(members), "--member"]
            processes = [subprocess.Popen([*command, str(number)]) for number in range(members)]
            barrier.wait_for_members()
            durations_ms = []
            for tick in range(1, ticks + 1):
                started = time.perf_counter()
                bus.publish(topics.WIRE_HOAP3_STATE, topics.WIRE_HOAP3_STATE.type())
                if len(barrier.advance(tick * TICK_PERIOD_NS)) != members:
                    raise RuntimeError(f"tick {tick}: not every member was neighbour")
                durations_ms.append(1e3 * (time.perf_counter() - started))
            for process in processes:
                process.terminate()
        for process in processes:
            process.wait()
    durations_ms.sort()
    return {
        "members": members,
        "ticks": ticks,
        "p50_ms": round(statistics.median(durations_ms), 3),
        "p99_ms": round(durations_ms[int(0.99 * ticks)], 3),
        "max_ms": round(durations_ms[-1], 3),
        "cpus": os.cpu_count() or 0,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--members", type=int, default=9, help=f"at most {len(CHAIN)}")
    parser.add_argument("--ticks", type=int, default=300)
    parser.add_argument("--json", type=Path, help="also write the result here")
    parser.add_argument("--member", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--folder", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.member is not None:
        member(arguments.member, arguments.members, arguments.folder)
        return
    result = measure(arguments.members, arguments.ticks)
    sys.stdout.write(
        f"lockstep, {result['members']} members: tick p50 {result['p50_ms']} ms, p99 {result['p99_ms']} ms, "
        f"max {result['max_ms']} ms on {result['cpus']} CPUs\n"
    )
    if arguments.json:
        arguments.json.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
