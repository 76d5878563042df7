"""The servos of one arm: checked before they may hold, read at the loop's rate, watched, and let go one by one."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Floats, InputError
from paramove.robots import INT16_RANGE
from paramove.robots.dynamixel.arm.servo_checks import (
    ENDS,
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
from paramove.safety import Fault

Counts = NDArray[np.int16]

GAINS = ("Position P Gain", "Position I Gain", "Position D Gain")
WATCHDOG_UNIT_S, WATCHDOG_TRIPPED = 0.020, 0xFF
NOISE_SHARE, NOISE_EXCHANGES = 0.2, 50
"""More exchanges with damaged bytes than this, of about so many, and the wire is not fit to move by."""
LOW_VOLTAGE_SHARE = 0.10


@dataclass(frozen=True)
class Timeouts:
    """How long silence and slowness are borne.

    Attributes:
        silent_s: By the loop, of a servo.
        watchdog_s: By a servo, of the bus; then it stops by itself. 0.02 to 2.54 s.
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
    """What the servos said last; arrays [J].

    Attributes:
        at_ns: When the latest answer came, of the monotonic clock.
        counts: Positions, pulses; of a joint that was never heard there is no reading at all.
        ages_s: Of each joint's latest answer.
    """

    at_ns: int
    counts: Counts
    ages_s: Floats


