"""An emulated arm of three servos, plugged in as udev shows it, and its plan."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dynamixel_emulator.emulator import DynamixelEmulator
from dynamixel_emulator.servo import EmulatedServo
from paramove.robots.dynamixel.bus.servo_chain import ServoChain
from paramove.robots.dynamixel.bus.servo_models import PULSES_PER_TURN
from paramove.robots.dynamixel.bus.servo_port import ServoPort
from paramove.robots.dynamixel.calibration.arm_calibration import (
    COUNTS_PER_RAD,
    ArmCalibration,
    CalibratedBus,
    JointCalibration,
)
from paramove.robots.dynamixel.calibration.arm_plan import ArmPlan, PlannedServo

SERIAL = "FT6Z5NCH"
LINK = f"usb-FTDI_USB__-__Serial_Converter_{SERIAL}-if00-port0"
BAUD_RATE = 2_000_000
RANGE = (-1.2, 1.4)
MODELS_BY_JOINT = {"pan": "xl430_w250", "lift": "xl430_w250", "elbow": "xl330_m288"}
PLAN = ArmPlan(
    "small_arm",
    BAUD_RATE,
    tuple(
        PlannedServo(joint, number, model, *RANGE, direction=f"{joint} goes up")
        for number, (joint, model) in enumerate(MODELS_BY_JOINT.items(), start=1)
    ),
)
SIGNS = {"pan": 1, "lift": -1, "elbow": 1}
ZEROS = {"pan": 2048, "lift": 4090, "elbow": 1000}
"""Counts at 0 rad: the lift's encoder has its seam in the middle of the travel."""


@dataclass
class SmallArm:
    """The emulated arm and a chain to it, while its port is open."""

    emulator: DynamixelEmulator
    chain: ServoChain

    def move(self, **angles: float) -> None:
        """A person moves joints to these angles, rad."""
        with self.emulator.lock:
            for servo, (joint, zero) in zip(self.emulator.bus.servos, ZEROS.items(), strict=True):
                if joint in angles:
                    servo.turned(float(zero + SIGNS[joint] * COUNTS_PER_RAD * angles[joint]))

    def memory(self, joint: str) -> dict[str, int]:
        """Numbers of a joint's servo."""
        servo = self.emulator.bus.servos[list(ZEROS).index(joint)]
        return {name: servo.memory[name] for name in servo.model.registers}


@contextlib.contextmanager
def plugged_in(by_id: Path) -> Iterator[DynamixelEmulator]:
    """The emulated arm with its link in a folder as udev makes it."""
    by_id.mkdir(exist_ok=True)
    servos = []
    for servo in PLAN.servos:
        servos.append(EmulatedServo(servo.model, servo.number, BAUD_RATE, float(ZEROS[servo.joint] % PULSES_PER_TURN)))
    with DynamixelEmulator(servos, by_id / LINK) as emulator:
        yield emulator


@contextlib.contextmanager
def small_arm(by_id: Path) -> Iterator[SmallArm]:
    """As `plugged_in`, with an open port."""
    with plugged_in(by_id) as emulator, ServoPort(str(by_id / LINK), BAUD_RATE, latency_s=0.1) as port:
        yield SmallArm(emulator, ServoChain(port))


def calibration() -> ArmCalibration:
    """As calibrating the arm gives it."""
    joints = {}
    for servo in PLAN.servos:
        sign, zero = SIGNS[servo.joint], ZEROS[servo.joint]
        ends = sorted(round(zero + sign * COUNTS_PER_RAD * end) for end in RANGE)
        crosses = not 64 <= ends[0] <= ends[1] < PULSES_PER_TURN - 64
        joints[servo.joint] = JointCalibration(
            id=servo.number, model=servo.model, firmware=46, sign=sign, operating_mode=4 if crosses else 3,
            homing_offset=0, zero_counts=zero, min_counts=ends[0], max_counts=ends[1],
        )  # fmt: skip
    bus = CalibratedBus(serial=SERIAL, baud_rate=BAUD_RATE)
    return ArmCalibration(
        created="2026-11-23T02:00:00+00:00", tool="paramove 0.1.0", robot="small_arm", bus=bus, joints=joints
    )


def swept() -> list[float]:
    """Angles through which a person moves a joint, rad."""
    return [*np.linspace(0.0, RANGE[0], 6), *np.linspace(RANGE[0], RANGE[1], 12), *np.linspace(RANGE[1], 0.0, 6)]
