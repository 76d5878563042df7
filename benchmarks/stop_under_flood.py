"""How long a person's stop takes while trajectories flood the driver of an arm that moves.

    python benchmarks/stop_under_flood.py [--stops 100] [--robots hoap3,open_manipulator_x] [--kinds valid,large]
                                          [--hosts 1,2] [--busy 2] [--json FILE]

Each stop is with new processes: the real driver node, emulated servos or a robot that only plays its stream, and a
program that commands a movement and then publishes trajectories as fast as it can. At some time of the movement a stop
is published once. Measured by the wall clock until the gate's answer arrives, which the driver publishes after the
first rows of the stop; a servo arm plays the first of them within one more period, which is added. With two hosts
program and person are on another bus, and two relays over the loopback are between them and the driver.

    valid     short movements       invalid   1 MB each, 47 000 points, the last one NaN
    large     1 MB each, valid      many      two points each
    checked   the arm is at rest, and each movement of 120 s breaks a limit in its last part only

Beside it, a timer of 10 ms shows how late this machine is by itself. A stop during which that timer stalled for more
than 20 ms is listed and left out. Ctrl-C prints what there is.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import multiprocessing
import select
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # run as a program, only this folder is known

from benchmarks.arm import Emulation
from benchmarks.hosts import relay
from paramove.bus import BusVisitor, Publisher, publish_now, topics
from paramove.hosts import HostKeys, Peer, RelaySettings
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory
from paramove.msgs.safety_state_pb2 import ArmRequest, SafetyState, StopRequest
from paramove.robots import RobotDescription
from paramove.robots.hoap3 import receive, state_message
from paramove.robots.streaming import StreamReader
from paramove.safety import PERSON_STOP, minimum_jerk

ROOT = Path(__file__).resolve().parent.parent
KINDS = ("valid", "invalid", "large", "many", "checked")
SWING = {"hoap3": {"right_shoulder_pitch": -50.0, "right_elbow": -40.0}}
OTHER_SWING = {0: 40.0}
"""Of a servo arm: degrees by joint."""
SWING_S = 4.0
LEAD_S = 0.4
"""From the begin of the movement to that of the flood."""
TIMER_S, STALL_S = 0.010, 0.020
TIMEOUT_S = 60.0
START_TIMEOUT_S = 60.0
STATE_S = 1 / 15
FIRST_PORT = 47_300
TIMEOUTS = {"silent_s": 0.5, "watchdog_s": 2.54, "read_s": 0.2}
"""Of servos that share the processors with everything else."""


def movement(
    robot: RobotDescription, name: str, n_points: int, duration_s: float, part: float = 1.0
) -> JointTrajectory:
    """From the base pose along a minimum-jerk path by that part of the swing."""
    goals_deg = SWING.get(robot.name, {robot.joint_names[joint]: value for joint, value in OTHER_SWING.items()})
    message = JointTrajectory(id=name, joints=list(goals_deg))
    start = robot.base_pose[robot.indices(message.joints)]
    goal = np.deg2rad(list(goals_deg.values()))
    for u in np.linspace(0.0, 1.0, n_points):
        message.points.add(time_s=duration_s * u, position_rad=start + part * minimum_jerk(u) * goal)
    return message


def flooding(robot: RobotDescription, kind: str) -> JointTrajectory:
    """What the program publishes again and again."""
    if kind == "many":
        return movement(robot, kind, 2, SWING_S)
    if kind == "valid":
        return movement(robot, kind, 301, SWING_S)
    if kind == "large":
        return movement(robot, kind, 20_001, 100.0)
    if kind == "invalid":
        message = movement(robot, kind, 2, 1.0)
        message.points.extend([message.points[0]] * ((2**20 - 100) // (message.points[0].ByteSize() + 2) - 2))
        message.points[-1].position_rad[0] = math.nan
        return message
    message = movement(robot, kind, 12_001, 120.0)
    message.points[-20].position_rad[0] += 0.01
    return message


def flood(folder: str, name: str, kind: str) -> None:
    """A program of its own: waits for a line, commands a movement, and floods until it is killed."""
    robot = RobotDescription.load(ROOT / "robot_description" / name)
    message = flooding(robot, kind)
    with BusVisitor(Path(folder), "flooder") as visitor:
        publisher = visitor.publisher(topics.ARM_TRAJECTORY)
        while not publisher.subscriptions:
            publisher.serve()
            time.sleep(0.01)
        print_line("ready")
        sys.stdin.readline()
        number, begun_s = 0, time.monotonic()
        if kind != "checked":
            publish(publisher, movement(robot, "swing", 401, SWING_S))
            while time.monotonic() - begun_s < LEAD_S:
                publisher.serve()
                time.sleep(0.01)
        while True:
            number += 1
            message.id = f"{kind} {number}"
            publish(publisher, message)


def publish(publisher: Publisher, message: Any) -> None:
    """With the present time."""
    now_ns = time.monotonic_ns()
    publisher.publish(message, now_ns, now_ns)


class Timer:
    """How late a timer of 10 ms is, in a process of its own, while this is a context."""

    def __enter__(self) -> Timer:
        make = multiprocessing.get_context("spawn")
        self._here, there = make.Pipe()
        self._process = make.Process(target=timer, args=(there,), daemon=True)
        self._process.start()
        self._here.recv()
        return self

    def __exit__(self, *_: object) -> None:
        self._process.terminate()
        self._process.join()

    def taken(self) -> list[tuple[float, float]]:
        """Since the last call: when the timer was due, s, and how late it came, s."""
        self._here.send("")
        return list(self._here.recv())


def timer(pipe: Any) -> None:
    """What that process does."""
    pipe.send("ready")
    found: list[tuple[float, float]] = []
    while True:
        due_s = time.monotonic() + TIMER_S
        time.sleep(TIMER_S)
        found.append((due_s, time.monotonic() - due_s))
        if pipe.poll():
            pipe.recv()
            pipe.send(found)
            found = []


class World:
    """The robot and the person, on the buses of the person's host and of the driver's, which may be the same."""

    def __init__(self, robot: RobotDescription, person: BusVisitor, driver: BusVisitor) -> None:
        self.safety = SafetyState()
        self._gate = driver.subscriber(topics.ARM_SAFETY)
        self._arming, self._stop = driver.publisher(topics.OPERATOR_ARM), person.publisher(topics.OPERATOR_STOP)
        self._reader: StreamReader | None = None
        if robot.bus is None:  # HOAP-3: this plays its stream
            self._reader = StreamReader(robot, robot.units.to_counts(robot.base_pose))
            self._state = driver.publisher(topics.WIRE_HOAP3_STATE)
            self._stream = driver.subscriber(topics.WIRE_HOAP3_STREAM)
            self._played_s = self._due_s = time.monotonic()

    def until(self, is_it: Any, timeout_s: float) -> bool:
        """Goes on until the gate's state is as it should be; whether it became so."""
        end_s = time.monotonic() + timeout_s
        while not is_it(self.safety):
            if time.monotonic() > end_s:
                return False
            self.step()
        return True

    def goes_on(self, seconds: float) -> None:
        """For so long."""
        end_s = time.monotonic() + seconds
        while time.monotonic() < end_s:
            self.step()

    def step(self) -> None:
        """Waits for the gate for 2 ms at most."""
        for publisher in (self._arming, self._stop):
            publisher.serve()
        if self._gate.socket.poll(2):
            while (received := self._gate.receive()) is not None:
                self.safety = received.message
        self._gate.revive()
        if self._reader is not None:
            self._play(self._reader)

    def _play(self, reader: StreamReader) -> None:
        while (received := self._stream.receive()) is not None:
            receive(received.message, reader)
        self._stream.revive()
        while self._played_s < time.monotonic():
            self._played_s += 0.001
            reader.play()
        self._state.serve()
        if time.monotonic() > self._due_s:
            self._due_s += STATE_S
            publish(self._state, state_message(reader.state(reader.target, time.monotonic_ns())))

    def arms(self) -> None:
        """As a person does; again if the machine was too busy."""
        assert self.until(lambda gate: gate.state == SafetyState.STATE_DISARMED, START_TIMEOUT_S), "no driver"
        for _ in range(10):
            publish_now(self._arming, ArmRequest(source="benchmark", armed=True, by_person=True))
            if self.until(lambda gate: gate.state == SafetyState.STATE_ARMED, 5.0):
                return
        raise SystemExit(f"the arm cannot be armed: {self.safety}")

    def stop_s(self) -> tuple[float, float]:
        """When the stop was published, s, and until the gate's answer, s; infinite without one."""
        assert self.until(lambda gate: self._stop.subscriptions > 0, START_TIMEOUT_S), "nobody subscribes to stops"
        begun_s = time.monotonic()
        publish_now(self._stop, StopRequest(source="benchmark"))
        answered = self.until(lambda gate: any(fault.code == PERSON_STOP for fault in gate.faults), TIMEOUT_S)
        return begun_s, time.monotonic() - begun_s if answered else math.inf


