"""The servos of one arm: checked before they may hold, read at the loop's rate, watched, and let go one by one."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from paramove.robots.dynamixel.servo_chain import Answered, ServoChain, ServoError
from paramove.robots.dynamixel.servo_models import ServoModel
from paramove.robots.dynamixel.servo_port import PortLostError
from paramove.safety.gate_io import Fault

Counts = NDArray[np.int16]

POSITION_MODE, GRIP_MODE = 3, 5
OLDEST_FIRMWARE = 42
"""Bus Watchdog (98) is known from this version on (e-Manual, "Bus Watchdog")."""
WATCHDOG_UNIT_S = 0.020
NOISE_SHARE, NOISE_ANSWERS = 0.10, 200
"""More answers lost than this, of about so many, and the wire is not fit to move by."""
LOW_VOLTAGE_SHARE = 0.10
ROUND_TRIPS = 20
ENDS = ("Min", "Max")
HARDWARE_ERRORS = {
    0: ("input voltage", "check the power supply and its cable"),
    2: ("overheating", "let it cool down, and look for what it works against"),
    3: ("motor encoder", "reboot it; if that does not help it is worn out"),
    4: ("electrical shock", "check the power supply and the motor"),
    5: ("overload", "take the load away, then reboot it"),
}
"""By bit of Hardware Error Status (70): what it means, and the remedy."""


@dataclass(frozen=True)
class Patience:
    """How long silence is borne.

    Attributes:
        silent_s: By the loop, of a servo.
        watchdog_s: By a servo, of the bus; then it stops by itself. At most 2.54 s.
    """

    silent_s: float = 0.050
    watchdog_s: float = 0.100


@dataclass(frozen=True)
class ServoJoint:
    """One joint and its servo.

    Attributes:
        name: Of the joint.
        number: ID of the servo.
        model: Of the servo.
        homing_offset: That the servo must have, pulses.
        grip_current: Of a gripper that holds with a limited current, in the servo's units; None: position mode.
    """

    name: str
    number: int
    model: ServoModel
    homing_offset: int = 0
    grip_current: int | None = None

    @property
    def mode(self) -> int:
        """Operating Mode (11) that it must have."""
        return POSITION_MODE if self.grip_current is None else GRIP_MODE


@dataclass(frozen=True, eq=False)
class ArmReading:
    """What the servos said last; arrays [J].

    Attributes:
        at_ns: When the newest answer came, of the monotonic clock.
        counts: Positions, pulses; of a joint that was never heard there is no reading at all.
        ages_s: Of each joint's newest answer.
    """

    at_ns: int
    counts: Counts
    ages_s: NDArray[np.float64]


@dataclass
class JointHealth:
    """What a servo said of itself at 1 Hz; None before."""

    voltage: float | None = None
    temperature: int | None = None
    hardware_error: int = 0
    torque: bool | None = None
    answers: Answered | None = field(default=None, repr=False)


class ServoArm:
    """One arm on an open port.

    Args:
        joints: In the order of the robot's joint vector.
        chain: Of their bus.
        period_s: Of the loop that will read and command.
        patience: With silence.

    All methods raise PortLostError when the port went away.
    """

    def __init__(
        self, joints: Sequence[ServoJoint], chain: ServoChain, period_s: float, patience: Patience | None = None
    ) -> None:
        self.joints = tuple(joints)
        self.health = {joint.name: JointHealth() for joint in joints}
        self.holds = False
        self._chain = chain
        self._period_s = period_s
        self._patience = patience or Patience()
        self._numbers = [joint.number for joint in joints]
        self._registers = joints[0].model.registers  # those used here have one address in all models
        self._noise_mark = (0, 0)
        self._noisy = False

    def check(self) -> tuple[Fault, ...]:
        """Everything that keeps the servos from being armed."""
        faults = [fault for joint in self.joints for fault in self._faults_of(joint)]
        return tuple(faults) or self._faults_of_bus()

    def _faults_of(self, joint: ServoJoint) -> list[Fault]:
        pinged = self._chain.ping(joint.number) or self._chain.ping(joint.number)
        who = f"servo {joint.number} ({joint.name})"
        if pinged is None:
            sentence = f"{who} does not answer: check cable, power and ID; `paramove arm scan` looks for it"
            return [Fault("servo_missing", joint.name, sentence)]
        if pinged.model_number != joint.model.number:
            sentence = (
                f"{who} is of model {pinged.model_number}, expected {joint.model.number} ({joint.model.name}): "
                "is it another arm, or are two IDs exchanged?"
            )
            return [Fault("servo_model", joint.name, sentence)]
        if pinged.firmware < OLDEST_FIRMWARE:
            sentence = (
                f"{who} has firmware {pinged.firmware}, at least {OLDEST_FIRMWARE} is needed: update it with "
                "Dynamixel Wizard"
            )
            return [Fault("servo_firmware", joint.name, sentence)]
        try:
            return [*self._faults_of_settings(joint, who), *self._faults_of_state(joint, who)]
        except ServoError as error:
            return [Fault("servo_missing", joint.name, str(error))]

    def _faults_of_settings(self, joint: ServoJoint, who: str) -> Iterable[Fault]:
        wanted = {"Operating Mode": joint.mode, "Drive Mode": 0, "Homing Offset": joint.homing_offset}
        for name, value in wanted.items():
            found = self._chain.read(joint.number, self._registers[name])
            if found != value:
                sentence = f"{who} has {name} {found}, expected {value}: `paramove arm verify --write` sets it"
                yield Fault("servo_settings", joint.name, sentence)

    def _faults_of_state(self, joint: ServoJoint, who: str) -> Iterable[Fault]:
        error = self._chain.read(joint.number, self._registers["Hardware Error Status"])
        if error:
            yield self._hardware_fault(joint, error)
        voltage = 0.1 * self._chain.read(joint.number, self._registers["Present Input Voltage"])
        low, high = (0.1 * self._chain.read(joint.number, self._registers[f"{end} Voltage Limit"]) for end in ENDS)
        if not low <= voltage <= high:
            yield _voltage_fault(joint, voltage, low, high)
        temperature = self._chain.read(joint.number, self._registers["Present Temperature"])
        limit = self._chain.read(joint.number, self._registers["Temperature Limit"])
        if temperature >= limit:
            sentence = f"{who} has {temperature} degrees Celsius, allowed {limit}: let it cool down"
            yield Fault("servo_hot", joint.name, sentence)

    def _faults_of_bus(self) -> tuple[Fault, ...]:
        """Whether the bus can be read as often as the loop wants to."""
        times_s = []
        for _ in range(ROUND_TRIPS):
            begun_s = time.monotonic()
            self.measured()
            times_s.append(time.monotonic() - begun_s)
        median_s = float(np.median(times_s))
        if median_s <= self._period_s:
            return ()
        sentence = (
            f"reading the servos takes {1e3 * median_s:.1f} ms, allowed {1e3 * self._period_s:.1f} ms: raise the baud "
            "rate, or set the adapter's latency timer to 1 ms (`paramove doctor` tells how)"
        )
        return (Fault("bus_slow", "", sentence),)

    def take_hold(self) -> tuple[Fault, ...]:
        """Torque on where the servos stand, then the bus watchdog. Nothing moves: the goal is the present position.

        Returns:
            Why it did not work; then what had no torque before has none again.
        """
        faults, limp = [], []
        for joint in self.joints:
            try:
                if not self._chain.read(joint.number, self._registers["Torque Enable"]):
                    limp.append(joint)
                self._hold(joint)
            except ServoError as error:
                faults.append(Fault("servo_refused", joint.name, f"{joint.name} cannot hold: {error}"))
        if faults:
            self._release(limp)
            return tuple(faults)
        self.holds = True
        return ()

    def _hold(self, joint: ServoJoint) -> None:
        number, registers = joint.number, self._registers
        self._chain.write(number, registers["Bus Watchdog"], 0)  # a tripped one keeps the goals locked
        goal = self._chain.read(number, registers["Present Position"])
        self._chain.write(number, registers["Goal Position"], goal)
        if (found := self._chain.read(number, registers["Goal Position"])) != goal:
            raise ServoError(number, f"servo {number} was told the goal {goal} and has {found}: reboot it")
        if joint.grip_current is not None:
            self._chain.write(number, joint.model.registers["Goal Current"], joint.grip_current)
        self._chain.write(number, registers["Torque Enable"], 1)
        if not self._chain.read(number, registers["Torque Enable"]):
            raise ServoError(number, f"servo {number} was told to hold and does not: reboot it")
        self._chain.write(number, registers["Bus Watchdog"], round(self._patience.watchdog_s / WATCHDOG_UNIT_S))

    def let_go(self, torque_off: bool) -> tuple[str, ...]:
        """The last word to every servo, each on its own: no watchdog any more and, if asked for, no torque.

        Returns:
            What did not work, in words.
        """
        self.holds = False
        return self._release(self.joints) if torque_off else self._watch_no_more()

    def _release(self, joints: Iterable[ServoJoint]) -> tuple[str, ...]:
        return self._write_each(joints, {"Torque Enable": 0, "Bus Watchdog": 0})

    def _watch_no_more(self) -> tuple[str, ...]:
        return self._write_each(self.joints, {"Bus Watchdog": 0})

    def _write_each(self, joints: Iterable[ServoJoint], values: dict[str, int]) -> tuple[str, ...]:
        failed = []
        for joint in joints:
            for name, value in values.items():
                try:
                    self._chain.write(joint.number, self._registers[name], value)
                except (ServoError, PortLostError) as error:
                    failed.append(f"{joint.name}: {error}")
        return tuple(failed)

    def command(self, counts: Counts) -> None:
        """Goal positions of all joints, [J] pulses, in one packet."""
        goals = {number: int(count) for number, count in zip(self._numbers, counts, strict=True)}
        self._chain.sync_write(self._registers["Goal Position"], goals)

    def measured(self) -> ArmReading | None:
        """Where the joints are; None until all were heard once. One that does not answer keeps its last position."""
        names = ("Realtime Tick", "Present Velocity", "Present Position")
        answers = self._chain.sync_read(self._numbers, [self._registers[name] for name in names])
        for joint in self.joints:
            if joint.number in answers:
                self.health[joint.name].answers = answers[joint.number]
        newest = [one.answers for one in self.health.values()]
        known = [answer for answer in newest if answer is not None]
        if len(known) < len(newest):
            return None
        now_ns = time.monotonic_ns()
        return ArmReading(
            at_ns=max(answer.at_ns for answer in known),
            counts=np.array([answer.values["Present Position"] for answer in known], dtype=np.int16),
            ages_s=np.array([1e-9 * (now_ns - answer.at_ns) for answer in known]),
        )

    def fault_of_answers(self, reading: ArmReading) -> Fault | None:
        """A joint that is silent for too long, has an alert, or a wire that loses too much."""
        late, allowed_s = int(np.argmax(reading.ages_s)), self._patience.silent_s
        if reading.ages_s[late] > allowed_s:
            joint = self.joints[late]
            sentence = (
                f"servo {joint.number} ({joint.name}) was last heard {1e3 * reading.ages_s[late]:.0f} ms ago, allowed "
                f"{1e3 * allowed_s:.0f} ms: check its cable and its power"
            )
            return Fault("joint_silent", joint.name, sentence)
        return self._fault_of_noise()

    def _fault_of_noise(self) -> Fault | None:
        counts = self._chain.counts
        asked, missing = counts.asked - self._noise_mark[0], counts.missing - self._noise_mark[1]
        if asked >= NOISE_ANSWERS:
            self._noise_mark = (counts.asked, counts.missing)
            self._noisy = missing > NOISE_SHARE * asked
        if not self._noisy:
            return None
        sentence = (
            f"more than {NOISE_SHARE:.0%} of the servos' answers are lost or damaged ({counts.damaged} damaged since "
            "the start): check cable, plugs and supply; two servos may have one ID"
        )
        return Fault("bus_noise", "", sentence)

    def look_after(self) -> Fault | None:
        """Read torque and errors of all servos; the first thing that is wrong with one that should hold."""
        names = ("Torque Enable", "Hardware Error Status")
        answers = self._chain.sync_read(self._numbers, [self._registers[name] for name in names])
        found = None
        for joint in self.joints:
            if (answer := answers.get(joint.number)) is None:
                continue
            health = self.health[joint.name]
            health.torque = bool(answer.values["Torque Enable"])
            health.hardware_error = answer.values["Hardware Error Status"]
            found = found or self._fault_of_health(joint, health)
        return found

    def look_after_supply(self) -> Fault | None:
        """Read voltage and temperature of all servos; a voltage outside of what a model allows is a fault."""
        names = ("Present Input Voltage", "Present Temperature")
        answers = self._chain.sync_read(self._numbers, [self._registers[name] for name in names])
        found = None
        for joint in self.joints:
            if (answer := answers.get(joint.number)) is None:
                continue
            health = self.health[joint.name]
            health.voltage = 0.1 * answer.values["Present Input Voltage"]
            health.temperature = answer.values["Present Temperature"]
            low, high = (0.1 * joint.model.registers[f"{end} Voltage Limit"].initial for end in ENDS)
            if not low <= health.voltage <= high:
                found = found or _voltage_fault(joint, health.voltage, low, high)
        return found

    def warnings(self) -> tuple[str, ...]:
        """What is not yet a fault, in words."""
        said = []
        for joint in self.joints:
            voltage, low = self.health[joint.name].voltage, 0.1 * joint.model.registers["Min Voltage Limit"].initial
            if voltage is not None and voltage < (1.0 + LOW_VOLTAGE_SHARE) * low:
                said.append(f"{joint.name} has {voltage:.1f} V, its limit is {low:.1f} V: charge or check the supply")
        return tuple(said)

    def _fault_of_health(self, joint: ServoJoint, health: JointHealth) -> Fault | None:
        if health.hardware_error:
            return self._hardware_fault(joint, health.hardware_error)
        if self.holds and not health.torque:
            sentence = (
                f"servo {joint.number} ({joint.name}) has lost its torque: it was switched off, lost power or was "
                "rebooted; the arm must be armed again"
            )
            return Fault("torque_lost", joint.name, sentence)
        return None

    def _hardware_fault(self, joint: ServoJoint, error: int) -> Fault:
        known = [text for bit, text in HARDWARE_ERRORS.items() if error & 1 << bit]
        what = " and ".join(name for name, _ in known) or "unknown"
        remedy = "; ".join(remedy for _, remedy in known) or "reboot it"
        sentence = (
            f"servo {joint.number} ({joint.name}) has a hardware error: {what} (register 70 is 0x{error:02x}); "
            f"{remedy} (`paramove arm reboot {joint.number}`)"
        )
        return Fault("hardware_error", joint.name, sentence)


def _voltage_fault(joint: ServoJoint, voltage: float, low: float, high: float) -> Fault:
    sentence = (
        f"servo {joint.number} ({joint.name}) has {voltage:.1f} V, allowed {low:.1f} to {high:.1f} V: check the power "
        "supply and its cable"
    )
    return Fault("servo_voltage", joint.name, sentence)
