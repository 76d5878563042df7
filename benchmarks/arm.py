"""How fast a servo arm is stopped by whatever ends its movement, and which loop rates its bus holds.

    python benchmarks/arm.py [--json FILE] [--trials N] [--robot FOLDER] [--only-replies] [--busy N]

The driver's own loop moves an arm of emulated servos behind a pseudo-terminal whose answers take as long as their bytes
do. Times are of the wall clock, so other programs lengthen them; the processes share this machine's processors.

    command loss    the driver proposes nothing more; until the first row of the stop ramp is played
    driver killed   SIGKILL; until the servos rest by their bus watchdog
    stop            a person's stop request reaches the driver; until the first row of the stop ramp is played
    unplugged       until the gate lets nothing pass any more
    loop            periods of the loop, measured at the servos' end
    replies         of servos that move the arm in its scene, to 4800 reads, next to N programs that never rest
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import serial

from dynamixel_emulator import DynamixelEmulator
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory
from paramove.msgs.safety_state_pb2 import ArmRequest, StopRequest
from paramove.robots import RobotDescription
from paramove.robots.dynamixel import (
    DrivenArm,
    Instruction,
    LoopSettings,
    Packet,
    Timeouts,
    encoded,
    joint_servos,
    servo_port,
)
from paramove.robots.streaming import Playing
from paramove.safety import State

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # run as a program, only this folder is known

from sim.emulated_arm import EmulatedArm, emulated_servos

ROOT = Path(__file__).resolve().parent.parent
GOALS_MS = {"command loss": 100.0, "driver killed": 120.0, "stop": 20.0, "unplugged": 50.0}
MOVEMENT_S = 4.0
UNDER_WAY_S = 1.0
TIMEOUT_S = 10.0
LOOP_S = 10.0
READS, SDK_TIMEOUT_MS = 4800, 34.0
"""ROBOTIS's SDK waits so long for an answer: twice 16 ms and 2."""
BUSY = Timeouts(silent_s=0.25, read_s=0.1)
"""For measurements other than of missing replies: other programs may take the processors for a while."""


class Emulation:
    """Emulated servos in a process of their own, as real ones have their own processors."""

    def __init__(self, folder: Path, baud_rate: int, link: Path, *options: str) -> None:
        command = [sys.executable, __file__, "--robot", str(folder), "--emulate", str(link), "--baud", str(baud_rate)]
        command += options
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, start_new_session=True)
        self.does("ready")

    @property
    def pid(self) -> int:
        """Of the process."""
        return self._process.pid

    def does(self, command: str) -> None:
        """Sends a command and waits until it is done."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(command + "\n")
        self._process.stdin.flush()
        self._process.stdout.readline()

    def end(self) -> None:
        """Of the process."""
        self._process.communicate("end\n")


def emulate(description: RobotDescription, link: Path, baud_rate: int, world: bool) -> None:
    """What that process does: one answer for each command."""
    assert description.bus is not None
    bus = description.bus.model_copy(update={"baud_rate": baud_rate})
    description = replace(description, bus=bus)
    with contextlib.ExitStack() as opened:
        if world:
            emulator = opened.enter_context(EmulatedArm(description, link=link, held=True)).emulator
        else:
            emulator = opened.enter_context(DynamixelEmulator(emulated_servos(description), link))
        for line in sys.stdin:
            command = line.strip()
            if command == "end":
                return
            if command in ("unplug", "plug_in"):
                getattr(emulator, command)()
            print_line("done")


class Rig:
    """An armed arm on an emulated bus, and movements to and fro."""

    def __init__(self, arm: DrivenArm, emulation: Emulation, description: RobotDescription) -> None:
        self.arm, self.emulation, self.description = arm, emulation, description
        self._number = 0
        self._there = False

    @property
    def loop(self) -> Any:
        """Of the arm; the measured values are not public."""
        return self.arm._loop

    def arms(self) -> None:
        """Returns when the gate is armed."""
        wait(lambda: self.loop.driver.state in (State.DISARMED, State.HOLD))
        self.arm.on_arm_request(ArmRequest(source="benchmark", armed=True, by_person=True), time.monotonic_ns())
        wait(lambda: self.loop.driver.state is State.ARMED)

    def moves(self) -> None:
        """Begins a movement and returns while it is under way."""
        start = self.description.units.to_radians(self.loop._reader.target)
        self._there = not self._there
        target = self.description.base_pose.copy()
        target[0] += 1.2 if self._there else -1.2
        self._number += 1
        message = JointTrajectory(id=f"movement {self._number}", joints=list(self.description.joint_names))
        for time_s, angles in ((0.0, start), (MOVEMENT_S, target)):
            message.points.add(time_s=time_s, position_rad=list(angles))
        self.arm.on_trajectory(message, time.monotonic_ns())
        time.sleep(UNDER_WAY_S)

    def ramp_begins_ms(self, begun_s: float) -> float:
        """From then until a row of the stop ramp is the latest one played."""
        reader = self.loop._reader
        wait(lambda: reader.playing != Playing.FRAMES)
        index = reader.next_index
        wait(lambda: reader.next_index > index)
        return 1e3 * (time.monotonic() - begun_s)


@contextmanager
def rig(description: RobotDescription, folder: Path, timeouts: Timeouts = BUSY) -> Any:
    """A rig at the description's baud rate; ends with the arm at rest."""
    assert description.bus is not None
    with tempfile.TemporaryDirectory() as name:
        link = Path(name) / "usb-emulated_0001-if00-port0"
        emulation = Emulation(folder, description.bus.baud_rate, link)
        port = servo_port(description, str(link))
        with DrivenArm(description, joint_servos(description), port, LoopSettings(timeouts=timeouts)) as arm:
            yield Rig(arm, emulation, description)
        emulation.end()


