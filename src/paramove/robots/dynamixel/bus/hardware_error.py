"""Hardware Error Status (70) in words, with what helps (ROBOTIS e-Manual, "Hardware Error Status")."""

from __future__ import annotations

from dataclasses import dataclass


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


def hardware_errors(status: int) -> tuple[HardwareError, ...]:
    """What the bits of the register stand for; unknown bits are named by their number."""
    bits = [bit for bit in range(8) if status >> bit & 1]
    unknown = "look for it in the servo's e-Manual"
    return tuple(HARDWARE_ERRORS.get(bit, HardwareError(f"unknown error, bit {bit}", unknown)) for bit in bits)


def error_text(status: int) -> str:
    """One line, "" without an error."""
    return ", ".join(one.words for one in hardware_errors(status))
