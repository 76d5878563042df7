"""Control loops of an emulated servo: from goals to a course, and from the course to the motor's effort.

After the e-Manual, "Position PID Gain", "Velocity PI Gain" and "Operating Mode". Gains of differences and sums are
taken per millisecond, which the manual does not tell. Feedforward gains do nothing.
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
"""Pulses per second squared, of a servo that carries nothing and has no profile; assumed."""
AT_ONCE = 1e9
"""Pulses per second squared of a course without Profile Acceleration."""
TIME_BASED = 0x04
"""Bit of Drive Mode (10)."""
IN_POSITION, PROFILE_ONGOING, RECTANGULAR, TRIANGULAR, TRAPEZOIDAL = 0x01, 0x02, 0x10, 0x20, 0x30
"""Bits of Moving Status (123) (e-Manual, "Moving Status")."""
NEAR = 20.0
"""Pulses from the goal that count as arrived; assumed."""
POSITION_P, POSITION_I, POSITION_D = 1 / 128, 1 / 65536, 1 / 16
VELOCITY_P, VELOCITY_I = 1 / 128, 1 / 65536


class Course:
    """Where the servo should be now, pulses, and how fast, pulses per second."""

    def __init__(self) -> None:
        self.position = self.velocity = 0.0

    def begin(self, position: float, velocity: float = 0.0) -> None:
        """From here."""
        self.position, self.velocity = position, velocity

    def toward(self, goal: float, fastest: float, acceleration: float) -> None:
        """One step on the way to the goal, not beyond it."""
        away = goal - self.position
        # The largest speed from which, after one more step with it, the servo can still brake in time.
        stopping = acceleration * (math.sqrt(STEP_S**2 + 2.0 * abs(away) / acceleration) - STEP_S)
        self.reach(math.copysign(min(fastest, stopping), away), acceleration)

    def reach(self, velocity: float, acceleration: float) -> None:
        """One step on the way to this velocity."""
        change = velocity - self.velocity
        self.velocity += math.copysign(min(abs(change), acceleration * STEP_S), change)
        self.position += self.velocity * STEP_S


class Loops:
    """Of one servo; positions and velocities are as it tells them, without the homing offset.

    Args:
        memory: Its goals, limits and gains.
        motor: What they drive.

    Attributes:
        course: The desired trajectory.
        pwm: Part of the voltage that was last put out, units of 1 / 885.
    """

    def __init__(self, memory: ServoMemory, motor: Motor) -> None:
        self.memory, self.motor = memory, motor
        self.course = Course()
        self.pwm = 0.0
        self._sum = 0.0
        self._limits = (math.inf, AT_ONCE)  # largest speed and acceleration of the course, pulses and s
        self._shape = 0

    def begin(self, position: float, velocity: float = 0.0) -> None:
        """Torque comes on, or the servo is told anew where it is."""
        self.course.begin(position, velocity)
        self._sum = 0.0

    def plan(self) -> None:
        """A new goal: its profile is made from the registers as they are now; later changes wait for the next goal."""
        velocity, acceleration = self.memory["Profile Velocity"], self.memory["Profile Acceleration"]
        if not velocity and self.memory["Operating Mode"] != VELOCITY_MODE:
            self._limits = math.inf, AT_ONCE  # a step
        elif self.memory["Drive Mode"] & TIME_BASED:
            self._limits = self._limits_by_time(1e-3 * velocity, 1e-3 * acceleration)
        else:
            self._limits = velocity * VELOCITY_UNIT or math.inf, acceleration * ACCELERATION_UNIT or AT_ONCE
        self._shape = self._shape_to(abs(self._goal() - self.course.position))

    def _limits_by_time(self, whole_s: float, gaining_s: float) -> tuple[float, float]:
        """Speed and acceleration with which the way to the goal takes so long, and gaining speed so much of it."""
        if self.memory["Operating Mode"] == VELOCITY_MODE:
            change = abs(self.memory["Goal Velocity"] * VELOCITY_UNIT - self.course.velocity)
            return math.inf, change / gaining_s if change and gaining_s else AT_ONCE
        gaining_s = min(gaining_s, whole_s / 2.0)
        speed = max(abs(self._goal() - self.course.position) / (whole_s - gaining_s), VELOCITY_UNIT)
        return speed, speed / gaining_s if gaining_s else AT_ONCE

    def _shape_to(self, way: float) -> int:
        """Bits of Moving Status (123) for the profile of a way, pulses."""
        fastest, acceleration = self._limits
        if math.isinf(fastest):
            return 0
        if acceleration >= AT_ONCE:
            return RECTANGULAR
        return TRIANGULAR if way * acceleration <= fastest * fastest * (1.0 + 1e-9) else TRAPEZOIDAL

    def moving_status(self, position: float) -> int:
        """Moving Status (123) of a servo that is there; Following Error is never told."""
        memory = self.memory
        if not memory["Torque Enable"] or memory["Operating Mode"] not in (POSITION_MODE, *EXTENDED_MODES):
            return 0
        arrived = IN_POSITION if abs(self._goal() - position) <= NEAR else 0
        ongoing = PROFILE_ONGOING if self._shape and abs(self._goal() - self.course.position) > 0.5 else 0
        return arrived | ongoing | self._shape

    def unloaded(self) -> None:
        """One step of the course of a servo that carries nothing and so follows it exactly."""
        memory, top = self.memory, self.motor.model.top_speed * REV_PER_MINUTE
        fastest, acceleration = self._limits
        acceleration = acceleration if acceleration < AT_ONCE else UNLOADED_ACCELERATION
        if memory["Bus Watchdog"] == TRIPPED:
            self.course.reach(0.0, UNLOADED_ACCELERATION)
        elif not memory["Torque Enable"]:
            self.course.reach(0.0, acceleration)
        elif memory["Operating Mode"] == VELOCITY_MODE:
            self.course.reach(max(-top, min(top, memory["Goal Velocity"] * VELOCITY_UNIT)), acceleration)
        elif memory["Operating Mode"] in (POSITION_MODE, *EXTENDED_MODES):
            self.course.toward(self._goal(), min(top, fastest), acceleration)
        else:
            self.course.reach(0.0, acceleration)  # current and PWM move what is carried

    def effort(self, position: float, velocity: float, volts: float) -> Effort:
        """For one step, with torque on: what the loop of the operating mode asks of the motor."""
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
            wanted = Effort(self._torque_of(memory["Goal Current"]))
            effort = self.motor.by_torque(wanted, velocity * RAD_PER_PULSE, volts * maximum / FULL_PWM)
            self._note(effort, velocity, volts)
            return effort
        else:
            pwm, damping = (0.0 if tripped else float(memory["Goal PWM"])), 0.0
        self.pwm = max(-maximum, min(maximum, pwm))
        if self.pwm != pwm:
            return self.motor.by_voltage(volts * self.pwm / FULL_PWM)
        at_rest = self.motor.by_voltage(volts * (pwm + damping * velocity) / FULL_PWM)
        return Effort(at_rest.torque, at_rest.damping + self._stalled_by(damping, volts))

    def _goal(self) -> float:
        return float(self.memory["Goal Position"] - self.memory.homing)

    def _position_loop(self, position: float, velocity: float, maximum: float) -> tuple[float, float]:
        """PWM, and how much of it each pulse per second takes away."""
        memory, course = self.memory, self.course
        fastest, acceleration = self._limits
        if math.isinf(fastest) or memory["Bus Watchdog"] == TRIPPED:  # a step
            course.begin(self._goal())
        else:
            course.toward(self._goal(), fastest, acceleration)
        error = course.position - position
        integral = memory["Position I Gain"] * POSITION_I
        self._sum_up(error, integral, maximum)
        damping = memory["Position D Gain"] * POSITION_D * STEP_S
        ahead = memory["Position P Gain"] * POSITION_P * error + integral * self._sum
        return ahead + damping * (course.velocity - velocity), damping

    def _velocity_loop(self, velocity: float, maximum: float) -> tuple[float, float]:
        memory = self.memory
        acceleration = AT_ONCE if memory["Bus Watchdog"] == TRIPPED else self._limits[1]
        self.course.reach(memory["Goal Velocity"] * VELOCITY_UNIT, acceleration)
        error = (self.course.velocity - velocity) / VELOCITY_UNIT
        integral = memory["Velocity I Gain"] * VELOCITY_I
        self._sum_up(error, integral, maximum)
        proportional = memory["Velocity P Gain"] * VELOCITY_P
        return proportional * error + integral * self._sum, proportional / VELOCITY_UNIT

    def _sum_up(self, error: float, gain: float, maximum: float) -> None:
        """Of the errors, no further than the output can follow."""
        far = maximum / gain if gain else 0.0
        self._sum = max(-far, min(far, self._sum + error))

    def _limited_by_current(self, pwm: float, damping: float, velocity: float, volts: float, pwm_limit: int) -> Effort:
        """Current-based position: the loop asks for a current, which Goal Current limits."""
        maximum = abs(self._torque_of(self.memory["Goal Current"]))
        asked = self.motor.model.stall_torque * pwm / FULL_PWM
        torque = max(-maximum, min(maximum, asked))
        damped = self._stalled_by(damping, self.motor.model.voltage) if torque == asked else 0.0
        wanted = Effort(torque + damped * velocity * RAD_PER_PULSE, damped)
        effort = self.motor.by_torque(wanted, velocity * RAD_PER_PULSE, volts * pwm_limit / FULL_PWM)
        self._note(effort, velocity, volts)
        return effort

    def _torque_of(self, current: int) -> float:
        model = self.motor.model
        assert model.current_unit is not None, "models without a current have no such modes"
        return current * model.current_unit / model.stall_amperes * model.stall_torque

    def _stalled_by(self, damping: float, volts: float) -> float:
        """N m s/rad of a PWM that falls so much with each pulse per second."""
        return self.motor.by_voltage(volts * damping / FULL_PWM).torque / RAD_PER_PULSE

    def _note(self, effort: Effort, velocity: float, volts: float) -> None:
        """PWM that drives the current."""
        turning = velocity * RAD_PER_PULSE
        needed = effort.at(turning) + self.motor.braking * turning
        full = self.motor.by_voltage(volts).torque
        self.pwm = FULL_PWM * needed / full if full else 0.0
