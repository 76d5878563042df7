"""Gives a servo its ID and baud rate: one servo on the bus at a time, everything read back."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence

from paramove.documents import InputError
from paramove.robots.dynamixel.bus.scan import ALL_IDS, USUAL_BAUD_RATES, DetectedServo, listed, scan_bus
from paramove.robots.dynamixel.bus.servo_chain import ServoChain, ServoTimeoutError
from paramove.robots.dynamixel.bus.servo_models import BAUD_RATES, MAX_ID, ServoModel

NO_DELAY = 0
"""Of Return Delay Time (9): replies come at once, which a fast bus needs."""


def only_servo(
    chain: ServoChain, baud_rates: Sequence[int] = USUAL_BAUD_RATES, ids: Sequence[int] = ALL_IDS
) -> DetectedServo:
    """The one servo that is connected, whatever its ID and baud rate; see `scan_bus`.

    Raises:
        InputError: None replies, more than one does, or its table is unknown here.
    """
    scan = scan_bus(chain, baud_rates, ids)
    if not scan.servos:
        why = "; ".join(scan.faults) or "check its power and its cable"
        raise InputError(
            f"expected exactly one servo on the bus, found none at {listed(baud_rates)}: {why}", missing=True
        )
    if len(scan.servos) > 1 or scan.servos[0].has_duplicate_id:
        servos = ", ".join(
            f"ID {one.number} ({one.fault if one.has_duplicate_id else one.name})" for one in scan.servos
        )
        raise InputError(f"expected exactly one servo on the bus, found {servos}: connect one alone")
    return scan.servos[0]


def set_up(chain: ServoChain, servo: DetectedServo, number: int, baud_rate: int, model: str = "") -> DetectedServo:
    """Give the only servo on the bus its ID and baud rate, and no delay before its replies; its torque goes off.

    Args:
        servo: As a scan detected it; the port goes to its baud rate and stays at the new one.
        number: New ID.
        baud_rate: New one, bit/s.
        model: That it must be of, "" for any.

    Returns:
        The servo, as a new scan detects it.

    Raises:
        InputError: It is of another model, or cannot have this ID or baud rate; nothing was written.
        ServoError: It did not take a value, or is not what was written.
    """
    table = _checked(servo, number, baud_rate, model)
    registers = table.registers
    chain.port.setBaudRate(servo.baud_rate)
    chain.write(servo.number, registers["Torque Enable"], 0)
    if servo.number != number:
        chain.write(servo.number, registers["ID"], number)
    chain.write(number, registers["Return Delay Time"], NO_DELAY)
    if servo.baud_rate != baud_rate:
        with contextlib.suppress(ServoTimeoutError):  # it may reply at the new rate already; see what is read back
            chain.write(number, registers["Baud Rate"], BAUD_RATES.index(baud_rate))
        chain.port.setBaudRate(baud_rate)
    expected = {"ID": number, "Baud Rate": BAUD_RATES.index(baud_rate), "Return Delay Time": NO_DELAY}
    for name, value in expected.items():
        read = chain.read(number, registers[name])
        if read != value:
            raise InputError(f"servo {number}: {name} was written as {value}, but reads {read}; set it up once more")
    return only_servo(chain, [baud_rate])


def _checked(servo: DetectedServo, number: int, baud_rate: int, model: str) -> ServoModel:
    if model and servo.model != model:
        raise InputError(f"expected a servo {model} for ID {number}, found {servo.name}: connect the right one")
    table = servo.table
    if table is None:
        raise InputError(f"the table of {servo.name} is unknown here: set it up with its maker's tool")
    if not 0 <= number <= MAX_ID:
        raise InputError(f"an ID is 0 to {MAX_ID}, found {number}")
    if baud_rate not in table.baud_rates:
        rates = ", ".join(map(str, table.baud_rates))
        raise InputError(f"{table.name} has the baud rates {rates}, found {baud_rate}")
    return table
