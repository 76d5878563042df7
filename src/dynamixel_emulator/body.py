"""Body of an emulated servo: motion, measurements and protective shutdown."""

from __future__ import annotations

import math
from enum import IntFlag

from dynamixel_emulator.errors import EmulatorError
from dynamixel_emulator.loops import PROFILE_ONGOING, STEP_S, VELOCITY_UNIT, Loops
from dynamixel_emulator.memory import CURRENT_MODE, PWM_MODE, TRIPPED, ServoMemory
from dynamixel_emulator.models import PULSES_PER_TURN, ServoModel
from dynamixel_emulator.motor import NO_EFFORT, RAD_PER_PULSE, Effort, Motor

HAND_SPEED = 1.0 / RAD_PER_PULSE
"""Pulses per second, 57 degrees: slow enough to watch."""
HAND_STIFFNESS, HAND_DAMPING = 30.0, 1.0
"""N m/rad and N m s/rad between hand and shaft; an estimate of a loose grip."""
MAX_HAND_TORQUE = 3.0
"""N m; 15 N at a lever of 20 cm. A servo with torque on yields to it only if its own torque is smaller."""
HAND_INTEGRAL_GAIN = 2.0
"""1/s; integral gain with which the hand corrects the position error due to weight."""
WATCHDOG_UNIT_S = 0.020
REVERSE = 0x01
"""Bit of Drive Mode (10)."""
OVERLOAD_FRACTION, OVERLOAD_S = 0.7, 2.0
"""Overload: more than this fraction of the stall torque for this time; assumed, the manual says "persistent load"."""


class HardwareError(IntFlag):
    """Bits of Hardware Error Status (70) and of Shutdown (63) (e-Manual, "Shutdown")."""

    VOLTAGE = 0x01
    OVERHEATING = 0x04
    ENCODER = 0x08
    SHOCK = 0x10
    OVERLOAD = 0x20


