"""The body of an emulated servo: it moves, measures, and switches itself off when something is wrong."""

from __future__ import annotations

import math
from enum import IntFlag

from dynamixel_emulator.errors import EmulatorError
from dynamixel_emulator.loops import PROFILE_ONGOING, STEP_S, VELOCITY_UNIT, Loops
from dynamixel_emulator.memory import CURRENT_MODE, PWM_MODE, TRIPPED, ServoMemory
from dynamixel_emulator.models import PULSES_PER_TURN, ServoModel
from dynamixel_emulator.motor import LIMP, RAD_PER_PULSE, Effort, Motor

SPEED = 1.0 / RAD_PER_PULSE
"""Pulses per second, 57 degrees: slow enough to be watched."""
STIFFNESS, DAMPING = 30.0, 1.0
"""N m/rad and N m s/rad between hand and shaft; an estimate of a loose grip."""
STRONGEST = 3.0
"""N m; 15 N at a lever of 20 cm. A servo that holds gives way to it or not, as its torque says."""
KEENNESS = 2.0
"""1/s; so fast the hand makes up for what weight takes away from the place."""
WATCHDOG_UNIT_S = 0.020
REVERSE = 0x01
"""Bit of Drive Mode (10)."""
OVERLOAD_SHARE, OVERLOAD_S = 0.7, 2.0
"""A servo is overloaded with this part of the stall torque for so long: assumed, the manual says "persistent load"."""


class HardwareError(IntFlag):
    """Bits of Hardware Error Status (70) and of Shutdown (63) (e-Manual, "Shutdown")."""

    VOLTAGE = 0x01
    OVERHEATING = 0x04
    ENCODER = 0x08
    SHOCK = 0x10
    OVERLOAD = 0x20


