"""An arm of Dynamixel servos without torque, which a person moves: where its joints are."""

from __future__ import annotations

import numpy as np

from paramove.documents import Floats
from paramove.robots import RobotDescription
from paramove.robots.dynamixel.bus.position_watch import POSITION, PositionWatch
from paramove.robots.dynamixel.bus.servo_chain import ServoChain, ServoTimeoutError
from paramove.robots.dynamixel.bus.servo_models import PULSES_PER_TURN, model_named

GIVES_UP = 25
"""Readings in a row without a reply of a servo."""


class TorqueOffArm:
    """`release` its servos, then read their positions.

    Args:
        chain: At the arm's baud rate.
        description: Of an arm with servos; its units are those of this very arm.

    `release` and `measured` raise PortLostError and ServoError.
    """

    def __init__(self, chain: ServoChain, description: RobotDescription) -> None:
        self._chain = chain
        self._joints, self._numbers = description.joint_names, description.servo_ids
        self._models = [model_named(motor) for motor in description.motors]
        self._watch = PositionWatch(dict(zip(self._numbers, self._models, strict=True)))
        self._units = description.units
        middle = 0.5 * (description.units.lower + description.units.upper)
        self._middle = self._units.zero_counts + self._units.counts_per_rad * middle
        self._misses = 0

    def release(self) -> None:
        """Torque off; who holds the arm carries its weight from now on."""
        for number, model in zip(self._numbers, self._models, strict=True):
            self._chain.write(number, model.registers["Torque Enable"], 0)

    def put_down(self) -> tuple[str, ...]:
        """Put the arm in its final state; without torque nothing is to be done.

        Returns:
            What failed, for people.
        """
        return ()

    def measured(self) -> tuple[int, Floats] | None:
        """When, ns of the monotonic clock, and the angles of all joints, [J], rad.

        None while a reply is missing, or has a position that cannot be true.

        Raises:
            ServoTimeoutError: A servo has not replied for long.
        """
        answers = self._watch.read(self._chain)
        missing = [number for number in self._numbers if number not in answers]
        self._misses = self._misses + 1 if missing else 0
        if self._misses > GIVES_UP:
            raise ServoTimeoutError(missing[0], f"servo {missing[0]} no longer answers: check its cable and its power")
        if missing:
            return None
        positions = np.array([answers[number].values[POSITION] for number in self._numbers], dtype=np.float64)
        # A servo in the extended mode may begin in another turn.
        counts = positions - PULSES_PER_TURN * np.round((positions - self._middle) / PULSES_PER_TURN)
        at_ns = max(answers[number].at_ns for number in self._numbers)
        return at_ns, (counts - self._units.zero_counts) / self._units.counts_per_rad
