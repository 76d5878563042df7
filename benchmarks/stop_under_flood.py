"""How long a person's stop takes while trajectories flood the driver of an arm that moves.

    python benchmarks/stop_under_flood.py [--stops 100] [--robots hoap3,open_manipulator_x] [--kinds valid,large]
                                          [--hosts 1,2] [--namespaces] [--busy 2] [--json FILE]
                                          [--before CHECKOUT]

In each scene there are the real driver node, emulated servos or a robot that only plays its stream, and a program that
commands a movement and then publishes trajectories as fast as it can. At some time of the movement a stop is published
once. Measured by the wall clock from when it is published to the driver until the driver publishes the gate's answer,
after the first rows of the stop; a servo arm plays the first of them within one more period, which is added. A driver
that has been flooded keeps its publisher out for a while, so some scenes take turns, each with the next part of the
movement. Driver, relays and servos have the priority that the launcher gives them, where that is allowed. With two
hosts program and person are on another bus, and two relays are between them and the driver: over the loopback, or each
in a network namespace, which needs root. There the last column begins with the person. With another checkout, which has
a `.venv`, the drivers of both are measured in the same run; one that has not answered for 60 s is started again.

    valid     short movements       invalid   1 MB each, of tens of thousands of points, the last one NaN
    large     20 000 points each    many      two points each
    checked   the arm is at rest, and each movement of 120 s breaks a limit in its last part only

Beside it, a timer of 10 ms shows how late this machine is by itself. A stop during which that timer stalled for more
than 20 ms is listed and left out. Ctrl-C prints what there is.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import json
import math
import multiprocessing
import os
import select
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # run as a program, only this folder is known

from benchmarks.arm import Emulation
from benchmarks.hosts import relay
from benchmarks.namespaces import HERE, THERE, Namespaces
from paramove.bus import BusVisitor, Publisher, publish_now, topics
from paramove.hosts import HostKeys, Peer, RelaySettings
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory
from paramove.msgs.safety_state_pb2 import ArmRequest, SafetyState, StopRequest
from paramove.robots import RobotDescription
from paramove.robots.hoap3 import receive, state_message
from paramove.robots.streaming import StreamReader
from paramove.safety import PERSON_STOP, minimum_jerk
from paramove.supervision import prioritise

ROOT = Path(__file__).resolve().parent.parent
KINDS = ("valid", "invalid", "large", "many", "checked")
SWING = {"hoap3": {"right_shoulder_pitch": -50.0, "right_elbow": -40.0}}
OTHER_SWING = {0: 40.0}
"""Of a servo arm: degrees by joint."""
SWING_S = 4.0
LEAD_S = 0.4
"""From the begin of the movement to that of the flood."""
AFTER_S = (0.05, 0.8)
"""From the begin of the flood to the stop: about until its publisher is kept out."""
TIMER_S, STALL_S = 0.010, 0.020
TIMEOUT_S = 60.0
START_TIMEOUT_S = 60.0
STATE_S = 1 / 15
WIDTH = 130
FIRST_PORT = 47_300
SCENES, TURN_S = 6, 10.5
"""A scene's next turn comes later than a flood's publisher is kept out."""
CONNECTS_S = 0.5
"""Until relays that were paused are connected again."""
TIMES = ("p50_ms", "p99_ms", "max_ms", "person_max_ms")
NETWORK_NAMESPACE = 0x40000000  # CLONE_NEWNET of sched.h
TIMEOUTS = {"silent_s": 0.5, "watchdog_s": 2.54, "read_s": 0.2}
"""Of servos that share the processors with everything else."""


def movement(
    robot: RobotDescription, name: str, n_points: int, duration_s: float, pose: dict[str, float] | None = None
) -> JointTrajectory:
    """Along a minimum-jerk path from a pose, rad by joint, to that end of the swing that is farther away.

    Without a pose from the base pose.
    """
    goals_deg = SWING.get(robot.name, {robot.joint_names[joint]: value for joint, value in OTHER_SWING.items()})
    message = JointTrajectory(id=name, joints=list(goals_deg))
    base = robot.base_pose[robot.indices(message.joints)]
    ends = base, base + np.deg2rad(list(goals_deg.values()))
    start = np.array([pose[joint] for joint in message.joints]) if pose else base
    goal = max(ends, key=lambda end: float(np.abs(end - start).max()))
    for u in np.linspace(0.0, 1.0, n_points):
        message.points.add(time_s=duration_s * u, position_rad=start + minimum_jerk(u) * (goal - start))
    return message


def flooding(robot: RobotDescription, kind: str) -> JointTrajectory:
    """What the program publishes again and again."""
    if kind == "many":
        return movement(robot, kind, 2, SWING_S)
    if kind == "valid":
        return movement(robot, kind, 301, SWING_S)
    if kind == "large":
        return movement(robot, kind, 20_000, 100.0)
    if kind == "invalid":
        message = movement(robot, kind, 2, 1.0)
        message.points.extend([message.points[0]] * ((2**20 - 100) // (message.points[0].ByteSize() + 2) - 2))
        message.points[-1].position_rad[0] = math.nan
        return message
    message = movement(robot, kind, 12_001, 120.0)
    message.points[-20].position_rad[0] += 0.01
    return message


def flood(folder: str, name: str, kind: str) -> None:
    """A program of its own: for each pose that it reads it commands a movement and floods until the next line."""
    robot = RobotDescription.load(ROOT / "robot_description" / name)
    message = flooding(robot, kind)
    number = 0
    with BusVisitor(Path(folder), "flooder") as visitor:
        publisher = visitor.publisher(replace(topics.ARM_TRAJECTORY, max_points=None))  # it keeps to no limit
        while not publisher.subscriptions:
            publisher.serve()
            time.sleep(0.01)
        print_line("ready")
        while True:
            pose = json.loads(waits_for_line(publisher))
            begun_s = time.monotonic()
            if kind != "checked":
                publish(publisher, movement(robot, f"swing {number}", 401, SWING_S, pose))
                while time.monotonic() - begun_s < LEAD_S:
                    publisher.serve()
                    time.sleep(0.01)
            while not select.select([sys.stdin], [], [], 0.0)[0]:
                number += 1
                message.id = f"{kind} {number}"
                publish(publisher, message)
            sys.stdin.readline()


def waits_for_line(publisher: Publisher) -> str:
    """Of standard input, while the publisher is served; ends the program with its input."""
    while not select.select([sys.stdin], [], [], 0.01)[0]:
        publisher.serve()
    return sys.stdin.readline() or sys.exit()


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
    """What that process does, until it is terminated."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent, which prints what there is
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