class ServoBody:
    """A servo. Alone it has no load and follows its trajectory exactly; a bus with mechanics moves it by torque.

    Args:
        model: Its model.
        position: Initial position, pulses.

    Attributes:
        model, memory: Its model and its control table.
        position, velocity: Pulses, without the homing offset, and pulses per second; signs as set by Drive Mode.
        voltage: Supply voltage, V.
        torque: N m at the shaft in the last step; sign as set by Drive Mode.
        blocked: Whether its shaft is mechanically blocked.
        hand: The hand that guides its shaft; None without one.
        powered: Whether it has power.
    """

    def __init__(self, model: ServoModel, position: float = 2048.0) -> None:
        self.model = model
        self.memory = ServoMemory(model)
        self.position, self.velocity = position, 0.0
        self.motor = Motor(model)
        self.loops = Loops(self.memory, self.motor)
        self.voltage, self.torque = model.voltage, 0.0
        self.blocked, self.powered = False, True
        self.hand: Hand | None = None
        self._shaft = position
        self._overloaded_s = 0.0
        self._now_s = self._received_s = self._booted_s = 0.0
        self._rebooting_until_s = -math.inf
        self._effort = NO_EFFORT
        self._reset_position()

    @property
    def listens(self) -> bool:
        """Whether it receives packets: not during a reboot or without power."""
        return self.powered and self._now_s >= self._rebooting_until_s

    @property
    def temperature(self) -> float:
        """Measured temperature, degrees Celsius."""
        return self.motor.temperature

    @temperature.setter
    def temperature(self, value: float) -> None:
        self.motor.temperature = value

    @property
    def has_torque(self) -> bool:
        """Whether its motor produces torque."""
        return bool(self.powered and self.memory["Torque Enable"])

    @property
    def is_shut_down(self) -> bool:
        """Whether an error enabled in Shutdown (63) keeps torque off until a reboot."""
        return bool(self.memory["Hardware Error Status"] & self.memory["Shutdown"])

    def packet_received(self, now_s: float) -> None:
        """Resets the bus watchdog: a packet to any servo arrived at this time, s."""
        self._received_s = now_s

    def fail(self, error: HardwareError) -> None:
        """Sets this error until a reboot, and switches torque off if Shutdown (63) enables it."""
        self.memory["Hardware Error Status"] |= int(error)
        if self.is_shut_down:
            self.memory["Torque Enable"] = 0

    def preset(self, name: str, value: int) -> None:
        """Sets a register as if before power-on; resets the position to within one turn.

        Raises:
            EmulatorError: There is no such register, or the value does not fit.
        """
        register = self.memory.register(name)
        bits = 8 * register.size - int(register.signed)
        if not (-(1 << bits) if register.signed else 0) <= value < 1 << bits:
            raise EmulatorError(f"{name} has {register.size} bytes, which cannot hold {value}")
        before = self._direction
        self.memory[name] = value
        self.position *= before * self._direction
        self._reset_position()

    def hold(self) -> None:
        """Switches torque on without a request, with the present position as goal."""
        self.loops.reset(self.position)
        self.memory["Goal Position"] = round(self.position) + self.memory.homing
        self.memory["Torque Enable"] = 1

    def _reset_position(self) -> None:
        """Reduces the position to within one turn, as after power-on, and resets the goals to it."""
        memory = self.memory
        self.position %= PULSES_PER_TURN
        self.loops.reset(self.position)
        self._present()
        memory["Goal Position"] = memory["Present Position"]
        memory["Goal PWM"] = 0 if memory["Operating Mode"] == PWM_MODE else memory["PWM Limit"]
        if "Goal Current" in memory:
            memory["Goal Current"] = 0 if memory["Operating Mode"] == CURRENT_MODE else memory["Current Limit"]

    def begin(self, now_s: float) -> None:
        """Sets the start time, s."""
        self._now_s = self._received_s = now_s

    def run_to(self, now_s: float) -> None:
        """Advances to this time, s, without load; ignores a time in the past."""
        while self._now_s + STEP_S <= now_s:
            self._tick()
            trajectory = self.loops.trajectory
            if self.blocked:
                trajectory.reset(self.position)
            elif self.hand is not None and not self.has_torque:
                trajectory.reset(self._direction * self.hand.next_position())
            else:
                self.loops.advance_unloaded()
            if self.memory["Bus Watchdog"] == TRIPPED and trajectory.velocity:
                self._stop_at_present_position()
            self.position, self.velocity = trajectory.position, trajectory.velocity
            self._shaft = self._direction * self.position
        self.present()

    def effort(self) -> Effort:
        """Starts a step: the effort of servo and hand in the direction of the encoder; `moved` ends the step."""
        self._tick()
        if not self.has_torque or not self.listens:
            self.loops.reset(self.position, self.velocity)
            self.loops.pwm, self._effort = 0.0, NO_EFFORT
        else:
            self._effort = self.loops.effort(self.position, self.velocity, self.voltage)
        torque, damping = self._direction * self._effort.torque, self._effort.damping
        if self.hand is None:
            return Effort(torque, damping)
        hand = self.hand.effort(self._shaft, self._direction * self.velocity)
        return Effort(torque + hand.torque, damping + hand.damping)

    def moved(self, shaft: float, velocity: float) -> None:
        """Ends a step: position of the shaft, pulses from the encoder zero, and velocity, pulses per second."""
        self.position += self._direction * (shaft - self._shaft)
        self.velocity, self._shaft = self._direction * velocity, shaft
        self.torque = self._effort.at(self.velocity * RAD_PER_PULSE)
        self.motor.update_temperature(self.torque, STEP_S)
        loaded = abs(self.torque) > OVERLOAD_FRACTION * self.model.stall_torque
        self._overloaded_s = max(0.0, self._overloaded_s + (STEP_S if loaded else -STEP_S))

    def lead(self, target: float) -> None:
        """A hand grips the shaft and guides it to this position, pulses from the encoder zero."""
        self.hand = Hand(self._shaft, target)

    def set_shaft(self, shaft: float) -> None:
        """Sets the initial position of the shaft, pulses from the encoder zero."""
        self._shaft, self.position = shaft, self._direction * shaft
        self._reset_position()

    def turned(self, position: float) -> None:
        """Someone has turned the shaft of a servo without load: it now rests at this position, pulses."""
        self.position, self.velocity = position, 0.0
        self.loops.reset(position)
        self.present()

    @property
    def _direction(self) -> int:
        return -1 if self.memory["Drive Mode"] & REVERSE else 1

    def _tick(self) -> None:
        """Advances the time one step; checks the bus watchdog, voltage, temperature and load."""
        self._now_s += STEP_S
        if not self.powered:
            return
        memory = self.memory
        timeout = memory["Bus Watchdog"]
        idle_s = self._now_s - self._received_s
        if 0 < timeout < TRIPPED and memory["Torque Enable"] and idle_s > timeout * WATCHDOG_UNIT_S:
            memory["Bus Watchdog"] = TRIPPED
            self.loops.reset(self.position, self.velocity)
            self._stop_at_present_position()
        if not memory["Min Voltage Limit"] <= round(10.0 * self.voltage) <= memory["Max Voltage Limit"]:
            self.fail(HardwareError.VOLTAGE)
        if self.temperature > memory["Temperature Limit"]:
            self.fail(HardwareError.OVERHEATING)
        if self._overloaded_s > OVERLOAD_S:
            self.fail(HardwareError.OVERLOAD)

    def _stop_at_present_position(self) -> None:
        """After a trip of the bus watchdog: sets the goal so that clearing the watchdog moves nothing; assumed."""
        self.memory["Goal Position"] = round(self.position) + self.memory.homing
        self.memory["Goal Velocity"] = 0

    def present(self) -> None:
        """Writes the measurements to the control table."""
        self.memory["Realtime Tick"] = int((self._now_s - self._booted_s) * 1000.0) % 32768
        self._present()

    def _present(self) -> None:
        memory, model, trajectory = self.memory, self.model, self.loops.trajectory
        memory["Present Position"] = round(self.position) + memory.homing
        memory["Present Velocity"] = round(self.velocity / VELOCITY_UNIT)
        memory["Position Trajectory"] = round(trajectory.position) + memory.homing
        memory["Velocity Trajectory"] = round(trajectory.velocity / VELOCITY_UNIT)
        memory["Moving Status"] = self.loops.moving_status(self.position)
        ongoing = bool(memory["Moving Status"] & PROFILE_ONGOING) and not self.blocked
        memory["Moving"] = int(ongoing or abs(self.velocity) > memory["Moving Threshold"] * VELOCITY_UNIT)
        memory["Present PWM"] = round(self.loops.pwm)
        if model.current_unit is None:
            memory["Present Load"] = round(1000.0 * self.torque / model.stall_torque)
        else:
            memory["Present Current"] = round(self.motor.amperes(self.torque) / model.current_unit)
        memory["Present Input Voltage"] = max(0, round(10.0 * self.voltage))
        memory["Present Temperature"] = round(self.temperature)