@contextlib.contextmanager
def joined(root: Path, hosts: int) -> Iterator[tuple[Path, Path]]:
    """Bus folders of the person and of the driver: one, or two that are joined by relays."""
    folders = [root / name for name in ("desk", "robot")][2 - hosts :]
    for folder in folders:
        folder.mkdir(mode=0o700)
    if hosts == 1:
        yield folders[0], folders[0]
        return
    keys = {folder: HostKeys(root / f"keys_{folder.name}") for folder in folders}
    rows = {topic.name: topic.name for topic in (topics.ARM_TRAJECTORY, topics.OPERATOR_STOP)}
    make = multiprocessing.get_context("spawn")
    started, pipes = [], []  # a relay ends with its pipe
    for index, (folder, other) in enumerate((folders, folders[::-1])):
        public = keys[other].own().public
        keys[folder].trust(other.name, public)
        wants, gives = ({}, rows) if folder.name == "robot" else (rows, {})
        peer = Peer(address="127.0.0.1", port=FIRST_PORT + 10 * (1 - index), key=public, wants=wants, gives=gives)
        port = FIRST_PORT + 10 * index
        settings = RelaySettings(address="127.0.0.1", port=port, peers={other.name: peer}, keys=keys[folder].folder)
        here, there = make.Pipe()
        pipes.append(here)
        arguments = (str(folder), folder.name, settings.model_dump(mode="json"), there)
        started.append(make.Process(target=relay, args=arguments, daemon=True))
        started[-1].start()
        assert here.recv() == "ready"
    try:
        yield folders[0], folders[1]
    finally:
        for process in started:
            process.terminate()
            process.join()


