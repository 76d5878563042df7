"""Control loops of an emulated servo: from goals to a trajectory, and from the trajectory to the motor's effort.

Source: e-Manual, "Position PID Gain", "Velocity PI Gain" and "Operating Mode". Differences and sums are per
millisecond; assumed, the manual does not specify it. Feedforward gains have no effect.
"""

from __future__ import annotations

import math

from dynamixel_emulator.memory import (
    CURRENT_BASED_POSITION_MODE,
    CURRENT_MODE,
    EXTENDED_MODES,
    POSITION_MODE,
    PWM_MODE,
    TRIPPED,
    VELOCITY_MODE,
    ServoMemory,
)
from dynamixel_emulator.models import PULSES_PER_TURN
from dynamixel_emulator.motor import FULL_PWM, RAD_PER_PULSE, Effort, Motor

STEP_S = 0.001
VELOCITY_UNIT = 0.229 * PULSES_PER_TURN / 60.0
"""Pulses per second of one unit of velocity, 0.229 rev/min (e-Manual, "Goal Velocity")."""
ACCELERATION_UNIT = 214.577 * PULSES_PER_TURN / 3600.0
"""Pulses per second squared of one unit of acceleration, 214.577 rev/min^2 (e-Manual, "Profile Acceleration")."""
REV_PER_MINUTE = PULSES_PER_TURN / 60.0
UNLOADED_ACCELERATION = 40_000.0
"""Pulses per second squared, of a servo without load and without a profile; assumed."""
NO_RAMP = 1e9
"""Pulses per second squared of a trajectory without Profile Acceleration."""
TIME_BASED = 0x04
"""Bit of Drive Mode (10)."""
IN_POSITION, PROFILE_ONGOING, RECTANGULAR, TRIANGULAR, TRAPEZOIDAL = 0x01, 0x02, 0x10, 0x20, 0x30
"""Bits of Moving Status (123) (e-Manual, "Moving Status")."""
NEAR = 20.0
"""Maximum distance from the goal that counts as arrived, pulses; assumed."""
POSITION_P, POSITION_I, POSITION_D = 1 / 128, 1 / 65536, 1 / 16
VELOCITY_P, VELOCITY_I = 1 / 128, 1 / 65536


class Trajectory:
    """Desired position, pulses, and velocity, pulses per second, at the current time."""

    def __init__(self) -> None:
        self.position = self.velocity = 0.0

    def reset(self, position: float, velocity: float = 0.0) -> None:
        """Starts at this position and velocity."""
        self.position, self.velocity = position, velocity

    def step_towards(self, goal: float, max_speed: float, acceleration: float) -> None:
        """Advances one step towards the goal, without overshoot."""
        distance = goal - self.position
        # The maximum speed from which the servo can still brake in time after one more step at this speed.
        stopping = acceleration * (math.sqrt(STEP_S**2 + 2.0 * abs(distance) / acceleration) - STEP_S)
        self.step_to_velocity(math.copysign(min(max_speed, stopping), distance), acceleration)

    def step_to_velocity(self, velocity: float, acceleration: float) -> None:
        """Advances one step while accelerating towards this velocity."""
        change = velocity - self.velocity
        self.velocity += math.copysign(min(abs(change), acceleration * STEP_S), change)
        self.position += self.velocity * STEP_S