class Hand:
    """A hand that grips the shaft of a servo and guides it to a target. All in pulses of the shaft's encoder.

    Args:
        shaft: Position at which it grips.
        target: Position to which it guides the shaft and where it then holds it.
    """

    def __init__(self, shaft: float, target: float) -> None:
        self._position, self._target = shaft, target
        self._arrived = False

    def next_position(self) -> float:
        """Position after one millisecond of a shaft that does not resist."""
        self._position += self._step()
        return self._position

    def effort(self, shaft: float, velocity: float) -> Effort:
        """Effort during one millisecond at this position, pulses, and velocity, pulses per second, of the shaft."""
        before, max_offset = self._position, MAX_HAND_TORQUE / HAND_STIFFNESS / RAD_PER_PULSE
        step = HAND_INTEGRAL_GAIN * (self._target - shaft) * STEP_S if self._arrived else self._step()
        self._position = max(shaft - max_offset, min(shaft + max_offset, before + step))
        damped = HAND_DAMPING * RAD_PER_PULSE * (self._position - before) / STEP_S
        pull = HAND_STIFFNESS * RAD_PER_PULSE * (self._position - shaft) + damped
        torque = pull - HAND_DAMPING * RAD_PER_PULSE * velocity
        if abs(torque) > MAX_HAND_TORQUE:
            return Effort(math.copysign(MAX_HAND_TORQUE, torque))
        return Effort(pull, HAND_DAMPING)

    def _step(self) -> float:
        """Step towards the target, pulses; notes when the target is reached."""
        remaining = self._target - self._position
        self._arrived = abs(remaining) <= HAND_SPEED * STEP_S
        return remaining if self._arrived else math.copysign(HAND_SPEED * STEP_S, remaining)
