"""Hardware errors in words, with what helps, and the reboot of one servo, which clears them.

Of Hardware Error Status (70) (ROBOTIS e-Manual, "Hardware Error Status"). A reboot leaves the other servos as they are.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

from paramove.documents import InputError
from paramove.robots.dynamixel.bus.scan import DetectedServo, looked_at
from paramove.robots.dynamixel.bus.servo_chain import ServoChain, ServoTimeoutError

TIMEOUT_S = 3.0
LOADED_FRACTION = 0.05
"""Of the maximum load or current: more is a joint that carries something."""
FULL_LOAD = 1000
"""Present Load (126) in units of 0.1 %."""


@dataclass(frozen=True)
class HardwareError:
    """One bit of the register.

    Attributes:
        words: What happened.
        remedy: What to do before the servo is rebooted.
    """

    words: str
    remedy: str


HARDWARE_ERRORS = {
    0: HardwareError("input voltage out of its limits", "check the power supply and the cables' plugs"),
    1: HardwareError("hall sensor of the motor failed", "the servo must be repaired"),
    2: HardwareError("overheated", "let it cool, and give it less to carry or more pauses"),
    3: HardwareError("motor encoder failed", "the servo must be repaired"),
    4: HardwareError("electrical shock, or too little power to the motor", "check the power supply; then the servo"),
    5: HardwareError("overloaded", "take the load off; look for what blocked the joint"),
}
"""By the number of the bit; bit 1 of the P series only."""


class ServoLoadedError(InputError):
    """The servo holds its joint, which would fall when it reboots."""


def hardware_errors(status: int) -> tuple[HardwareError, ...]:
    """What the bits of the register stand for; unknown bits are named by their number."""
    bits = [bit for bit in range(8) if status >> bit & 1]
    unknown = "look for it in the servo's e-Manual"
    return tuple(HARDWARE_ERRORS.get(bit, HardwareError(f"unknown error, bit {bit}", unknown)) for bit in bits)


def error_text(status: int) -> str:
    """One line, "" without an error."""
    return ", ".join(one.words for one in hardware_errors(status))


def servo_before_reboot(chain: ServoChain, number: int) -> DetectedServo:
    """The servo as it is. Raises ServoTimeoutError if it does not answer."""
    pinged = chain.ping(number)
    if pinged is None:
        raise ServoTimeoutError(
            number, f"servo {number} does not answer; `paramove arm scan` lists the servos of the bus"
        )
    return looked_at(chain, pinged)


def reboot_messages(servo: DetectedServo) -> list[str]:
    """Its hardware errors in words, each with what helps."""
    if servo.hardware_error is None:
        return [f"servo {servo.number}: its hardware error cannot be read"]
    errors = hardware_errors(servo.hardware_error)
    messages = [f"servo {servo.number}: {one.words}; {one.remedy}" for one in errors]
    return messages or [f"servo {servo.number}: no hardware error"]


def check_unloaded(chain: ServoChain, servo: DetectedServo) -> None:
    """Raises ServoLoadedError while the servo holds something up, and ServoError."""
    model = servo.table
    if model is None or not servo.torque:
        return
    if "Present Load" in model.registers:
        load = abs(chain.read(servo.number, model.registers["Present Load"])) / FULL_LOAD
    else:
        maximum = chain.read(servo.number, model.registers["Current Limit"])
        load = abs(chain.read(servo.number, model.registers["Present Current"])) / max(maximum, 1)
    if load > LOADED_FRACTION:
        raise ServoLoadedError(
            f"servo {servo.number} holds its joint with {100.0 * load:.0f} % of its force and would drop it: hold the "
            "arm and add --yes"
        )


def reboot_servo(chain: ServoChain, number: int, timeout_s: float = TIMEOUT_S) -> DetectedServo:
    """Reboot it and wait until it answers again: torque off, errors cleared. Raises ServoError."""
    chain.reboot(number)
    end_s = time.monotonic() + timeout_s
    while time.monotonic() < end_s:
        pinged = chain.ping(number, retry=False)
        if pinged is not None:
            return looked_at(chain, pinged)
    raise ServoTimeoutError(number, f"servo {number} does not answer {timeout_s:g} s after its reboot: check its power")
