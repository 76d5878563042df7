"""Checks of an arm's servos before arming and in motion, with faults for the gate."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from paramove.robots.dynamixel.bus.clock import Clock
from paramove.robots.dynamixel.bus.servo_chain import ServoChain, ServoError
from paramove.robots.dynamixel.bus.servo_models import CURRENT_BASED_MODE, POSITION_MODE, PULSES_PER_TURN, ServoModel
from paramove.robots.dynamixel.bus.servo_reboot import hardware_errors
from paramove.robots.dynamixel.calibration.arm_calibration import JointCalibration
from paramove.safety import Fault

OLDEST_FIRMWARE = 42
"""Bus Watchdog (98) is known from this version on (e-Manual, "Bus Watchdog")."""
VELOCITY_UNIT = 0.229 * 2.0 * math.pi / 60.0
"""rad/s of one unit, 0.229 rev/min (e-Manual, "Profile Velocity")."""
ROUND_TRIPS = 20
ENDED = "once this driver has ended,"
"""One program uses the adapter at a time."""


@dataclass(frozen=True)
class JointServo:
    """One joint's servo.

    Attributes:
        joint: Name of the joint.
        number: ID of the servo.
        model: Of the servo.
        calibration: Of the joint; None: it has the factory settings, and counts within one turn.
        grip_current: Of a gripper that holds with a limited current, in the servo's units; None: position mode.
        gains: P, I and D of the servo's position loop, in its units; None: those that it has.
        velocity: That the servo never exceeds, whatever its goal, rad/s; None: its maximum.
    """

    joint: str
    number: int
    model: ServoModel
    calibration: JointCalibration | None = None
    grip_current: int | None = None
    gains: tuple[int, int, int] | None = None
    velocity: float | None = None

    @property
    def mode(self) -> int:
        """Operating Mode (11) that it must have."""
        if self.grip_current is not None:
            return CURRENT_BASED_MODE
        return POSITION_MODE if self.calibration is None else self.calibration.operating_mode

    @property
    def profile_velocity(self) -> int:
        """Profile Velocity (112) that it must have; 0 for none."""
        return 0 if self.velocity is None else math.ceil(self.velocity / VELOCITY_UNIT)

    @property
    def position_limits(self) -> dict[str, int]:
        """Position limits that a calibrated joint must have; in other modes a servo ignores them."""
        if self.calibration is None or self.mode != POSITION_MODE:
            return {}
        return {"Min Position Limit": self.calibration.min_counts, "Max Position Limit": self.calibration.max_counts}

    def turns(self, position: int) -> int:
        """Whole turns by which a servo that presents this position is beyond the counts of the joint's range."""
        if self.mode == POSITION_MODE:
            return 0
        return position // PULSES_PER_TURN if self.calibration is None else self.calibration.turns(position)

    def __str__(self) -> str:
        return f"servo {self.number} ({self.joint})"


def arming_faults(servos: Sequence[JointServo], chain: ServoChain) -> tuple[Fault, ...]:
    """Everything about the servos themselves that keeps them from being armed. Raises PortLostError."""
    return tuple(fault for servo in servos for fault in _faults_of(servo, chain))


def bus_fault(read_all: Callable[[], object], period_s: float, clock: Clock) -> Fault | None:
    """Whether all servos can be read once in every period of the loop."""
    times_s = []
    for _ in range(ROUND_TRIPS):
        begun_ns = clock.now_ns
        read_all()
        times_s.append(1e-9 * (clock.now_ns - begun_ns))
    median_s = float(np.median(times_s))
    if median_s <= period_s:
        return None
    message = (
        f"reading the servos takes {1e3 * median_s:.1f} ms, allowed {1e3 * period_s:.1f} ms: raise the baud rate, or "
        "set the adapter's latency timer to 1 ms (`paramove doctor` prints the command)"
    )
    return Fault("bus_slow", "", message)