def wait(what: Callable[[], bool]) -> None:
    """Looks every half millisecond."""
    until_s = time.monotonic() + TIMEOUT_S
    while not what():
        if time.monotonic() > until_s:
            raise SystemExit(f"nothing happened for {TIMEOUT_S:g} s: is the machine too busy?")
        time.sleep(0.0005)


def stop_ms(description: RobotDescription, folder: Path, trials: int) -> list[float]:
    """A person's stop, again and again."""
    times_ms = []
    with rig(description, folder) as here:
        for _ in range(trials):
            here.arms()
            here.moves()
            begun_s = time.monotonic()
            here.arm.on_stop(StopRequest(source="benchmark"))
            times_ms.append(here.ramp_begins_ms(begun_s))
            wait(lambda: here.loop.driver.state is State.HOLD)
    return times_ms


def command_loss_ms(description: RobotDescription, folder: Path, trials: int) -> list[float]:
    """The driver's logic stops, as if it hung; the loop plays what it has."""
    times_ms = []
    with rig(description, folder) as here:
        for _ in range(trials):
            here.arms()
            here.moves()
            ticks = here.loop._tick
            with here.loop.lock:
                begun_s = time.monotonic()
                here.loop._tick = lambda now_ns: None
            times_ms.append(here.ramp_begins_ms(begun_s))
            with here.loop.lock:
                here.loop._tick = ticks
            wait(lambda: here.loop.driver.state is State.HOLD)
    return times_ms


def unplugged_ms(description: RobotDescription, folder: Path, trials: int) -> list[float]:
    """The plug is pulled; until the gate lets nothing pass any more."""
    times_ms = []
    with rig(description, folder, Timeouts()) as here:
        for _ in range(trials):
            here.arms()
            here.moves()
            begun_s = time.monotonic()
            threading.Thread(target=here.emulation.does, args=("unplug",)).start()
            wait(lambda: here.loop.driver.state is not State.ARMED)
            times_ms.append(1e3 * (time.monotonic() - begun_s))
            here.emulation.does("plug_in")
            wait(lambda: here.loop.lost == "")
            wait(lambda: here.loop.driver.state in (State.DISARMED, State.HOLD))
    return times_ms


def killed_ms(description: RobotDescription, folder: Path, trials: int) -> list[float]:
    """A process that drives the arm is killed; until all servos rest."""
    times_ms = []
    for _ in range(trials):
        with DynamixelEmulator(emulated_servos(description)) as emulator:
            command = [sys.executable, __file__, "--robot", str(folder), "--drive", emulator.port]
            with subprocess.Popen(command, stdout=subprocess.PIPE) as driver:
                assert driver.stdout is not None
                driver.stdout.readline()
                driver.send_signal(signal.SIGKILL)
                begun_s = time.monotonic()
                wait(partial(_at_rest, emulator))
                times_ms.append(1e3 * (time.monotonic() - begun_s))
    return times_ms


def _at_rest(emulator: DynamixelEmulator) -> bool:
    return all(servo.velocity == 0.0 for servo in emulator.bus.servos)


def drive(description: RobotDescription, port: str) -> None:
    """What is killed: moves the arm, and reports it."""
    settings = LoopSettings(timeouts=BUSY)
    with DrivenArm(description, joint_servos(description), servo_port(description, port), settings) as arm:
        wait(lambda: arm._loop.driver.state is State.DISARMED)
        arm.on_arm_request(ArmRequest(source="benchmark", armed=True, by_person=True), time.monotonic_ns())
        wait(lambda: arm._loop.driver.state is State.ARMED)
        message = JointTrajectory(id="movement", joints=list(description.joint_names))
        target = description.base_pose.copy()
        target[0] += 1.2
        for time_s, angles in ((0.0, description.base_pose), (MOVEMENT_S, target)):
            message.points.add(time_s=time_s, position_rad=list(angles))
        arm.on_trajectory(message, time.monotonic_ns())
        time.sleep(UNDER_WAY_S)
        sys.stdout.write("moving\n")
        sys.stdout.flush()
        time.sleep(TIMEOUT_S)