@dataclass
class ServoHealth:
    """What a servo said of itself at 1 Hz; None before."""

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

    All methods raise PortLostError when the port went away.
    """

    def __init__(
        self, servos: Sequence[JointServo], chain: ServoChain, period_s: float, timeouts: Timeouts | None = None
    ) -> None:
        self.servos = tuple(servos)
        self.health = {servo.joint: ServoHealth() for servo in servos}
        self.holds = False
        self._chain = chain
        self._period_s = period_s
        self._timeouts = timeouts or Timeouts()
        self._turns = [0 for _ in servos]
        self._numbers = [servo.number for servo in servos]
        self._registers = servos[0].model.registers  # those used here have one address in all models
        self._watch = PositionWatch({servo.number: servo.model for servo in servos})
        self._noise_mark = (0, 0)
        self._noise = ""

    def check(self) -> tuple[Fault, ...]:
        """Everything that keeps the servos from being armed."""
        faults = arming_faults(self.servos, self._chain)
        if faults:
            return faults
        self._watch.jump = None
        fault = bus_fault(self.measured, self._timeouts.read_s or self._period_s) or self._fault_of_jump()
        return () if fault is None else (fault,)

    def take_hold(self) -> tuple[Fault, ...]:
        """Torque on where the servos stand, then the bus watchdog. Nothing moves: the goal is the present position.

        Returns:
            Why it did not work; then what had no torque before has none again.
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
        self._chain.write(number, registers["Bus Watchdog"], 0)  # a tripped one keeps the goals locked
        goal = self._position(number, torque)
        self._chain.write(number, registers["Goal Position"], goal)
        if (found := self._chain.read(number, registers["Goal Position"])) != goal:
            raise ServoError(number, f"servo {number} was told the goal {goal} and has {found}: reboot it")
        fence = {"Profile Velocity": servo.profile_velocity, "Profile Acceleration": 0}
        for name, value in {**fence, **dict(zip(GAINS, servo.gains or (), strict=False))}.items():
            self._chain.write(number, registers[name], value)
        if servo.grip_current is not None:
            self._chain.write(number, servo.model.registers["Goal Current"], servo.grip_current)
        self._chain.write(number, registers["Torque Enable"], 1)
        if not self._chain.read(number, registers["Torque Enable"]):
            raise ServoError(number, f"servo {number} was told to hold and does not: reboot it")
        self._chain.write(number, registers["Bus Watchdog"], round(self._timeouts.watchdog_s / WATCHDOG_UNIT_S))
        return goal

    def _position(self, number: int, torque: bool) -> int:
        """Where a servo stands, as patiently as other numbers are read. Raises ServoError."""
        asked_ns = time.monotonic_ns()
        position = self._chain.read(number, self._registers[POSITION])
        self._watch.jump = None
        if not self._watch.accepts(number, position, (asked_ns, time.monotonic_ns()), torque=torque):
            raise ServoError(number, f"servo {number} {self._watch.jump}: check cable, plugs and supply, and arm again")
        return position

    def let_go(self, torque_off: bool) -> tuple[str, ...]:
        """The last word to every servo, each on its own: no watchdog any more and, if asked for, no torque.

        Returns:
            What did not work, in words.
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

    def command(self, counts: Counts) -> None:
        """Goal positions of all joints, [J] pulses within their ranges, in one packet."""
        pairs = zip(self._numbers, counts, self._turns, strict=True)
        goals = {number: int(count) + PULSES_PER_TURN * turns for number, count, turns in pairs}
        self._chain.sync_write(self._registers["Goal Position"], goals)

    def measured(self) -> ArmReading | None:
        """Where the joints are; None until all were heard once.

        One that does not answer, or with a position that cannot be true, keeps its last one.
        """
        # One that has lost its torque has been rebooted, and may have begun in another turn.
        held = {one.number for one in self.servos if self.holds and self.health[one.joint].torque is not False}
        answers = self._watch.read(self._chain, held) if self._chain.has_room() else {}
        for servo in self.servos:
            if servo.number in answers:
                self.health[servo.joint].answers = answers[servo.number]
        latest = [one.answers for one in self.health.values()]
        known = [answer for answer in latest if answer is not None]
        if len(known) < len(latest):
            return None
        now_ns = time.monotonic_ns()
        positions = [answer.values[POSITION] for answer in known]
        for joint, (servo, place) in enumerate(zip(self.servos, positions, strict=True)):
            if servo.number not in held:  # while it holds, they stay the same
                self._turns[joint] = servo.turns(place)
        counts = np.array(positions) - PULSES_PER_TURN * np.array(self._turns)
        return ArmReading(
            at_ns=max(answer.at_ns for answer in known),
            counts=np.clip(counts, *INT16_RANGE).astype(np.int16),
            ages_s=np.array([1e-9 * (now_ns - answer.at_ns) for answer in known]),
        )

    def fault_of_answers(self, reading: ArmReading) -> Fault | None:
        """A joint that jumped, joints that are silent for too long, or a wire that damages too much."""
        if self._watch.jump is not None:
            return self._fault_of_jump()
        allowed_s = self._timeouts.silent_s
        late = [self.servos[place] for place in np.flatnonzero(reading.ages_s > allowed_s)]
        if not late:
            return self._fault_of_noise()
        names = "any servo" if len(late) == len(self.servos) > 1 else ", ".join(map(str, late))
        remedy = "its cable and its power" if len(late) == 1 else "cables and the motors' power"
        silent_ms = 1e3 * reading.ages_s[reading.ages_s > allowed_s].min()
        sentence = (
            f"nothing was heard of {names} for {silent_ms:.0f} ms, allowed {1e3 * allowed_s:.0f} ms: check {remedy}"
        )
        return Fault("joint_silent", late[0].joint if len(late) == 1 else "", sentence)

    def _fault_of_jump(self) -> Fault | None:
        jump, self._watch.jump = self._watch.jump, None
        if jump is None:
            return None
        servo = self.servos[self._numbers.index(jump.number)]
        sentence = (
            f"{servo} {jump}, so that this reply is rejected: check cable, plugs and supply; two servos may have one "
            "ID, or another program talks on the bus"
        )
        return Fault("joint_jumped", servo.joint, sentence)

    def _fault_of_noise(self) -> Fault | None:
        counts = self._chain.counts
        exchanges, noisy = counts.exchanges - self._noise_mark[0], counts.noisy - self._noise_mark[1]
        if exchanges >= NOISE_EXCHANGES:
            self._noise_mark = (counts.exchanges, counts.noisy)
            self._noise = f"{noisy} of the last {exchanges}" if noisy > NOISE_SHARE * exchanges else ""
        if not self._noise:
            return None
        sentence = (
            f"{self._noise} exchanges on the bus were damaged, allowed {NOISE_SHARE:.0%}: check cable, plugs and "
            "supply; two servos may have one ID, or another program talks on the bus"
        )
        return Fault("bus_noise", "", sentence)

    def look_after(self) -> Fault | None:
        """Read torque and errors of all servos; the first thing that is wrong with one that should hold."""
        found = None
        for servo, health, (torque, error) in self._told("Torque Enable", "Hardware Error Status"):
            health.torque, health.hardware_error = bool(torque), error
            found = found or self._fault_of_health(servo, health)
        return found

    def look_after_supply(self) -> Fault | None:
        """Read voltage and temperature of all servos; a voltage outside of what a model allows is a fault."""
        found = None
        for servo, health, (tenths, temperature) in self._told("Present Input Voltage", "Present Temperature"):
            health.voltage, health.temperature = 0.1 * tenths, temperature
            low, high = (0.1 * servo.model.registers[f"{end} Voltage Limit"].initial for end in ENDS)
            found = found or voltage_fault(servo, health.voltage, low, high)
        return found

    def look_after_watchdogs(self) -> Fault | None:
        """Read the bus watchdogs of all servos; one that has tripped takes no goal until somebody arms again."""
        tripped = [servo for servo, _, (units,) in self._told("Bus Watchdog") if units == WATCHDOG_TRIPPED]
        return watchdog_fault(tripped[0], self._timeouts.watchdog_s) if tripped else None

    def _told(self, *names: str) -> Iterator[tuple[JointServo, ServoHealth, list[int]]]:
        """Of each servo that answers, its health so far and these registers."""
        answers = self._read(*names)
        for servo in self.servos:
            if servo.number in answers:
                values = answers[servo.number].values
                yield servo, self.health[servo.joint], [values[name] for name in names]

    def _read(self, *names: str) -> dict[int, Answered]:
        """Of the servos that answer. The loop does not wait for an arm that is silent; it goes on telling it goals."""
        if not self._chain.has_room():
            return {}
        return self._chain.sync_read(self._numbers, [self._registers[name] for name in names])

    def unheard(self) -> str:
        """Which servos have never answered, in words; "" if all have."""
        silent = [servo for servo in self.servos if self.health[servo.joint].answers is None]
        if not silent or not self._chain.counts.exchanges:
            return ""
        names, rate = ", ".join(map(str, silent)), self._chain.port.baud_rate
        return (
            f"no answer yet from {names} at {rate} bit/s: check the motors' power, cables, IDs and baud rate; "
            "`paramove arm scan` looks for them, once this driver has ended"
        )

    def warnings(self) -> tuple[str, ...]:
        """What is not yet a fault, in words."""
        said = []
        for servo in self.servos:
            voltage, low = self.health[servo.joint].voltage, 0.1 * servo.model.registers["Min Voltage Limit"].initial
            if voltage is not None and voltage < (1.0 + LOW_VOLTAGE_SHARE) * low:
                said.append(f"{servo.joint} has {voltage:.1f} V, its limit is {low:.1f} V: charge or check the supply")
        return tuple(said)

    def _fault_of_health(self, servo: JointServo, health: ServoHealth) -> Fault | None:
        if health.hardware_error:
            return hardware_fault(servo, health.hardware_error)
        if self.holds and not health.torque:
            return torque_fault(servo)
        return None
