"""The servos of one arm: checked before they may hold, read at the loop's rate, watched, and let go one by one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from paramove.documents import Floats, InputError
from paramove.robots import INT16_RANGE
from paramove.robots.dynamixel.arm.servo_checks import (
    JointServo,
    arming_faults,
    bus_fault,
    hardware_fault,
    torque_fault,
    voltage_fault,
    watchdog_fault,
)
from paramove.robots.dynamixel.bus.position_watch import POSITION, PositionWatch
from paramove.robots.dynamixel.bus.servo_chain import Answered, ServoChain, ServoError
from paramove.robots.dynamixel.bus.servo_models import PULSES_PER_TURN
from paramove.robots.dynamixel.bus.servo_port import PortLostError
from paramove.robots.streaming import Frames
from paramove.safety import Fault

GAINS = ("Position P Gain", "Position I Gain", "Position D Gain")
WATCHDOG_UNIT_S, WATCHDOG_TRIPPED = 0.020, 0xFF
NOISE_FRACTION, NOISE_EXCHANGES = 0.2, 50
"""With more damaged exchanges than this, of about so many, the arm must not move."""
LOW_VOLTAGE_MARGIN = 0.10


@dataclass(frozen=True)
class Timeouts:
    """How long missing data and slow reads are accepted.

    Attributes:
        silent_s: By the loop, without data of a servo.
        watchdog_s: By a servo, without data on the bus; then it stops by itself. 0.02 to 2.54 s.
        read_s: For reading all servos once, also by the checks before arming; None: a period of the loop.
    """

    silent_s: float = 0.050
    watchdog_s: float = 0.100
    read_s: float | None = None

    def __post_init__(self) -> None:
        """Raises InputError for times that no loop or servo has."""
        if not 0.0 < self.silent_s < np.inf or not WATCHDOG_UNIT_S <= self.watchdog_s <= 127 * WATCHDOG_UNIT_S:
            raise InputError(
                f"silent_s is more than 0 and watchdog_s 0.02 to 2.54 s, found {self.silent_s} and {self.watchdog_s}"
            )


@dataclass(frozen=True, eq=False)
class ArmReading:
    """The latest data of the servos; arrays [J].

    Attributes:
        at_ns: When the latest reply came, by the port's clock.
        counts: Positions, pulses; there is no reading before all joints have replied.
        ages_s: Of each joint's latest reply.
    """

    at_ns: int
    counts: Frames
    ages_s: Floats


@dataclass
class ServoHealth:
    """State of a servo, read at 1 Hz; None before."""

    voltage: float | None = None
    temperature: int | None = None
    hardware_error: int = 0
    torque: bool | None = None
    answers: Answered | None = field(default=None, repr=False)


class ServoArm:
    """One arm on an open port.

    Args:
        servos: In the order of the robot's joint vector.
        chain: Of their bus.
        period_s: Of the loop that will read and command.
        timeouts: For servos and reads.
        watch: Of their positions so far; None: it begins now.

    All methods raise PortLostError when the port went away.
    """

    def __init__(
        self,
        servos: Sequence[JointServo],
        chain: ServoChain,
        period_s: float,
        timeouts: Timeouts | None = None,
        watch: PositionWatch | None = None,
    ) -> None:
        self.servos = tuple(servos)
        self.health = {servo.joint: ServoHealth() for servo in servos}
        self.holds = False
        self._chain, self._clock = chain, chain.port.clock
        self._period_s = period_s
        self._timeouts = timeouts or Timeouts()
        self._turns = [0 for _ in servos]
        self._numbers = [servo.number for servo in servos]
        self._registers = servos[0].model.registers  # those used here have one address in all models
        self.watch = watch or PositionWatch({servo.number: servo.model for servo in servos})
        self._noise_mark = (0, 0)
        self._noise = ""

    def check(self) -> tuple[Fault, ...]:
        """Everything that keeps the servos from being armed."""
        faults = arming_faults(self.servos, self._chain)
        if faults:
            return faults
        self.watch.jump = None
        fault = bus_fault(self.measured, self._timeouts.read_s or self._period_s, self._clock) or self._fault_of_jump()
        return tuple(one for one in (fault, self._fault_of_exchanged()) if one is not None)

    def take_hold(self) -> tuple[Fault, ...]:
        """Torque on at the present positions, then the bus watchdog. Nothing moves: the goal is the present position.

        Returns:
            Why it failed; then servos without torque before have none again.
        """
        faults, torque_off, turns = [], [], []
        for servo in self.servos:
            try:
                torque = bool(self._chain.read(servo.number, self._registers["Torque Enable"]))
                if not torque:
                    torque_off.append(servo)
                turns.append(servo.turns(self._hold(servo, torque)))
            except ServoError as error:
                faults.append(Fault("servo_refused", servo.joint, f"{servo.joint} cannot hold: {error}"))
        if faults:
            self._release(torque_off)
            return tuple(faults)
        self.holds, self._turns = True, turns
        for health in self.health.values():
            health.torque = True
        return ()

    def _hold(self, servo: JointServo, torque: bool) -> int:
        """The goal, which is the present position. Raises ServoError."""
        number, registers = servo.number, self._registers
        self._chain.write(number, registers["Bus Watchdog"], 0)  # a tripped one locks the goals
        goal = self._position(number, torque)
        self._chain.write(number, registers["Goal Position"], goal)
        if (read := self._chain.read(number, registers["Goal Position"])) != goal:
            raise ServoError(number, f"servo {number} has the goal {read}, expected {goal}: reboot it")
        profile = {"Profile Velocity": servo.profile_velocity, "Profile Acceleration": 0}
        for name, value in {**profile, **dict(zip(GAINS, servo.gains or (), strict=False))}.items():
            self._chain.write(number, registers[name], value)
        if servo.grip_current is not None:
            self._chain.write(number, servo.model.registers["Goal Current"], servo.grip_current)
        self._chain.write(number, registers["Torque Enable"], 1)
        if not self._chain.read(number, registers["Torque Enable"]):
            raise ServoError(number, f"servo {number} has no torque after it was switched on: reboot it")
        self._chain.write(number, registers["Bus Watchdog"], round(self._timeouts.watchdog_s / WATCHDOG_UNIT_S))
        return goal

    def _position(self, number: int, torque: bool) -> int:
        """Position of a servo, with the attempts of any read. Raises ServoError."""
        asked_ns = self._clock.now_ns
        position = self._chain.read(number, self._registers[POSITION])
        self.watch.jump = None
        if not self.watch.accepts(number, position, (asked_ns, self._clock.now_ns), torque=torque):
            raise ServoError(number, f"servo {number} {self.watch.jump}: check cable, plugs and supply, and arm again")
        return position

    def let_go(self, torque_off: bool) -> tuple[str, ...]:
        """End control of every servo, each on its own: watchdog off and, if requested, torque off.

        Returns:
            What failed, for people.
        """
        self.holds = False
        return self._release(self.servos) if torque_off else self._write_each(self.servos, {"Bus Watchdog": 0})

    def _release(self, servos: Iterable[JointServo]) -> tuple[str, ...]:
        return self._write_each(servos, {"Torque Enable": 0, "Bus Watchdog": 0})

    def _write_each(self, servos: Iterable[JointServo], values: dict[str, int]) -> tuple[str, ...]:
        failed = []
        for servo in servos:
            for name, value in values.items():
                try:
                    self._chain.write(servo.number, self._registers[name], value)
                except (ServoError, PortLostError) as error:
                    failed.append(f"{servo.joint}: {error}")
        return tuple(failed)

    def command(self, counts: Frames) -> None:
        """Goal positions of all joints, [J] pulses within their ranges, in one packet."""
        pairs = zip(self._numbers, counts, self._turns, strict=True)
        goals = {number: int(count) + PULSES_PER_TURN * turns for number, count, turns in pairs}
        self._chain.sync_write(self._registers["Goal Position"], goals)

    def measured(self) -> ArmReading | None:
        """Positions of the joints; None until all have replied once.

        A joint without a reply, or with a position that cannot be true, keeps its last one.
        """
        # One that has lost its torque has been rebooted, and may have begun in another turn.
        held = {one.number for one in self.servos if self.holds and self.health[one.joint].torque is not False}
        answers = self.watch.read(self._chain, held) if self._chain.has_room() else {}
        for servo in self.servos:
            if servo.number in answers:
                self.health[servo.joint].answers = answers[servo.number]
        latest = [one.answers for one in self.health.values()]
        known = [answer for answer in latest if answer is not None]
        if len(known) < len(latest):
            return None
        now_ns = self._clock.now_ns
        positions = [answer.values[POSITION] for answer in known]
        for joint, (servo, position) in enumerate(zip(self.servos, positions, strict=True)):
            if servo.number not in held:  # while it holds, they stay the same
                self._turns[joint] = servo.turns(position)
        counts = np.array(positions) - PULSES_PER_TURN * np.array(self._turns)
        return ArmReading(
            at_ns=max(answer.at_ns for answer in known),
            counts=np.clip(counts, *INT16_RANGE).astype(np.int16),
            ages_s=np.array([1e-9 * (now_ns - answer.at_ns) for answer in known]),
        )

    def fault_of_answers(self, reading: ArmReading) -> Fault | None:
        """A joint that jumped, joints without data for too long, or too many damaged exchanges."""
        if self.watch.jump is not None:
            return self._fault_of_jump()
        allowed_s = self._timeouts.silent_s
        missing = [self.servos[joint] for joint in np.flatnonzero(reading.ages_s > allowed_s)]
        if not missing:
            return self._fault_of_noise()
        names = "any servo" if len(missing) == len(self.servos) > 1 else ", ".join(map(str, missing))
        remedy = "its cable and its power" if len(missing) == 1 else "cables and the motors' power"
        age_ms = 1e3 * reading.ages_s[reading.ages_s > allowed_s].min()
        message = f"no data from {names} for {age_ms:.0f} ms, allowed {1e3 * allowed_s:.0f} ms: check {remedy}"
        return Fault("joint_silent", missing[0].joint if len(missing) == 1 else "", message)

    def _fault_of_jump(self) -> Fault | None:
        jump, self.watch.jump = self.watch.jump, None
        if jump is None:
            return None
        servo = self.servos[self._numbers.index(jump.number)]
        message = (
            f"{servo} {jump}; this reply is rejected: check cable, plugs and supply; two servos may have one "
            "ID, or another program talks on the bus"
        )
        return Fault("joint_jumped", servo.joint, message)

    def _fault_of_exchanged(self) -> Fault | None:
        exchanged = [servo for servo in self.servos if servo.number in self.watch.exchanged]
        if not exchanged:
            return None
        names = " and ".join(map(str, exchanged))
        message = (
            f"{names} have exchanged their positions while the arm was disarmed: were their IDs exchanged? Move one "
            "joint by hand and look which angle changes. Exchange them back; if they are right, start the driver again"
        )
        return Fault("servos_exchanged", exchanged[0].joint, message)

    def _fault_of_noise(self) -> Fault | None:
        counts = self._chain.counts
        exchanges, noisy = counts.exchanges - self._noise_mark[0], counts.noisy - self._noise_mark[1]
        if exchanges >= NOISE_EXCHANGES:
            self._noise_mark = (counts.exchanges, counts.noisy)
            self._noise = f"{noisy} of the last {exchanges}" if noisy > NOISE_FRACTION * exchanges else ""
        if not self._noise:
            return None
        message = (
            f"{self._noise} exchanges on the bus were damaged, allowed {NOISE_FRACTION:.0%}: check cable, plugs and "
            "supply; two servos may have one ID, or another program talks on the bus"
        )
        return Fault("bus_noise", "", message)

    def look_after(self) -> Fault | None:
        """Read torque and errors of all servos; the first fault of one that should hold."""
        fault = None
        for servo, health, (torque, error) in self._read_each("Torque Enable", "Hardware Error Status"):
            health.torque, health.hardware_error = bool(torque), error
            if error:
                fault = fault or hardware_fault(servo, error)
            elif self.holds and not torque:
                fault = fault or torque_fault(servo)
        return fault

    def look_after_supply(self) -> Fault | None:
        """Read voltage and temperature of all servos; a voltage outside of a model's limits is a fault."""
        fault = None
        for servo, health, (tenths, temperature) in self._read_each("Present Input Voltage", "Present Temperature"):
            health.voltage, health.temperature = 0.1 * tenths, temperature
            fault = fault or voltage_fault(servo, health.voltage, *servo.model.voltage_limits)
        return fault

    def look_after_watchdogs(self) -> Fault | None:
        """Read the bus watchdogs of all servos; one that has tripped takes no goal until the arm is armed again."""
        tripped = [servo for servo, _, (units,) in self._read_each("Bus Watchdog") if units == WATCHDOG_TRIPPED]
        return watchdog_fault(tripped[0], self._timeouts.watchdog_s) if tripped else None

    def _read_each(self, *names: str) -> Iterator[tuple[JointServo, ServoHealth, list[int]]]:
        """Of each servo that replies, its health so far and these registers.

        The loop does not wait for an arm that is not responding; it still sends goals.
        """
        if not self._chain.has_room():
            return
        answers = self._chain.sync_read(self._numbers, [self._registers[name] for name in names])
        for servo in self.servos:
            if servo.number in answers:
                values = answers[servo.number].values
                yield servo, self.health[servo.joint], [values[name] for name in names]

    def not_responding(self) -> str:
        """Message about the servos that have never replied; "" if all have."""
        missing = [servo for servo in self.servos if self.health[servo.joint].answers is None]
        if not missing or not self._chain.counts.exchanges:
            return ""
        names, rate = ", ".join(map(str, missing)), self._chain.port.baud_rate
        return (
            f"no answer yet from {names} at {rate} bit/s: check the motors' power, cables, IDs and baud rate; "
            "`paramove arm scan` looks for them, once this driver has ended"
        )

    def warnings(self) -> tuple[str, ...]:
        """Messages about values close to a fault."""
        messages = []
        for servo in self.servos:
            voltage, low = self.health[servo.joint].voltage, servo.model.voltage_limits[0]
            if voltage is not None and voltage < (1.0 + LOW_VOLTAGE_MARGIN) * low:
                messages.append(
                    f"{servo.joint} has {voltage:.1f} V, its limit is {low:.1f} V: charge or check the supply"
                )
        return tuple(messages)