@contextlib.contextmanager
def program(*command: str, cwd: Path = ROOT) -> Iterator[subprocess.Popen[str]]:
    """A process, while this is a context."""
    with subprocess.Popen(
        command, cwd=cwd, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def measure(name: str, kind: str, hosts: int, after_s: float) -> tuple[float, float]:
    """One stop with new processes, so long after the flood has begun: when, s, and how long it took, s."""
    folder = ROOT / "robot_description" / name
    robot = RobotDescription.load(folder)
    with tempfile.TemporaryDirectory(prefix="pm-") as root, contextlib.ExitStack() as opened:
        desk, driver = opened.enter_context(joined(Path(root), hosts))
        parameters: dict[str, Any] = {"robot": str(folder)}
        if robot.bus is not None:
            link = Path(root) / "usb-emulated_0001-if00-port0"
            opened.callback(Emulation(folder, robot.bus.baud_rate, link).end)
            parameters |= {"port": str(link), "timeouts": TIMEOUTS}
        node = "arm_driver" if robot.bus is None else "servo_arm_driver"
        config = Path(root) / "driver.yaml"
        bus = {"folder": str(driver), "clock": "monotonic"}
        config.write_text(json.dumps({"node": "driver", "bus": bus, "parameters": parameters, "run_folder": root}))
        opened.enter_context(program(sys.executable, "-m", f"nodes.{node}", "--config", str(config)))
        flooder = opened.enter_context(program(sys.executable, __file__, "--flood", str(desk), name, kind))
        person, beside = (
            opened.enter_context(BusVisitor(desk, "person")),
            opened.enter_context(BusVisitor(driver, "world")),
        )
        world = World(robot, person, beside)
        assert flooder.stdin is not None
        assert flooder.stdout is not None
        while not select.select([flooder.stdout], [], [], 0.0)[0]:
            world.step()
        assert flooder.stdout.readline() == "ready\n"
        world.arms()
        flooder.stdin.write("go\n")
        flooder.stdin.flush()
        world.goes_on(LEAD_S + after_s)
        begun_s, stop_s = world.stop_s()
        return begun_s, stop_s + (0.0 if robot.bus is None else 1e-6 * robot.stream.period_us)


def rows_of(results: dict[tuple[str, str, int], list[tuple[float, float]]]) -> list[dict[str, Any]]:
    """Of each case, its stops that count, and those that a stall of the machine fell into."""
    rows = []
    for (name, kind, hosts), stops in results.items():
        counted = 1e3 * np.array([stop_s for stop_s, stall_s in stops if stall_s <= STALL_S])
        row: dict[str, Any] = {"robot": name, "kind": kind, "hosts": hosts, "stops": len(counted)}
        row["left_out"] = [
            [round(1e3 * stop_s, 1), round(1e3 * stall, 1)] for stop_s, stall in stops if stall > STALL_S
        ]
        if len(counted):
            quantiles = np.quantile(counted, [0.5, 0.99], method="higher")
            row |= dict(zip(("p50_ms", "p99_ms", "max_ms"), [*quantiles.tolist(), counted.max()], strict=True))
        rows.append(row)
    return rows


def print_line(text: str) -> None:
    """At once."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def print_table(rows: list[dict[str, Any]], late_ms: list[float]) -> None:
    """The table, and the timer beside it."""
    table = Table("robot", "flood", "hosts", "stops", "p50, ms", "p99, ms", "max, ms", "left out: stop / stall, ms")
    for row in rows:
        times = [f"{row[key]:.1f}" if key in row else "–" for key in ("p50_ms", "p99_ms", "max_ms")]
        left_out = ", ".join(f"{stop:.0f} / {stall:.0f}" for stop, stall in row["left_out"]) or "–"
        table.add_row(row["robot"], row["kind"], str(row["hosts"]), str(row["stops"]), *times, left_out)
    Console().print(table)
    late = np.quantile(late_ms, [0.5, 0.99, 1.0]) if late_ms else [math.nan] * 3
    print_line("a timer of 10 ms beside it is late by {:.1f} ms (p50), {:.1f} ms (p99), {:.1f} ms (max)".format(*late))


def main() -> None:
    """Measures all cases in turn."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stops", type=int, default=100, help="of each case")
    parser.add_argument("--robots", default="hoap3,open_manipulator_x")
    parser.add_argument("--kinds", default=",".join(KINDS))
    parser.add_argument("--hosts", default="1,2")
    parser.add_argument("--busy", type=int, default=0, help="programs that never rest")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--flood", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.flood:
        flood(*options.flood)
    cases = [
        (name, kind, int(hosts))
        for hosts in options.hosts.split(",")
        for name in options.robots.split(",")
        for kind in options.kinds.split(",")
    ]
    results: dict[tuple[str, str, int], list[tuple[float, float]]] = {case: [] for case in cases}
    late_ms: list[float] = []
    draw = np.random.default_rng(0)
    with contextlib.suppress(KeyboardInterrupt), contextlib.ExitStack() as opened:
        for _ in range(options.busy):
            opened.enter_context(program(sys.executable, "-c", "while True: pass"))
        beside = opened.enter_context(Timer())
        for case in cases:
            for number in range(options.stops):
                begun_s, stop_s = measure(*case, after_s=float(draw.uniform(0.05, 1.5)))
                samples = beside.taken()
                late_ms += [1e3 * late_s for _, late_s in samples]
                until_s = begun_s + stop_s
                during = [late for due_s, late in samples if due_s + late > begun_s and due_s < until_s]
                results[case].append((stop_s, max(during, default=0.0)))
                print_line(f"{' '.join(map(str, case))}: {number + 1} of {options.stops}, {1e3 * stop_s:.1f} ms")
    rows = rows_of({case: stops for case, stops in results.items() if stops})
    print_table(rows, late_ms)
    if options.json:
        options.json.write_text(json.dumps({"rows": rows, "busy": options.busy}, indent=2) + "\n")


if __name__ == "__main__":
    main()