@dataclass(frozen=True)
class Stop:
    """When the person published it, when it was published to the driver, and when its first row is played, s."""

    begun_s: float
    received_s: float
    played_s: float

    @property
    def is_answered(self) -> bool:
        """Whether the driver has answered in time; otherwise it is never played."""
        return math.isfinite(self.played_s)


class World:
    """The robot and the person, on the buses of the person's host and of the driver's, which may be the same."""

    def __init__(self, robot: RobotDescription, person: BusVisitor, driver: BusVisitor) -> None:
        self.robot, self.safety, self.answered_s = robot, SafetyState(), 0.0
        self.pose: dict[str, float] = {}
        """Of the arm, rad by joint."""
        self._gate, self._joints = driver.subscriber(topics.ARM_SAFETY), driver.subscriber(topics.ARM_JOINT_STATES)
        self.is_relayed = driver is not person
        self._relayed, self._relayed_s = driver.subscriber(topics.OPERATOR_STOP_AWAY), 0.0
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
                self.safety, self.answered_s = received.message, 1e-9 * received.published_ns
        while (received := self._joints.receive()) is not None:
            self.pose = {joint.name: joint.position for joint in received.message.joints}
        while (received := self._relayed.receive()) is not None:
            self._relayed_s = 1e-9 * received.published_ns
        for subscriber in (self._gate, self._joints, self._relayed):
            subscriber.revive()
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
        """As a person does, once the arm rests; again if the machine was too busy."""
        resting = (SafetyState.STATE_DISARMED, SafetyState.STATE_HOLD)
        self.safety = SafetyState()  # as it was before a pause
        assert self.until(lambda gate: gate.state in resting and self.pose, START_TIMEOUT_S), "no driver"
        for _ in range(50):
            publish_now(self._arming, ArmRequest(source="benchmark", armed=True, by_person=True))
            if self.until(lambda gate: gate.state == SafetyState.STATE_ARMED, 1.0):
                return
        raise SystemExit(f"the arm cannot be armed: {self.safety}")

    def disarms(self) -> None:
        """Once the arm rests."""
        resting = (SafetyState.STATE_DISARMED, SafetyState.STATE_HOLD)
        assert self.until(lambda gate: gate.state in resting, TIMEOUT_S), f"no rest: {self.safety}"
        publish_now(self._arming, ArmRequest(source="benchmark", by_person=True))
        assert self.until(lambda gate: gate.state == SafetyState.STATE_DISARMED, TIMEOUT_S), f"no end: {self.safety}"

    def stop(self) -> Stop:
        """Published once; never played without an answer of the driver."""
        assert self.until(lambda gate: self._stop.subscriptions > 0, START_TIMEOUT_S), "nobody subscribes to stops"
        begun_s = time.monotonic()
        publish_now(self._stop, StopRequest(source="benchmark"))
        answered = self.until(lambda gate: any(fault.code == PERSON_STOP for fault in gate.faults), TIMEOUT_S)
        period_s = 0.0 if self.robot.bus is None else 1e-6 * self.robot.stream.period_us
        self.step()
        received_s = max(begun_s, self._relayed_s)
        return Stop(begun_s, received_s, self.answered_s + period_s if answered else math.inf)