def periods_ms(description: RobotDescription, folder: Path, baud_rate: int, rate_hz: int) -> np.ndarray:
    """Between goals as they arrive, while the arm moves."""
    assert description.bus is not None
    bus = description.bus.model_copy(update={"baud_rate": baud_rate})
    stream = description.stream.model_copy(update={"period_us": 1_000_000 // rate_hz})
    arrivals: list[float] = []
    with rig(replace(description, bus=bus, stream=stream), folder) as here:
        here.arms()
        command = here.loop.arm.command

        def timed_command(counts: Any) -> None:
            command(counts)
            arrivals.append(time.monotonic())

        here.loop.arm.command = timed_command
        until_s = time.monotonic() + LOOP_S
        while time.monotonic() < until_s:
            here.moves()
            time.sleep(MOVEMENT_S)
    return 1e3 * np.diff(arrivals)


def replies_ms(description: RobotDescription, folder: Path, busy: int) -> list[float]:
    """From a question until its answer is whole; each servo in turn, 6 ms after the last one's."""
    times = []
    with tempfile.TemporaryDirectory() as name:
        link = Path(name) / "port"
        emulation = Emulation(folder, 1_000_000, link, "--world")
        loops = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(busy)]
        with contextlib.suppress(PermissionError):  # what is measured is not how late this program is itself
            os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(1))
        with serial.Serial(str(link), 1_000_000, timeout=TIMEOUT_S) as port:
            for i in range(READS):
                servo = description.servo_ids[i % len(description.servo_ids)]
                begun_s = time.monotonic()
                port.write(encoded(Packet(servo, Instruction.READ, bytes([132, 0, 4, 0]))))
                if len(port.read(15)) == 15:
                    times.append(1e3 * (time.monotonic() - begun_s))
                time.sleep(0.006)
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        for loop in loops:
            loop.kill()
        emulation.end()
    return times


def replies(description: RobotDescription, folder: Path, busy: int) -> dict[str, float]:
    """Measured, printed and as numbers."""
    times = replies_ms(description, folder, busy)
    median, p99 = np.percentile(times, [50, 99])
    late = READS - sum(one <= SDK_TIMEOUT_MS for one in times)
    print_line(
        f"replies next to {busy} busy programs: median {median:.1f} ms, 99 % {p99:.1f}, worst {max(times):.1f}, "
        f"{late} of {READS} after {SDK_TIMEOUT_MS:.0f} ms"
    )
    return {"median_ms": median, "p99_ms": p99, "worst_ms": max(times), "late": late, "reads": READS}


def stops_and_loops(description: RobotDescription, folder: Path, trials: int) -> dict[str, Any]:
    """Measured, printed and as numbers."""
    numbers: dict[str, Any] = {}
    for name, measured in (
        ("stop", stop_ms(description, folder, trials)),
        ("command loss", command_loss_ms(description, folder, trials)),
        ("unplugged", unplugged_ms(description, folder, trials)),
        ("driver killed", killed_ms(description, folder, max(3, trials // 4))),
    ):
        median, p99 = np.percentile(measured, [50, 99])
        numbers[name] = {"median_ms": median, "p99_ms": p99, "worst_ms": max(measured), "trials": len(measured)}
        goal = GOALS_MS[name]
        print_line(f"{name:14} median {median:6.1f} ms, 99 % {p99:6.1f}, worst {max(measured):6.1f} (goal {goal:.0f})")
    for baud_rate, rate_hz in ((1_000_000, 100), (4_000_000, 200)):
        periods = periods_ms(description, folder, baud_rate, rate_hz)
        median, p99 = np.percentile(periods, [50, 99])
        late = float((periods > 1.5e3 / rate_hz).mean())
        held = 1e3 / periods.mean()
        numbers[f"loop {rate_hz} Hz"] = {"rate_hz": held, "median_ms": median, "p99_ms": p99, "late_share": late}
        print_line(
            f"loop {rate_hz} Hz at {baud_rate // 1_000_000} Mbit/s: {held:.1f} Hz, period median {median:.2f} ms, "
            f"99 % {p99:.2f}, half a period late {late:.1%}"
        )
    return numbers


def main() -> None:
    """Measures, prints a table and writes the numbers if requested."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=Path)
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--robot", type=Path, default=ROOT / "robot_description" / "open_manipulator_x")
    parser.add_argument("--only-replies", action="store_true")
    parser.add_argument("--busy", type=int, default=2, help="programs that never rest while replies are measured")
    parser.add_argument("--world", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--drive", help=argparse.SUPPRESS)
    parser.add_argument("--emulate", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--baud", type=int, default=1_000_000, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    description = RobotDescription.load(arguments.robot)
    if arguments.drive:
        drive(description, arguments.drive)
        return
    if arguments.emulate:
        emulate(description, arguments.emulate, arguments.baud, arguments.world)
        return
    load, trials = os.getloadavg()[0], arguments.trials
    print_line(f"{description.name}, {len(os.sched_getaffinity(0))} processors, load {load:.1f} before")
    numbers: dict[str, Any] = {"replies": replies(description, arguments.robot, arguments.busy)}
    if not arguments.only_replies:
        numbers |= stops_and_loops(description, arguments.robot, trials)
    if arguments.json:
        arguments.json.write_text(json.dumps(numbers, indent=2) + "\n", encoding="utf-8")


def print_line(line: str) -> None:
    """To the terminal at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
