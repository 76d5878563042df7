"""An emulated Koch v1.1, and what a person does to calibrate it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from dynamixel_emulator.emulator import DynamixelEmulator
from dynamixel_emulator.servo import EmulatedServo
from paramove.robots.dynamixel.calibration.arm_calibration import COUNTS_PER_RAD
from paramove.robots.dynamixel.calibration.arm_plan import load_plan

KOCH = Path(__file__).parents[3] / "robot_description" / "koch_v1_1"
PLAN = load_plan(KOCH)
NEARLY_HALF_A_TURN = 2.9
"""The roll could go on; its encoder tells a little less than a turn apart."""

Step = tuple[Callable[[], None], str]


def koch_servos() -> list[EmulatedServo]:
    """As the arm is described."""
    return [EmulatedServo(one.model, one.number, PLAN.baud_rate) for one in PLAN.servos]


def rest() -> None:
    """Nothing is done."""


def hands(emulator: DynamixelEmulator, zero: float = 2048.0) -> list[Step]:
    """What a person does and then types, step by step; after a line "look" the joints' places are told.

    `zero` are the counts of every servo in the zero pose, by the way in which the arm was put together.
    """

    def move(angles: dict[str, float]) -> Callable[[], None]:
        def act() -> None:
            with emulator.lock:
                for servo, planned in zip(emulator.bus.servos, PLAN.servos, strict=True):
                    if planned.joint in angles:
                        servo.turned(zero + COUNTS_PER_RAD * angles[planned.joint])

        return act

    def share(part: float) -> dict[str, float]:
        maximum = NEARLY_HALF_A_TURN
        ends = {one.joint: (max(one.lower, -maximum), min(one.upper, maximum)) for one in PLAN.servos}
        return {joint: low + part * (high - low) for joint, (low, high) in ends.items()}

    steps: list[Step] = [(rest, "\n")]
    steps += [(move(share(part)), "look\n") for part in (*np.linspace(0.5, 0.0, 5), *np.linspace(0.0, 1.0, 9))]
    steps += [(rest, "\n"), (move(dict.fromkeys((one.joint for one in PLAN.servos), 0.0)), "\n")]
    steps += [(move({one.joint: 0.3 if one.grows else -0.3}), "\n") for one in PLAN.servos]
    return [*steps, (rest, "\n")]