def relay_within(namespace: str, folder: str, name: str, settings: dict[str, Any], pipe: Connection) -> None:
    """A host's relay, in a network namespace if it has a name."""
    if namespace:
        descriptor = os.open(f"/var/run/netns/{namespace}", os.O_RDONLY)
        if ctypes.CDLL(None, use_errno=True).setns(descriptor, NETWORK_NAMESPACE):
            raise OSError(ctypes.get_errno(), "cannot enter the network namespace", namespace)
    relay(folder, name, settings, pipe)


@contextlib.contextmanager
def joined(
    root: Path, hosts: int, first_port: int, namespaces: Namespaces | None
) -> Iterator[tuple[Path, Path, list[int]]]:
    """Bus folders of the person and of the driver: one, or two that are joined by relays, and these processes."""
    folders = [root / name for name in ("desk", "robot")][2 - hosts :]
    for folder in folders:
        folder.mkdir(mode=0o700)
    if hosts == 1:
        yield folders[0], folders[0], []
        return
    within = namespaces.names if namespaces else ["", ""]
    addresses = [HERE, THERE] if namespaces else ["127.0.0.1"] * 2
    ports = [first_port, first_port + 10]
    keys = {folder: HostKeys(root / f"keys_{folder.name}") for folder in folders}
    rows = {topic.name: topic.name for topic in (topics.ARM_TRAJECTORY, topics.OPERATOR_STOP)}
    make = multiprocessing.get_context("spawn")
    started, pipes = [], []  # a relay ends with its pipe
    pids: list[int] = []
    for index, (folder, other) in enumerate((folders, folders[::-1])):
        public = keys[other].own().public
        keys[folder].trust(other.name, public)
        wants, gives = ({}, rows) if folder.name == "robot" else (rows, {})
        peer = Peer(address=addresses[1 - index], port=ports[1 - index], key=public, wants=wants, gives=gives)
        settings = RelaySettings(
            address=addresses[index], port=ports[index], peers={other.name: peer}, keys=keys[folder].folder
        )
        here, there = make.Pipe()
        pipes.append(here)
        arguments = (within[index], str(folder), folder.name, settings.model_dump(mode="json"), there)
        started.append(make.Process(target=relay_within, args=arguments, daemon=True))
        started[-1].start()
        assert started[-1].pid is not None
        pids.append(started[-1].pid)
        prioritise(pids[-1], "high")
        assert here.recv() == "ready"
    try:
        yield folders[0], folders[1], pids
    finally:
        for process in started:
            process.terminate()
            process.join()


@contextlib.contextmanager
def program(*command: str, cwd: Path = ROOT) -> Iterator[subprocess.Popen[str]]:
    """A process, while this is a context."""
    pipe = subprocess.PIPE
    with subprocess.Popen(
        command, cwd=cwd, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, text=True, start_new_session=True
    ) as process:
        try:
            yield process
        finally:
            process.kill()


class Scene:
    """Driver, robot, flooder and person, ready to be stopped."""

    def __init__(self, world: World, flooder: subprocess.Popen[str], paused: list[int]) -> None:
        self._world, self._flooder, self._paused = world, flooder, paused
        self._flooded_s = -math.inf
        assert flooder.stdout is not None
        while not select.select([flooder.stdout], [], [], 0.0)[0]:
            world.step()
        assert flooder.stdout.readline() == "ready\n"
        self._pause()

    def stopped(self, after_s: float) -> Stop:
        """A stop so long after the flood has begun; the scene is over if nobody has answered."""
        time.sleep(max(0.0, self._flooded_s + TURN_S - time.monotonic()))
        self._signal(signal.SIGCONT)
        self._world.goes_on(CONNECTS_S if self._world.is_relayed else 0.0)
        self._world.arms()
        self._says(json.dumps(self._world.pose))
        self._world.goes_on(LEAD_S + after_s)
        stop = self._world.stop()
        self._says("rest")
        self._flooded_s = time.monotonic()
        if stop.is_answered:
            self._pause()
        return stop

    def __enter__(self) -> Scene:
        return self

    def __exit__(self, *_: object) -> None:
        self._signal(signal.SIGCONT)

    def _pause(self) -> None:
        """Until its next turn it takes no time from others."""
        self._world.disarms()
        self._signal(signal.SIGSTOP)

    def _signal(self, which: signal.Signals) -> None:
        for process in self._paused:
            os.kill(process, which)

    def _says(self, line: str) -> None:
        assert self._flooder.stdin is not None
        self._flooder.stdin.write(line + "\n")
        self._flooder.stdin.flush()


