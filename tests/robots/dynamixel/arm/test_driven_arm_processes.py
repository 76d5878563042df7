"""A servo arm's driver is stopped or killed in motion, hangs, or is talked over by another program: servos rest."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynamixel_emulator.emulator import DynamixelEmulator
from paramove.robots.description import RobotDescription
from paramove.robots.dynamixel.arm.driven_arm import DrivenArm
from paramove.robots.dynamixel.arm.servo_arm import Timeouts
from paramove.robots.dynamixel.arm.servo_loop import LoopSettings
from paramove.robots.dynamixel.arm.setup import joint_servos, servo_port
from sim.emulated_arm import emulated_servos
from tests.robots.dynamixel.person import PATIENT_S, Person

ROOT = Path(__file__).parents[4]
ROBOT = RobotDescription.load(ROOT / "robot_description" / "open_manipulator_x")
SETTINGS = LoopSettings(timeouts=Timeouts(silent_s=2.0, watchdog_s=1.0, read_s=1.0))
"""Other programs may keep the emulator waiting, and the test."""
LATENCY_S = 0.3
TRIPPED = 0xFF
DRIVE = """
import json, sys
from tests.robots.dynamixel.arm.test_driven_arm_processes import driven, moves
with driven(sys.argv[1]) as person:
    person.arms_and_waits()
    moves(person)
    print("moves", flush=True)
    person.waits_for("HOLD")
    print(json.dumps([[fault.code, fault.detail] for fault in person.safety.faults]), flush=True)
    person.arms_and_waits_again()
    moves(person)
    print("moves", flush=True)
    sys.stdin.read()
"""
TALK = """
import os, select, sys
from paramove.robots.dynamixel.bus.packets import BROADCAST, Instruction, Packet, encoded
line = os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY)
print("open", flush=True)
while not select.select([sys.stdin], [], [], 0.002)[0]:
    os.write(line, encoded(Packet(12, Instruction.PING)))
"""


class PersonOfProcess(Person):
    """Arms an arm that a fault holds."""

    def arms_and_waits_again(self) -> None:
        self.arms()
        self.hears_until(self._is_armed)


@contextlib.contextmanager
def driven(port_name: str, settings: LoopSettings = SETTINGS):
    port = servo_port(ROBOT, port_name)
    port.latency_s = LATENCY_S
    with DrivenArm(ROBOT, joint_servos(ROBOT), port, settings) as arm:
        yield PersonOfProcess(arm)


def moves(person: Person) -> None:
    """Begins a long movement to the other side and returns while it is under way."""
    begun = len(person.angles)
    person.hears_until(lambda: len(person.angles) > begun)
    here = np.array(person.angles[-1])
    there = np.where(np.arange(len(here)) == 0, -np.sign(here[0] or 1.0) * 1.2, here)
    person.publish(f"{time.monotonic_ns()}", ROBOT.joint_names, [(0.0, here), (15.0, there)])
    person.hears_until(lambda: abs(person.angles[-1][0] - here[0]) > 0.05)


@contextlib.contextmanager
def process(code: str, *arguments: str):
    """Runs until its input ends, which is at the end of this context."""
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [sys.executable, "-c", code, *arguments], cwd=ROOT, stdin=pipe, stdout=pipe, text=True
    ) as one:
        yield one
        one.communicate(timeout=60)


@pytest.fixture
def emulator():
    with DynamixelEmulator(emulated_servos(ROBOT)) as emulator:
        yield emulator


def memory(emulator: DynamixelEmulator, name: str) -> list[int]:
    with emulator.lock:
        return [servo.memory[name] for servo in emulator.bus.servos]


def wait_until_tripped_and_at_rest(emulator: DynamixelEmulator) -> None:
    until_s, soon = time.monotonic() + PATIENT_S, emulator._stopped
    while memory(emulator, "Bus Watchdog") != [TRIPPED] * 5 or any(memory(emulator, "Present Velocity")):
        assert time.monotonic() < until_s, "the servos' watchdogs have not stopped them"
        soon.wait(0.01)


def test_a_driver_that_is_stopped_or_killed_in_motion_leaves_servos_that_rest_and_nobody_resumes(emulator):
    with process(DRIVE, emulator.port) as driver:
        assert driver.stdout.readline() == "moves\n"
        driver.send_signal(signal.SIGSTOP)
        wait_until_tripped_and_at_rest(emulator)
        rested = memory(emulator, "Present Position")
        driver.send_signal(signal.SIGCONT)
        ((code, detail),) = json.loads(driver.stdout.readline())
        assert code == "watchdog_tripped"
        assert "servo 11 (joint1) has stopped by itself" in detail
        assert "without data for 1000 ms" in detail
        assert detail.endswith("arm again, which clears its watchdog")
        assert memory(emulator, "Present Position") == rested
        assert driver.stdout.readline() == "moves\n"  # once it was armed again
        driver.kill()
    wait_until_tripped_and_at_rest(emulator)
    rested = memory(emulator, "Present Position")
    assert memory(emulator, "Torque Enable") == [1] * 5
    with driven(emulator.port) as person:
        person.waits_for("DISARMED")
        person.publish("of before", ROBOT.joint_names, [(0.0, ROBOT.base_pose), (1.0, ROBOT.base_pose)])
        assert person.is_told("REJECTED").code == "not_armed"
        assert memory(emulator, "Present Position") == rested
        person.arms_and_waits()
        assert memory(emulator, "Goal Position") == rested
        assert TRIPPED not in memory(emulator, "Bus Watchdog")


def test_logic_that_hangs_while_the_loop_lives_ends_in_the_stop_ramp(emulator):
    """Only what is commanded counts as a sign of life."""
    with driven(emulator.port) as person:
        person.arms_and_waits()
        moves(person)
        loop = person.arm._loop
        tick, loop._tick = loop._tick, lambda now_ns: None
        person.hears_until(lambda: loop._reader.at_rest)
        rested, packets = memory(emulator, "Goal Position"), emulator.bus.checker.packets
        person.hears_until(lambda: emulator.bus.checker.packets > packets + 20)
        assert memory(emulator, "Goal Position") == rested
        assert memory(emulator, "Bus Watchdog")[0] not in (0, TRIPPED), "the loop still talks to the servos"
        loop._tick = tick
        person.waits_for("HOLD")
        (fault,) = person.safety.faults
        assert fault.code in ("driver_stalled", "stream_under_run")
        assert "stalled for" in fault.detail or "ran out of rows" in fault.detail
        assert fault.detail.endswith("arm again")
        assert person.is_told("STOPPED").reason == fault.detail


@pytest.mark.skipif(os.geteuid() != 0, reason="others than root cannot open a port that is in use")
def test_another_program_that_talks_on_the_bus_stops_the_arm(emulator):
    with driven(emulator.port, replace(SETTINGS, timeouts=replace(SETTINGS.timeouts, silent_s=0.5))) as person:
        person.arms_and_waits()
        with process(TALK, emulator.port) as other:
            assert other.stdout.readline() == "open\n"
            person.waits_for("HOLD")
        (fault, *_) = person.safety.faults
        assert fault.code in ("bus_noise", "joint_silent")
        assert "another program talks on the bus" in fault.detail or "check its cable" in fault.detail
