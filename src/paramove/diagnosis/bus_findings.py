"""What is wrong with the servos of a bus: IDs, rates, supply, temperature, errors."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from paramove.diagnosis.finding import Finding, Level, Machine
from paramove.diagnosis.serial_ports import usable_ports
from paramove.documents import InputError
from paramove.robots.dynamixel import (
    ALL_IDS,
    BAUD_RATES,
    USUAL_BAUD_RATES,
    BusScan,
    DetectedServo,
    PortLostError,
    ServoChain,
    ServoPort,
    error_text,
    hardware_errors,
    listed,
    scan_bus,
)

NEAR_LIMIT_C = 10
"""A servo so near its temperature limit is reported; chosen."""
NO_SERVO = (
    "check, the likeliest first: the motor supply is on; the cable to the first servo is plugged in",
    "the adapter is one for Dynamixel (half duplex, TTL or RS-485 as the servos are)",
    "the servos use Protocol 2.0 at one of these rates (--baud names another)",
)
CLEAN = ("unplug the last servo of the chain and check again, until the answers are clean",)

Wrong = tuple[Level, str, tuple[str, ...]]
"""Severity, message and remedy."""


def servos_findings(machine: Machine) -> Iterator[Finding]:
    """Of all buses whose port is free."""
    ports = usable_ports(machine)
    for port in ports:
        yield from bus_findings(port, machine.baud_rates or USUAL_BAUD_RATES)
    if not ports:
        yield Finding("servos", Level.WARNING, "not checked: no serial port is free")


def bus_findings(
    port: Path,
    baud_rates: Sequence[int] = USUAL_BAUD_RATES,
    timeout_s: float = 0.1,
    ids: Sequence[int] = ALL_IDS,
) -> list[Finding]:
    """Reads the servos on a port, and checks what they report.

    Args:
        port: For example a link in /dev/serial/by-id.
        baud_rates: Of the scan, bit/s.
        timeout_s: For the beginning of a reply, beyond the time of its bytes.
        ids: That are asked one by one where replies are disturbed.
    """
    try:
        with ServoPort(str(port), baud_rates[0], timeout_s) as opened:
            scan = scan_bus(ServoChain(opened), baud_rates, ids)
    except (InputError, PortLostError) as error:
        return [Finding("bus", Level.PROBLEM, str(error), facts={"port": str(port)})]
    findings = [_overview(port, scan), *_mixed_rates(port, scan.servos)]
    for servo in scan.servos:
        findings += servo_findings(port, servo)
    return findings


def servo_findings(port: Path, servo: DetectedServo) -> list[Finding]:
    """Of one servo: first its state, then its faults."""
    about = f"servo {servo.number}"
    details = [servo.name, *([f"firmware {servo.firmware}"] if servo.firmware else []), f"{servo.baud_rate} bit/s"]
    facts: dict[str, object] = {"port": str(port), "id": servo.number, "model": servo.name}
    facts |= {"firmware": servo.firmware, "baud_rate": servo.baud_rate}
    if servo.voltage is not None:
        facts["voltage"] = servo.voltage
        details.append(f"{servo.voltage:.1f} V")
    if servo.temperature is not None:
        facts["temperature_c"] = servo.temperature
        details.append(f"{servo.temperature} °C")
    if servo.hardware_error is not None:
        facts["hardware_error"] = servo.hardware_error
    wrong = [*_identity(port, servo), *_voltage(servo), *_temperature(servo), *_hardware_errors(port, servo)]
    return [Finding(about, Level.OK, ", ".join(details), facts=facts), *(Finding(about, *one) for one in wrong)]


def _overview(port: Path, scan: BusScan) -> Finding:
    facts = {"port": str(port), "servos": len(scan.servos)}
    if scan.faults and (scan.damaged or not scan.servos):
        level, remedy = (Level.PROBLEM, CLEAN) if scan.damaged else (Level.WARNING, NO_SERVO)
        return Finding("bus", level, f"{port.name}: {'; '.join(scan.faults)}", remedy, facts=facts)
    if not scan.servos:
        message = f"{port.name}: no servo answers at {listed(scan.asked)} bit/s"
        return Finding("bus", Level.WARNING, message, NO_SERVO, facts=facts)
    plural = "s" * (len(scan.servos) > 1)
    rates = " and ".join(map(str, sorted({servo.baud_rate for servo in scan.servos})))
    return Finding(
        "bus", Level.OK, f"{port.name}: {len(scan.servos)} servo{plural} found at {rates} bit/s", facts=facts
    )


def _mixed_rates(port: Path, servos: Sequence[DetectedServo]) -> Iterator[Finding]:
    """A program uses one rate: the others get the rate of most servos, of two equal ones the faster."""
    by_rate: dict[int, list[int]] = {}
    for servo in servos:
        by_rate.setdefault(servo.baud_rate, []).append(servo.number)
    if len(by_rate) < 2:
        return
    target = max(by_rate, key=lambda rate: (len(by_rate[rate]), rate))
    parts = (f"{', '.join(map(str, numbers))} at {rate} bit/s" for rate, numbers in sorted(by_rate.items()))
    message = f"{port.name}: servos at different rates ({'; '.join(parts)}): no program reaches all of them"
    others = [servo for servo in servos if servo.baud_rate != target]
    code = BAUD_RATES.index(target)
    remedy = tuple(line for one in others for line in _setting(port, one, "Baud Rate", str(code), f"{target} bit/s"))
    yield Finding("bus", Level.PROBLEM, message, remedy)


def _identity(port: Path, servo: DetectedServo) -> Iterator[Wrong]:
    if servo.has_duplicate_id:
        change = _setting(port, servo, "ID", "NEW_ID", "one that no other servo has")
        yield Level.PROBLEM, servo.fault, (f"{servo.remedy}, or", *change)
    elif servo.fault:
        yield Level.PROBLEM, servo.fault, (servo.remedy,)
    elif not servo.model:
        yield Level.WARNING, f"{servo.name} has no table in dynamixel-sdk: its state cannot be read", ()


def _voltage(servo: DetectedServo) -> Iterator[Wrong]:
    names = ("Present Input Voltage", "Min Voltage Limit", "Max Voltage Limit")
    present, minimum, maximum = (servo.values.get(name) for name in names)
    if present is None or minimum is None or maximum is None or minimum <= present <= maximum:
        return
    message = f"measures {present / 10:.1f} V, its limits are {minimum / 10:.1f} to {maximum / 10:.1f} V"
    recommended = f"{servo.table.voltage:g} V" if servo.table is not None else "what its manual recommends"
    yield Level.PROBLEM, message, (f"switch off, and give it a supply of {recommended}",)


def _temperature(servo: DetectedServo) -> Iterator[Wrong]:
    present, limit = servo.temperature, servo.values.get("Temperature Limit")
    if present is None or limit is None or present < limit - NEAR_LIMIT_C:
        return
    level = Level.PROBLEM if present >= limit else Level.WARNING
    yield level, f"is {present} °C hot, its limit is {limit} °C", ("let it cool with torque off, and reduce its load",)


def _hardware_errors(port: Path, servo: DetectedServo) -> Iterator[Wrong]:
    status = servo.hardware_error
    if not status:
        return
    message = f"has stopped: {error_text(status)} (Hardware Error Status {status:#04x})"
    restart = "then hold the arm, as its torque goes off, and restart the servo:"
    command = _command(port, servo, f"reboot(p, {servo.number})")
    yield Level.PROBLEM, message, (*(one.remedy for one in hardware_errors(status)), restart, command)


def _setting(port: Path, servo: DetectedServo, register: str, value: str, meaning: str) -> tuple[str, ...]:
    """How a register is set; by a command only where its address is known for certain."""
    aim = f"set {register} of servo {servo.number} to {meaning}, with its torque off"
    if servo.table is None:
        return (f"{aim}, with Dynamixel Wizard 2",)
    address = servo.table.registers[register].address
    call = f"write1ByteTxRx(p, {servo.number}, {address}, {value})"
    return (f"{aim}; this prints (0, 0) when done:", _command(port, servo, call))


def _command(port: Path, servo: DetectedServo, call: str) -> str:
    """For a shell: what dynamixel-sdk is to do with a servo at its rate."""
    code = f"from dynamixel_sdk import *; p = PortHandler({json.dumps(str(port))}); p.openPort(); "
    code += f"p.setBaudRate({servo.baud_rate}); print(PacketHandler(2.0).{call})"
    return shlex.join((sys.executable, "-P", "-c", code))