@dataclass(frozen=True)
class Case:
    """What is measured, again and again."""

    robot: str
    kind: str
    hosts: int
    checkout: Path = ROOT

    @property
    def driver(self) -> str:
        """Whose driver it is."""
        return "this" if self.checkout == ROOT else "before"

    def __str__(self) -> str:
        return f"{self.robot} {self.kind} {self.hosts} {self.driver}"


@contextlib.contextmanager
def scene(case: Case, number: int = 0, namespaces: Namespaces | None = None) -> Iterator[Scene]:
    """With new processes; scenes that are there at the same time have numbers of their own."""
    folder = ROOT / "robot_description" / case.robot
    robot = RobotDescription.load(folder)
    with tempfile.TemporaryDirectory(prefix="pm-") as root, contextlib.ExitStack() as opened:
        desk, driver, paused = opened.enter_context(
            joined(Path(root), case.hosts, FIRST_PORT + 20 * number, namespaces)
        )
        parameters: dict[str, Any] = {"robot": str(folder)}
        if robot.bus is not None:
            link = Path(root) / "usb-emulated_0001-if00-port0"
            emulation = Emulation(folder, robot.bus.baud_rate, link)
            opened.callback(emulation.end)
            paused.append(emulation.pid)
            prioritise(emulation.pid, "high")  # real servos have processors of their own
            parameters |= {"port": str(link), "timeouts": TIMEOUTS}
        node = "arm_driver" if robot.bus is None else "servo_arm_driver"
        config = Path(root) / "driver.yaml"
        bus = {"folder": str(driver), "clock": "monotonic"}
        config.write_text(json.dumps({"node": "driver", "bus": bus, "parameters": parameters, "run_folder": root}))
        python = sys.executable if case.checkout == ROOT else str(case.checkout / ".venv" / "bin" / "python")
        command = (python, "-m", f"nodes.{node}", "--config", str(config))
        driving = opened.enter_context(program(*command, cwd=case.checkout))
        prioritise(driving.pid, "high")
        paused.append(driving.pid)
        flooder = opened.enter_context(program(sys.executable, __file__, "--flood", str(desk), case.robot, case.kind))
        beside = opened.enter_context(BusVisitor(driver, "world"))
        person = beside if case.hosts == 1 else opened.enter_context(BusVisitor(desk, "person"))
        with Scene(World(robot, person, beside), flooder, paused) as ready:
            yield ready


class Scenes:
    """Of one case, some that take turns, and so many programs that never rest, while this is a context."""

    def __init__(self, case: Case, count: int, busy: int, namespaces: Namespaces | None) -> None:
        self._case, self._namespaces, self._busy = case, namespaces, busy
        self._opened = [contextlib.ExitStack() for _ in range(count)]
        self._scenes: list[Scene] = []
        self._next = 0

    def __enter__(self) -> Scenes:
        with contextlib.ExitStack() as opened:
            for one in self._opened:
                opened.enter_context(one)
            self._scenes = [self._new(number) for number in range(len(self._opened))]
            for _ in range(self._busy):
                opened.enter_context(program(sys.executable, "-c", "while True: pass"))
            self._all = opened.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._all.close()

    def stopped(self, after_s: float) -> Stop:
        """A stop of the next scene, so long after its flood has begun."""
        number = self._next % len(self._scenes)
        self._next += 1
        stop = self._scenes[number].stopped(after_s)
        if not stop.is_answered:
            self._opened[number].close()
            self._scenes[number] = self._new(number)
        return stop

    def _new(self, number: int) -> Scene:
        return self._opened[number].enter_context(scene(self._case, number, self._namespaces))


