"""A person's hand at a joint of emulated servos: it leads the joint to a place by a soft spring."""

from __future__ import annotations

import math

from paramove.robots.dynamixel.emulated.loops import STEP_S
from paramove.robots.dynamixel.emulated.motor import RAD_PER_PULSE, Effort

SPEED = 1.0 / RAD_PER_PULSE
"""Pulses per second, 57 degrees: slow enough to be watched."""
STIFFNESS, DAMPING = 30.0, 1.0
"""N m/rad and N m s/rad between hand and shaft; an estimate of a loose grip."""
STRONGEST = 3.0
"""N m; 15 N at a lever of 20 cm. A servo that holds gives way to it or not, as its torque says."""
KEENNESS = 2.0
"""1/s; so fast the hand makes up for what weight takes away from the place."""


class Hand:
    """Takes hold of the shaft of a servo and leads it to a target. All in pulses of the shaft's encoder.

    Args:
        shaft: Where it takes hold.
        target: Where it leads the shaft, and then keeps it.
    """

    def __init__(self, shaft: float, target: float) -> None:
        self._place, self._target = shaft, target
        self._arrived = False

    def led(self) -> float:
        """One millisecond: where a shaft that resists nothing is afterwards."""
        self._place += self._step()
        return self._place

    def effort(self, shaft: float, velocity: float) -> Effort:
        """One millisecond: what it does at a shaft that is there and turns so fast, pulses per second."""
        before, reach = self._place, STRONGEST / STIFFNESS / RAD_PER_PULSE
        moved = KEENNESS * (self._target - shaft) * STEP_S if self._arrived else self._step()
        self._place = max(shaft - reach, min(shaft + reach, before + moved))
        damped = DAMPING * RAD_PER_PULSE * (self._place - before) / STEP_S
        pull = STIFFNESS * RAD_PER_PULSE * (self._place - shaft) + damped
        torque = pull - DAMPING * RAD_PER_PULSE * velocity
        return Effort(math.copysign(STRONGEST, torque)) if abs(torque) > STRONGEST else Effort(pull, DAMPING)

    def _step(self) -> float:
        """Towards the target; once it is there, that is remembered."""
        left = self._target - self._place
        self._arrived = abs(left) <= SPEED * STEP_S
        return left if self._arrived else math.copysign(SPEED * STEP_S, left)