class Loops:
    """Control loops of one servo; positions and velocities as in its control table, without the homing offset.

    Args:
        memory: Its goals, limits and gains.
        motor: The motor that the loops drive.

    Attributes:
        trajectory: The desired trajectory.
        pwm: Last output, fraction of the voltage in units of 1 / 885.
    """

    def __init__(self, memory: ServoMemory, motor: Motor) -> None:
        self.memory, self.motor = memory, motor
        self.trajectory = Trajectory()
        self.pwm = 0.0
        self._integral = 0.0
        self._limits = (math.inf, NO_RAMP)  # maximum speed and acceleration of the trajectory, pulses and s
        self._shape = 0

    def reset(self, position: float, velocity: float = 0.0) -> None:
        """Restarts from this position and velocity: torque was switched on, or the position was reset."""
        self.trajectory.reset(position, velocity)
        self._integral = 0.0

    def plan(self) -> None:
        """Computes the profile to a new goal from the current registers; later changes apply to the next goal."""
        velocity, acceleration = self.memory["Profile Velocity"], self.memory["Profile Acceleration"]
        if not velocity and self.memory["Operating Mode"] != VELOCITY_MODE:
            self._limits = math.inf, NO_RAMP  # a step
        elif self.memory["Drive Mode"] & TIME_BASED:
            self._limits = self._limits_by_time(1e-3 * velocity, 1e-3 * acceleration)
        else:
            self._limits = velocity * VELOCITY_UNIT or math.inf, acceleration * ACCELERATION_UNIT or NO_RAMP
        self._shape = self._profile_shape(abs(self._goal() - self.trajectory.position))

    def _limits_by_time(self, duration_s: float, acceleration_s: float) -> tuple[float, float]:
        """Maximum speed and acceleration for a profile of this duration and acceleration time."""
        if self.memory["Operating Mode"] == VELOCITY_MODE:
            change = abs(self.memory["Goal Velocity"] * VELOCITY_UNIT - self.trajectory.velocity)
            return math.inf, change / acceleration_s if change and acceleration_s else NO_RAMP
        acceleration_s = min(acceleration_s, duration_s / 2.0)
        speed = max(abs(self._goal() - self.trajectory.position) / (duration_s - acceleration_s), VELOCITY_UNIT)
        return speed, speed / acceleration_s if acceleration_s else NO_RAMP

    def _profile_shape(self, distance: float) -> int:
        """Bits of Moving Status (123) for the profile over this distance, pulses."""
        max_speed, acceleration = self._limits
        if math.isinf(max_speed):
            return 0
        if acceleration >= NO_RAMP:
            return RECTANGULAR
        return TRIANGULAR if distance * acceleration <= max_speed * max_speed * (1.0 + 1e-9) else TRAPEZOIDAL

    def moving_status(self, position: float) -> int:
        """Moving Status (123) at this position, pulses; Following Error is never set."""
        memory = self.memory
        if not memory["Torque Enable"] or memory["Operating Mode"] not in (POSITION_MODE, *EXTENDED_MODES):
            return 0
        arrived = IN_POSITION if abs(self._goal() - position) <= NEAR else 0
        ongoing = PROFILE_ONGOING if self._shape and abs(self._goal() - self.trajectory.position) > 0.5 else 0
        return arrived | ongoing | self._shape

    def advance_unloaded(self) -> None:
        """Advances the trajectory one step for a servo without load, which follows it exactly."""
        memory, top = self.memory, self.motor.model.top_speed * REV_PER_MINUTE
        max_speed, acceleration = self._limits
        acceleration = acceleration if acceleration < NO_RAMP else UNLOADED_ACCELERATION
        if memory["Bus Watchdog"] == TRIPPED:
            self.trajectory.step_to_velocity(0.0, UNLOADED_ACCELERATION)
        elif not memory["Torque Enable"]:
            self.trajectory.step_to_velocity(0.0, acceleration)
        elif memory["Operating Mode"] == VELOCITY_MODE:
            self.trajectory.step_to_velocity(max(-top, min(top, memory["Goal Velocity"] * VELOCITY_UNIT)), acceleration)
        elif memory["Operating Mode"] in (POSITION_MODE, *EXTENDED_MODES):
            self.trajectory.step_towards(self._goal(), min(top, max_speed), acceleration)
        else:
            self.trajectory.step_to_velocity(0.0, acceleration)  # current and PWM have no effect without mechanics

    def effort(self, position: float, velocity: float, volts: float) -> Effort:
        """Effort that the loop of the operating mode requests for one step, with torque on."""
        memory, mode = self.memory, self.memory["Operating Mode"]
        maximum = min(memory["PWM Limit"], abs(memory["Goal PWM"])) if mode != PWM_MODE else memory["PWM Limit"]
        tripped = memory["Bus Watchdog"] == TRIPPED
        if mode in (POSITION_MODE, *EXTENDED_MODES):
            pwm, damping = self._position_loop(position, velocity, maximum)
            if mode == CURRENT_BASED_POSITION_MODE:
                return self._limited_by_current(pwm, damping, velocity, volts, maximum)
        elif mode == VELOCITY_MODE:
            pwm, damping = self._velocity_loop(velocity, maximum)
        elif mode == CURRENT_MODE and not tripped:
            requested = Effort(self._torque_of(memory["Goal Current"]))
            effort = self.motor.by_torque(requested, velocity * RAD_PER_PULSE, volts * maximum / FULL_PWM)
            self._set_pwm(effort, velocity, volts)
            return effort
        else:
            pwm, damping = (0.0 if tripped else float(memory["Goal PWM"])), 0.0
        self.pwm = max(-maximum, min(maximum, pwm))
        if self.pwm != pwm:
            return self.motor.by_voltage(volts * self.pwm / FULL_PWM)
        at_rest = self.motor.by_voltage(volts * (pwm + damping * velocity) / FULL_PWM)
        return Effort(at_rest.torque, at_rest.damping + self._mechanical_damping(damping, volts))

    def _goal(self) -> float:
        return float(self.memory["Goal Position"] - self.memory.homing)

    def _position_loop(self, position: float, velocity: float, maximum: float) -> tuple[float, float]:
        """PWM, and its decrease per pulse per second of velocity."""
        memory, trajectory = self.memory, self.trajectory
        max_speed, acceleration = self._limits
        if math.isinf(max_speed) or memory["Bus Watchdog"] == TRIPPED:  # a step
            trajectory.reset(self._goal())
        else:
            trajectory.step_towards(self._goal(), max_speed, acceleration)
        error = trajectory.position - position
        integral_gain = memory["Position I Gain"] * POSITION_I
        self._integrate(error, integral_gain, maximum)
        damping = memory["Position D Gain"] * POSITION_D * STEP_S
        output = memory["Position P Gain"] * POSITION_P * error + integral_gain * self._integral
        return output + damping * (trajectory.velocity - velocity), damping

    def _velocity_loop(self, velocity: float, maximum: float) -> tuple[float, float]:
        memory = self.memory
        acceleration = NO_RAMP if memory["Bus Watchdog"] == TRIPPED else self._limits[1]
        self.trajectory.step_to_velocity(memory["Goal Velocity"] * VELOCITY_UNIT, acceleration)
        error = (self.trajectory.velocity - velocity) / VELOCITY_UNIT
        integral_gain = memory["Velocity I Gain"] * VELOCITY_I
        self._integrate(error, integral_gain, maximum)
        proportional = memory["Velocity P Gain"] * VELOCITY_P
        return proportional * error + integral_gain * self._integral, proportional / VELOCITY_UNIT

    def _integrate(self, error: float, gain: float, maximum: float) -> None:
        """Integrates the error, limited so that the output does not exceed its maximum (anti-windup)."""
        limit = maximum / gain if gain else 0.0
        self._integral = max(-limit, min(limit, self._integral + error))

    def _limited_by_current(self, pwm: float, damping: float, velocity: float, volts: float, pwm_limit: int) -> Effort:
        """Current-based position: Goal Current limits the current that the position loop requests."""
        maximum = abs(self._torque_of(self.memory["Goal Current"]))
        unlimited = self.motor.model.stall_torque * pwm / FULL_PWM
        torque = max(-maximum, min(maximum, unlimited))
        damped = self._mechanical_damping(damping, self.motor.model.voltage) if torque == unlimited else 0.0
        requested = Effort(torque + damped * velocity * RAD_PER_PULSE, damped)
        effort = self.motor.by_torque(requested, velocity * RAD_PER_PULSE, volts * pwm_limit / FULL_PWM)
        self._set_pwm(effort, velocity, volts)
        return effort

    def _torque_of(self, current: int) -> float:
        model = self.motor.model
        assert model.current_unit is not None, "models without a current register have no current modes"
        return current * model.current_unit / model.stall_amperes * model.stall_torque

    def _mechanical_damping(self, damping: float, volts: float) -> float:
        """Damping, N m s/rad, of a PWM that decreases by `damping` per pulse per second."""
        return self.motor.by_voltage(volts * damping / FULL_PWM).torque / RAD_PER_PULSE

    def _set_pwm(self, effort: Effort, velocity: float, volts: float) -> None:
        """Sets the output PWM to the value that produces this effort."""
        speed = velocity * RAD_PER_PULSE
        needed = effort.at(speed) + self.motor.back_emf_damping * speed
        full = self.motor.by_voltage(volts).torque
        self.pwm = FULL_PWM * needed / full if full else 0.0