def hardware_fault(servo: JointServo, error: int) -> Fault:
    """Of Hardware Error Status (70)."""
    known = hardware_errors(error)
    message = (
        f"{servo} has a hardware error: {' and '.join(one.words for one in known)} (register 70 is 0x{error:02x}); "
        f"{'; '.join(one.remedy for one in known)}; then, {ENDED} `paramove arm reboot {servo.number}`"
    )
    return Fault("hardware_error", servo.joint, message)


def voltage_fault(servo: JointServo, voltage: float, low: float, high: float) -> Fault | None:
    """Of Present Input Voltage (144), V, and its limits."""
    if low <= voltage <= high:
        return None
    message = f"{servo} has {voltage:.1f} V, allowed {low:.1f} to {high:.1f} V: check the power supply and its cable"
    return Fault("servo_voltage", servo.joint, message)


def torque_fault(servo: JointServo) -> Fault:
    """Of Torque Enable (64) that is 0 though the servo should hold."""
    message = (
        f"{servo} has lost its torque: it was switched off, lost power or was rebooted; the arm must be armed again"
    )
    return Fault("torque_lost", servo.joint, message)


def watchdog_fault(servo: JointServo, watchdog_s: float) -> Fault:
    """Of Bus Watchdog (98) that has tripped: until it is cleared the servo takes no goal."""
    message = (
        f"{servo} has stopped by itself, without data for {1e3 * watchdog_s:.0f} ms: this computer was too busy, or a "
        "cable was loose; arm again, which clears its watchdog"
    )
    return Fault("watchdog_tripped", servo.joint, message)


def _faults_of(servo: JointServo, chain: ServoChain) -> list[Fault]:
    pinged = chain.ping(servo.number)
    if pinged is None:
        message = f"{servo} does not answer: check cable, power and ID; {ENDED} `paramove arm scan` looks for it"
        return [Fault("servo_missing", servo.joint, message)]
    if pinged.model_number != servo.model.number:
        message = (
            f"{servo} is of model {pinged.model_number}, expected {servo.model.number} ({servo.model.name}): is it "
            "another arm, or are two IDs exchanged?"
        )
        return [Fault("servo_model", servo.joint, message)]
    if pinged.firmware < OLDEST_FIRMWARE:
        message = (
            f"{servo} has firmware {pinged.firmware}, at least {OLDEST_FIRMWARE} is needed: update it with Dynamixel "
            "Wizard"
        )
        return [Fault("servo_firmware", servo.joint, message)]
    try:
        return [*_faults_of_settings(servo, chain), *_faults_of_state(servo, chain)]
    except ServoError as error:
        return [Fault("servo_missing", servo.joint, str(error))]


def _faults_of_settings(servo: JointServo, chain: ServoChain) -> Iterable[Fault]:
    expected = {
        "Operating Mode": servo.mode,
        "Drive Mode": 0,
        "Homing Offset": 0,
        **servo.position_limits,
    }
    for name, value in expected.items():
        found = chain.read(servo.number, servo.model.registers[name])
        if found != value:
            message = f"{servo} has {name} {found}, expected {value}: {ENDED} `paramove arm verify --write` sets it"
            if name in servo.position_limits:
                message += ", `--adopt` copies it into the calibration"
            yield Fault("servo_settings", servo.joint, message)


def _faults_of_state(servo: JointServo, chain: ServoChain) -> Iterable[Fault]:
    def read(name: str) -> int:
        return chain.read(servo.number, servo.model.registers[name])

    if error := read("Hardware Error Status"):
        yield hardware_fault(servo, error)
    low, high = 0.1 * read("Min Voltage Limit"), 0.1 * read("Max Voltage Limit")
    if fault := voltage_fault(servo, 0.1 * read("Present Input Voltage"), low, high):
        yield fault
    temperature, limit = read("Present Temperature"), read("Temperature Limit")
    if temperature >= limit:
        message = f"{servo} has {temperature} degrees Celsius, allowed {limit}: let it cool down"
        yield Fault("servo_hot", servo.joint, message)