def rows_of(results: dict[Case, list[tuple[Stop, float]]]) -> list[dict[str, Any]]:
    """Of each case, its stops that count, and those that a stall of the machine fell into."""
    rows = []
    for case, stops in results.items():
        counted = [stop for stop, stall_s in stops if stall_s <= STALL_S or not stop.is_answered]
        row: dict[str, Any] = {"robot": case.robot, "kind": case.kind, "hosts": case.hosts}
        row |= {"driver": case.driver, "stops": len(counted)}
        row["left_out"] = [
            [round(1e3 * (stop.played_s - stop.received_s), 1), round(1e3 * stall, 1)]
            for stop, stall in stops
            if stall > STALL_S and stop.is_answered
        ]
        if counted:
            times_ms = 1e3 * np.array([stop.played_s - stop.received_s for stop in counted])
            quantiles = np.quantile(times_ms, [0.5, 0.99], method="inverted_cdf")  # so many of the stops took no longer
            row |= dict(zip(("p50_ms", "p99_ms", "max_ms"), [*quantiles.tolist(), times_ms.max()], strict=True))
            row["person_max_ms"] = 1e3 * max(stop.played_s - stop.begun_s for stop in counted)
        rows.append(row)
    return rows


def print_line(text: str) -> None:
    """At once."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def _in_ms(time_ms: float | None) -> str:
    """For the table."""
    if time_ms is None:
        return "–"
    return f"{time_ms:.1f}" if math.isfinite(time_ms) else "never"


def print_table(rows: list[dict[str, Any]], late_ms: list[float]) -> None:
    """The table, and the timer beside it."""
    table = Table(
        "robot",
        "flood",
        "hosts",
        "driver",
        "stops",
        "p50, ms",
        "p99, ms",
        "max, ms",
        "from the person: max, ms",
        "left out: stop / stall, ms",
    )
    for row in rows:
        times = [_in_ms(row.get(key)) for key in TIMES]
        left_out = ", ".join(f"{stop:.0f} / {stall:.0f}" for stop, stall in row["left_out"]) or "–"
        table.add_row(row["robot"], row["kind"], str(row["hosts"]), row["driver"], str(row["stops"]), *times, left_out)
    Console(width=WIDTH).print(table)
    late = np.quantile(late_ms, [0.5, 0.99, 1.0]) if late_ms else [math.nan] * 3
    print_line("a timer of 10 ms beside it is late by {:.1f} ms (p50), {:.1f} ms (p99), {:.1f} ms (max)".format(*late))


def main() -> None:
    """Measures all cases in turn."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stops", type=int, default=100, help="of each case")
    parser.add_argument("--robots", default="hoap3,open_manipulator_x")
    parser.add_argument("--kinds", default=",".join(KINDS))
    parser.add_argument("--hosts", default="1,2")
    parser.add_argument(
        "--namespaces", action="store_true", help="each of two hosts is a network namespace; needs root"
    )
    parser.add_argument("--busy", type=int, default=0, help="programs that never rest")
    parser.add_argument("--before", type=Path, help="another checkout, with a .venv: its driver is measured, too")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--flood", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.flood:
        flood(*options.flood)
    checkouts = [ROOT, options.before.resolve()] if options.before else [ROOT]
    cases = [
        Case(name, kind, int(hosts), checkout)
        for hosts in options.hosts.split(",")
        for name in options.robots.split(",")
        for kind in options.kinds.split(",")
        for checkout in checkouts
    ]
    results: dict[Case, list[tuple[Stop, float]]] = {case: [] for case in cases}
    late_ms: list[float] = []
    draw = np.random.default_rng(0)
    with contextlib.suppress(KeyboardInterrupt), contextlib.ExitStack() as opened:
        namespaces = opened.enter_context(Namespaces()) if options.namespaces else None
        beside = opened.enter_context(Timer())
        for case in cases:
            with Scenes(case, min(SCENES, options.stops), options.busy, namespaces) as scenes:
                for number in range(options.stops):
                    stop = scenes.stopped(float(draw.uniform(*AFTER_S)))
                    samples = beside.taken()
                    late_ms += [1e3 * late_s for _, late_s in samples]
                    during = [
                        late_s for due_s, late_s in samples if due_s + late_s > stop.begun_s and due_s < stop.played_s
                    ]
                    results[case].append((stop, max(during, default=0.0)))
                    took = _in_ms(1e3 * (stop.played_s - stop.received_s))
                    print_line(f"{case}: {number + 1} of {options.stops}, {took} ms")
    rows = rows_of({case: stops for case, stops in results.items() if stops})
    print_table(rows, late_ms)
    if options.json:
        options.json.write_text(json.dumps({"rows": rows, "busy": options.busy}, indent=2) + "\n")


if __name__ == "__main__":
    main()
