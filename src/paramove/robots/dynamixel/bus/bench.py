"""How fast a bus is: times of reading all servos at once, the rates that it can hold, and errors by their kind."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from paramove.robots.dynamixel.bus.servo_chain import ServoChain
from paramove.robots.dynamixel.bus.servo_models import XL430_W250
from paramove.robots.dynamixel.bus.servo_port import BITS_PER_BYTE

RATES_HZ = (50, 100, 200, 250, 333, 500, 1000)
STATE = ("Present Velocity", "Present Position")
"""At the same addresses in all models of the X series."""
BUS_FRACTION = 0.8
"""Of a period that the bus may take: the rest is the program's."""
GOAL_BYTES, WRITE_BYTES = 5, 14
SLOW_TIMER_MS = 2
USB_SERIAL = Path("/sys/bus/usb-serial/devices")


@dataclass(frozen=True)
class BusBench:
    """What was measured.

    Attributes:
        baud_rate: bit/s. servos: How many were read.
        p50_ms, p99_ms, longest_ms: Of one read of all servos' velocities and positions, complete ones only; NaN
            without any.
        complete, rounds: Reads in which all replied, and all reads.
        errors: What went wrong, by kind.
        rates_hz: Those that the bus can hold for 99 of 100 cycles of reading and writing goals.
    """

    baud_rate: int
    servos: int
    p50_ms: float
    p99_ms: float
    longest_ms: float
    complete: int
    rounds: int
    errors: dict[str, int]
    rates_hz: tuple[int, ...]


def bench_bus(chain: ServoChain, numbers: Sequence[int], rounds: int) -> BusBench:
    """Read all of these servos so many times. Reads only. Raises PortLostError."""
    registers = [XL430_W250.registers[name] for name in STATE]
    before = asdict(chain.counts)
    times_ms = []
    for _ in range(rounds):
        began_ns = time.monotonic_ns()
        answers = chain.sync_read(numbers, registers)
        if len(answers) == len(numbers):
            times_ms.append(1e-6 * (time.monotonic_ns() - began_ns))
    after = asdict(chain.counts)
    errors = {kind: after[kind] - before[kind] for kind in ("missing", "damaged", "stray", "echoed")}
    p50, p99, longest = np.percentile(times_ms, [50, 99, 100]) if times_ms else [np.nan] * 3
    write_ms = 1e3 * (WRITE_BYTES + GOAL_BYTES * len(numbers)) * BITS_PER_BYTE / chain.port.baud_rate
    rates = held_rates(p99 + write_ms) if len(times_ms) == rounds else held_rates(np.nan)
    return BusBench(
        chain.port.baud_rate, len(numbers), float(p50), float(p99), float(longest), len(times_ms), rounds, errors, rates
    )


def held_rates(cycle_ms: float) -> tuple[int, ...]:
    """Of `RATES_HZ` those whose period such a cycle leaves room for; none for NaN."""
    return tuple(rate for rate in RATES_HZ if cycle_ms <= BUS_FRACTION * 1e3 / rate)


def latency_timer_ms(device: str, usb_serial: Path = USB_SERIAL) -> int | None:
    """For how long an adapter waits for more bytes before it hands over those it has; None if it is unknown."""
    try:
        return int((usb_serial / Path(device).name / "latency_timer").read_text(encoding="ascii"))
    except (OSError, ValueError):
        return None


def slow_timer(device: str, timer_ms: int) -> str:
    """What to do about an adapter that waits too long, "" if it does not."""
    if timer_ms <= SLOW_TIMER_MS:
        return ""
    file = USB_SERIAL / Path(device).name / "latency_timer"
    return (
        f"the adapter's latency timer is {timer_ms} ms, so each answer waits for it: echo 1 | sudo tee {file}; for "
        'good: ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", ATTR{latency_timer}="1" in '
        "/etc/udev/rules.d/99-latency.rules"
    )
