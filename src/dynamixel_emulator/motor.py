"""The motor of an emulated servo: torque from voltage or current, and how warm it gets.

Torque falls linearly from the stall torque to nothing at the speed without load, and is proportional to the current.
Gears are ideal; friction and the rotor's inertia are up to the mechanics.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from dynamixel_emulator.models import PULSES_PER_TURN, ServoModel

RAD_PER_PULSE = 2.0 * math.pi / PULSES_PER_TURN
FULL_PWM = 885
"""Of PWM registers: all of the voltage (e-Manual, "PWM Limit": 885 units of 0.113 %)."""
ROOM_TEMPERATURE = 30.0
WARMING_AT_STALL = 150.0
"""Degrees above the room that a servo held at its stall current would reach in the end; an estimate."""
WARMING_S = 300.0
"""In which 63 % of the way to that is done; an estimate."""


@dataclass(frozen=True)
class Effort:
    """What a servo does at its shaft during a step: a torque of `torque - damping * velocity`.

    Apart, so that whoever moves the shaft can take the second part at the velocity after the step, which is stable.

    Attributes:
        torque: N m, positive towards growing positions.
        damping: N m s/rad.
    """

    torque: float = 0.0
    damping: float = 0.0

    def at(self, velocity: float) -> float:
        """N m at this velocity, rad/s."""
        return self.torque - self.damping * velocity


LIMP = Effort()


class Motor:
    """Of one servo.

    Args:
        model: Its stall torque, speed and current.

    Attributes:
        temperature: Degrees Celsius.
    """

    def __init__(self, model: ServoModel) -> None:
        self.model = model
        self.temperature = ROOM_TEMPERATURE
        self.braking = model.stall_torque / (model.top_speed * 2.0 * math.pi / 60.0)
        """Torque by the voltage that turning makes, N m s/rad."""

    def by_voltage(self, volts: float) -> Effort:
        """With this voltage at the motor, V, either way."""
        return Effort(self.model.stall_torque * volts / self.model.voltage, self.braking)

    def by_torque(self, wanted: Effort, velocity: float, volts: float) -> Effort:
        """With a current for the wanted torque, as far as these volts, positive, drive it at this velocity, rad/s."""
        maximum = self.by_voltage(volts)
        minimum = Effort(-maximum.torque, maximum.damping)
        asked = wanted.at(velocity)
        if asked > maximum.at(velocity):
            return maximum
        return minimum if asked < minimum.at(velocity) else wanted

    def amperes(self, torque: float) -> float:
        """Current that makes this torque, N m."""
        return torque / self.model.stall_torque * self.model.stall_amperes

    def warm(self, torque: float, during_s: float) -> None:
        """By the square of the current; cools towards the room."""
        load = torque / self.model.stall_torque
        rise = WARMING_AT_STALL * load * load - (self.temperature - ROOM_TEMPERATURE)
        self.temperature += rise * during_s / WARMING_S
