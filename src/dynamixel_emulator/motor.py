"""Motor of an emulated servo: torque from voltage or current, and temperature.

Torque falls linearly from the stall torque to 0 at the no-load speed, and is proportional to the current. Gears are
ideal; the mechanics model friction and the rotor's inertia.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from dynamixel_emulator.models import PULSES_PER_TURN, ServoModel

RAD_PER_PULSE = 2.0 * math.pi / PULSES_PER_TURN
FULL_PWM = 885
"""Value of PWM registers for the full voltage (e-Manual, "PWM Limit": 885 units of 0.113 %)."""
ROOM_TEMPERATURE = 30.0
STALL_TEMPERATURE_RISE = 150.0
"""Steady-state temperature above room temperature at the stall current, degrees Celsius; an estimate."""
THERMAL_TIME_CONSTANT_S = 300.0
"""Time to 63 % of the steady-state rise; an estimate."""


@dataclass(frozen=True)
class Effort:
    """Action of a servo on its shaft during a step: a torque of `torque - damping * velocity`.

    The two terms are separate so that the integrator can evaluate damping at the velocity after the step (implicit
    integration), which is stable.

    Attributes:
        torque: N m, positive towards increasing positions.
        damping: N m s/rad.
    """

    torque: float = 0.0
    damping: float = 0.0

    def at(self, velocity: float) -> float:
        """Torque at this velocity, rad/s; N m."""
        return self.torque - self.damping * velocity


NO_EFFORT = Effort()


class Motor:
    """Motor of one servo.

    Args:
        model: Its stall torque, speed and current.

    Attributes:
        temperature: Degrees Celsius.
    """

    def __init__(self, model: ServoModel) -> None:
        self.model = model
        self.temperature = ROOM_TEMPERATURE
        self.back_emf_damping = model.stall_torque / (model.top_speed * 2.0 * math.pi / 60.0)
        """Damping by the back-EMF, N m s/rad."""

    def by_voltage(self, volts: float) -> Effort:
        """Effort at this signed voltage at the motor, V."""
        return Effort(self.model.stall_torque * volts / self.model.voltage, self.back_emf_damping)

    def by_torque(self, requested: Effort, velocity: float, volts: float) -> Effort:
        """Effort of current control at the requested torque, limited by this supply, V, at this velocity, rad/s."""
        maximum = self.by_voltage(volts)
        minimum = Effort(-maximum.torque, maximum.damping)
        torque = requested.at(velocity)
        if torque > maximum.at(velocity):
            return maximum
        return minimum if torque < minimum.at(velocity) else requested

    def amperes(self, torque: float) -> float:
        """Current for this torque, N m; A."""
        return torque / self.model.stall_torque * self.model.stall_amperes

    def update_temperature(self, torque: float, duration_s: float) -> None:
        """Heats with the square of the current, cools towards room temperature (first-order model)."""
        load = torque / self.model.stall_torque
        change = STALL_TEMPERATURE_RISE * load * load - (self.temperature - ROOM_TEMPERATURE)
        self.temperature += change * duration_s / THERMAL_TIME_CONSTANT_S