class ServoBody:
    """A servo. By itself it carries nothing and follows its course exactly; a bus with mechanics moves it by torques.

    Args:
        model: Its kind.
        position: In which it stands, pulses.

    Attributes:
        model, memory: Its kind, and its control table.
        position, velocity: Pulses, without the homing offset, and pulses per second, as Drive Mode turns them.
        voltage: V that it gets.
        torque: N m at the shaft in the last step, in its own direction.
        blocked: Whether something holds its shaft.
        hand: That leads its shaft, None: there is none.
        powered: Whether its cable is plugged in.
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
        self._now_s = self._heard_s = self._booted_s = 0.0
        self._deaf_until_s = -math.inf
        self._effort = LIMP
        self._settle()

    @property
    def listens(self) -> bool:
        """Whether it hears anything: not while it reboots or has no power."""
        return self.powered and self._now_s >= self._deaf_until_s

    @property
    def temperature(self) -> float:
        """Degrees Celsius that it measures."""
        return self.motor.temperature

    @temperature.setter
    def temperature(self, value: float) -> None:
        self.motor.temperature = value

    @property
    def has_torque(self) -> bool:
        """Whether its motor does anything."""
        return bool(self.powered and self.memory["Torque Enable"])

    @property
    def is_shut_down(self) -> bool:
        """Whether an error that Shutdown (63) names has switched torque off, until a reboot."""
        return bool(self.memory["Hardware Error Status"] & self.memory["Shutdown"])

    def packet_received(self, now_s: float) -> None:
        """A packet is on the bus, for whomever; the servo has moved until then."""
        self._heard_s = now_s

    def fail(self, error: HardwareError) -> None:
        """The servo notices this error: it tells of it until a reboot, and goes limp if Shutdown (63) names it."""
        self.memory["Hardware Error Status"] |= int(error)
        if self.is_shut_down:
            self.memory["Torque Enable"] = 0

    def preset(self, name: str, value: int) -> None:
        """Its table holds this value as if it had before power came on; the servo stands anew, within one turn.

        Raises:
            EmulatorError: There is no such register, or the value does not fit into it.
        """
        register = self.memory.register(name)
        bits = 8 * register.size - int(register.signed)
        if not (-(1 << bits) if register.signed else 0) <= value < 1 << bits:
            raise EmulatorError(f"{name} has {register.size} bytes, which cannot hold {value}")
        before = self._direction
        self.memory[name] = value
        self.position *= before * self._direction
        self._settle()

    def hold(self) -> None:
        """Torque is on although nobody asked for it, and the goal is where the servo stands."""
        self.loops.begin(self.position)
        self.memory["Goal Position"] = round(self.position) + self.memory.homing
        self.memory["Torque Enable"] = 1

    def _settle(self) -> None:
        """Presents the position within one turn, as after switching on, and makes it the goal."""
        memory = self.memory
        self.position %= PULSES_PER_TURN
        self.loops.begin(self.position)
        self._present()
        memory["Goal Position"] = memory["Present Position"]
        memory["Goal PWM"] = 0 if memory["Operating Mode"] == PWM_MODE else memory["PWM Limit"]
        if "Goal Current" in memory:
            memory["Goal Current"] = 0 if memory["Operating Mode"] == CURRENT_MODE else memory["Current Limit"]

    def begin(self, now_s: float) -> None:
        """It is this time, s: nothing happened before."""
        self._now_s = self._heard_s = now_s

    def run_to(self, now_s: float) -> None:
        """Move until this time, s, carrying nothing; an earlier one than the last is passed over."""
        while self._now_s + STEP_S <= now_s:
            self._tick()
            course = self.loops.course
            if self.blocked:
                course.begin(self.position)
            elif self.hand is not None and not self.has_torque:
                course.begin(self._direction * self.hand.led())
            else:
                self.loops.unloaded()
            if self.memory["Bus Watchdog"] == TRIPPED and course.velocity:
                self._hold()
            self.position, self.velocity = course.position, course.velocity
            self._shaft = self._direction * self.position
        self.present()

    def effort(self) -> Effort:
        """Begins a step: what servo and hand do at the shaft, in the direction of the encoder; `moved` ends it."""
        self._tick()
        if not self.has_torque or not self.listens:
            self.loops.begin(self.position, self.velocity)
            self.loops.pwm, self._effort = 0.0, LIMP
        else:
            self._effort = self.loops.effort(self.position, self.velocity, self.voltage)
        torque, damping = self._direction * self._effort.torque, self._effort.damping
        if self.hand is None:
            return Effort(torque, damping)
        led = self.hand.effort(self._shaft, self._direction * self.velocity)
        return Effort(torque + led.torque, damping + led.damping)

    def moved(self, shaft: float, velocity: float) -> None:
        """Its shaft is there, pulses from the zero of the encoder, and turns so fast, pulses per second."""
        self.position += self._direction * (shaft - self._shaft)
        self.velocity, self._shaft = self._direction * velocity, shaft
        self.torque = self._effort.at(self.velocity * RAD_PER_PULSE)
        self.motor.warm(self.torque, STEP_S)
        loaded = abs(self.torque) > OVERLOAD_SHARE * self.model.stall_torque
        self._overloaded_s = max(0.0, self._overloaded_s + (STEP_S if loaded else -STEP_S))

    def lead(self, target: float) -> None:
        """A hand takes hold of its shaft and leads it there, pulses from the zero of the encoder."""
        self.hand = Hand(self._shaft, target)

    def stand(self, shaft: float) -> None:
        """Before any movement: the shaft is there, pulses from the zero of the encoder."""
        self._shaft, self.position = shaft, self._direction * shaft
        self._settle()

    def turned(self, position: float) -> None:
        """Somebody has turned the shaft of a servo that carries nothing: it is there, pulses, and stands."""
        self.position, self.velocity = position, 0.0
        self.loops.begin(position)
        self.present()

    @property
    def _direction(self) -> int:
        return -1 if self.memory["Drive Mode"] & REVERSE else 1

    def _tick(self) -> None:
        """The time goes on; the servo looks after itself and after whom it obeys."""
        self._now_s += STEP_S
        if not self.powered:
            return
        memory = self.memory
        allowed = memory["Bus Watchdog"]
        silent_s = self._now_s - self._heard_s
        if 0 < allowed < TRIPPED and memory["Torque Enable"] and silent_s > allowed * WATCHDOG_UNIT_S:
            memory["Bus Watchdog"] = TRIPPED
            self.loops.begin(self.position, self.velocity)
            self._hold()
        if not memory["Min Voltage Limit"] <= round(10.0 * self.voltage) <= memory["Max Voltage Limit"]:
            self.fail(HardwareError.VOLTAGE)
        if self.temperature > memory["Temperature Limit"]:
            self.fail(HardwareError.OVERHEATING)
        if self._overloaded_s > OVERLOAD_S:
            self.fail(HardwareError.OVERLOAD)

    def _hold(self) -> None:
        """The bus watchdog has tripped: the goal is where the servo is, so that clearing it moves nothing; assumed."""
        self.memory["Goal Position"] = round(self.position) + self.memory.homing
        self.memory["Goal Velocity"] = 0

    def present(self) -> None:
        """Writes what it measures to its table."""
        self.memory["Realtime Tick"] = int((self._now_s - self._booted_s) * 1000.0) % 32768
        self._present()

    def _present(self) -> None:
        memory, model, course = self.memory, self.model, self.loops.course
        memory["Present Position"] = round(self.position) + memory.homing
        memory["Present Velocity"] = round(self.velocity / VELOCITY_UNIT)
        memory["Position Trajectory"] = round(course.position) + memory.homing
        memory["Velocity Trajectory"] = round(course.velocity / VELOCITY_UNIT)
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
