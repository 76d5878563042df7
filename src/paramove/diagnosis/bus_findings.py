"""What is wrong with the servos of a bus: IDs, rates, supply, temperature, errors."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from paramove.diagnosis.bus_scan import ALL_IDS, READS, USUAL_BAUD_RATES, FoundServo, ScannedRate, scan
from paramove.diagnosis.finding import Finding, Level, Machine
from paramove.diagnosis.serial_ports import usable_ports
from paramove.input_error import InputError
from paramove.robots.dynamixel.hardware_error import hardware_errors, in_words
from paramove.robots.dynamixel.servo_models import BAUD_RATES, MODELS
from paramove.robots.dynamixel.servo_port import PortLostError, ServoPort

NEAR_LIMIT_C = 10
"""A servo so near its temperature limit is told of; chosen."""
NOBODY = (
    "check, the likeliest first: the motor supply is on; the cable to the first servo is plugged in",
    "the adapter is one for Dynamixel (half duplex, TTL or RS-485 as the servos are)",
    "the servos speak Protocol 2.0 at one of these rates (--baud names another)",
)


Wrong = tuple[Level, str, tuple[str, ...]]
"""How bad, what, and what mends it."""


def servos_findings(machine: Machine) -> Iterator[Finding]:
    """Of all buses whose port is free."""
    ports = usable_ports(machine)
    for port in ports:
        yield from bus_findings(port, machine.baud_rates or USUAL_BAUD_RATES)
    if not ports:
        yield Finding("servos", Level.WARNING, "none were asked: there is no serial port that is free")


def bus_findings(
    port: Path,
    baud_rates: Sequence[int] = USUAL_BAUD_RATES,
    patience_s: float = 0.1,
    ids: Sequence[int] = ALL_IDS,
) -> list[Finding]:
    """Asks the servos on a port, and judges what they tell.

    Args:
        port: For example a link in /dev/serial/by-id.
        baud_rates: At which is asked, bit/s.
        patience_s: For the beginning of an answer, beyond the time of its bytes.
        ids: That are asked one by one where servos answer and something disturbs them.
    """
    try:
        with ServoPort(str(port), baud_rates[0]) as opened:
            scanned = list(scan(opened, baud_rates, patience_s, ids))
    except (InputError, PortLostError) as error:
        return [Finding("bus", Level.PROBLEM, str(error), facts={"port": str(port)})]
    servos = [servo for rate in scanned for servo in rate.servos]
    findings = [_overview(port, scanned, servos), *_mixed_rates(port, servos)]
    for servo in servos:
        findings += servo_findings(port, servo)
    return findings


def servo_findings(port: Path, servo: FoundServo) -> list[Finding]:
    """Of one servo: first what it tells, then what is wrong with it."""
    about = f"servo {servo.number}"
    told = [servo.model, *([f"firmware {servo.firmware}"] if servo.firmware else []), f"{servo.baud_rate} bit/s"]
    facts: dict[str, object] = {"port": str(port), "id": servo.number, "model": servo.model}
    facts |= {"firmware": servo.firmware, "baud_rate": servo.baud_rate}
    if (tenths := servo.values.get("Present Input Voltage")) is not None:
        facts["voltage"] = tenths / 10
        told.append(f"{tenths / 10:.1f} V")
    if (temperature := servo.values.get("Present Temperature")) is not None:
        facts["temperature_c"] = temperature
        told.append(f"{temperature} °C")
    if (errors := servo.values.get("Hardware Error Status")) is not None:
        facts["hardware_error"] = errors
    wrong = [*_identity(port, servo), *_voltage(servo), *_temperature(servo), *_hardware_errors(port, servo)]
    return [Finding(about, Level.OK, ", ".join(told), facts=facts), *(Finding(about, *one) for one in wrong)]


def _overview(port: Path, scanned: Sequence[ScannedRate], servos: Sequence[FoundServo]) -> Finding:
    facts = {"port": str(port), "servos": len(servos)}
    damaged = [rate.baud_rate for rate in scanned if rate.damaged]
    foreign = [rate.baud_rate for rate in scanned if rate.foreign]
    asked = ", ".join(str(rate.baud_rate) for rate in scanned if rate.possible)
    if damaged:
        shown = ", ".join(map(str, damaged))
        sentence = f"{port.name}: answers at {shown} bit/s are damaged: several servos have the same ID, or a bad cable"
        remedy = ("unplug the last servo of the chain and look again, until the answers are clean",)
        return Finding("bus", Level.PROBLEM, sentence, remedy, facts=facts)
    if foreign and not servos:
        shown = ", ".join(map(str, foreign))
        sentence = (
            f"{port.name}: what comes in at {shown} bit/s is no answer of a servo: another device, or a bad cable"
        )
        return Finding("bus", Level.WARNING, sentence, NOBODY, facts=facts)
    if not servos:
        return Finding("bus", Level.WARNING, f"{port.name}: no servo answers at {asked} bit/s", NOBODY, facts=facts)
    plural = "s" * (len(servos) > 1)
    rates = " and ".join(map(str, sorted({servo.baud_rate for servo in servos})))
    return Finding("bus", Level.OK, f"{port.name}: {len(servos)} servo{plural} found at {rates} bit/s", facts=facts)


def _mixed_rates(port: Path, servos: Sequence[FoundServo]) -> Iterator[Finding]:
    """A program talks at one rate; the others are brought to that of most, of two equal ones the faster."""
    by_rate: dict[int, list[int]] = {}
    for servo in servos:
        by_rate.setdefault(servo.baud_rate, []).append(servo.number)
    if len(by_rate) < 2:
        return
    kept = max(by_rate, key=lambda rate: (len(by_rate[rate]), rate))
    parts = (f"{', '.join(map(str, numbers))} at {rate} bit/s" for rate, numbers in sorted(by_rate.items()))
    sentence = f"{port.name}: servos at different rates ({'; '.join(parts)}): no program reaches all of them"
    others = [servo for servo in servos if servo.baud_rate != kept]
    code = BAUD_RATES.index(kept)
    remedy = tuple(line for one in others for line in _setting(port, one, "Baud Rate", str(code), f"{kept} bit/s"))
    yield Finding("bus", Level.PROBLEM, sentence, remedy)


def _identity(port: Path, servo: FoundServo) -> Iterator[Wrong]:
    if servo.at_once > 1:
        sentence = f"{servo.at_once} servos have the ID {servo.number}: they talk at once"
        change = _setting(port, servo, "ID", "NEW_ID", "one that no other servo has")
        yield Level.PROBLEM, sentence, ("unplug all of them but one, then", *change)
    elif servo.failed:
        sentence = f"{servo.failed} of {READS} reads failed: another servo with this ID, or a bad cable"
        sentence += ", or Status Return Level (68) is 0" if servo.failed == READS else ""
        yield Level.PROBLEM, sentence, ("plug in this servo alone and look again, then with another cable",)
    elif not servo.values:
        yield Level.WARNING, f"{servo.model} has no table in dynamixel-sdk: its state cannot be read", ()


def _voltage(servo: FoundServo) -> Iterator[Wrong]:
    names = ("Present Input Voltage", "Min Voltage Limit", "Max Voltage Limit")
    present, least, most = (servo.values.get(name) for name in names)
    if present is None or least is None or most is None or least <= present <= most:
        return
    sentence = f"measures {present / 10:.1f} V, its limits are {least / 10:.1f} to {most / 10:.1f} V"
    model = MODELS.get(servo.model)
    wanted = f"{model.voltage:g} V" if model is not None else "what its manual recommends"
    yield Level.PROBLEM, sentence, (f"switch off, and give it a supply of {wanted}",)


def _temperature(servo: FoundServo) -> Iterator[Wrong]:
    present, limit = servo.values.get("Present Temperature"), servo.values.get("Temperature Limit")
    if present is None or limit is None or present < limit - NEAR_LIMIT_C:
        return
    level = Level.PROBLEM if present >= limit else Level.WARNING
    yield level, f"is {present} °C hot, its limit is {limit} °C", ("let it cool with torque off, and lessen its load",)


def _hardware_errors(port: Path, servo: FoundServo) -> Iterator[Wrong]:
    status = servo.values.get("Hardware Error Status", 0)
    if not status:
        return
    found = hardware_errors(status)
    sentence = f"has stopped: {in_words(status)} (Hardware Error Status {status:#04x})"
    restart = "then hold the arm, as its torque goes off, and restart the servo:"
    yield (
        Level.PROBLEM,
        sentence,
        (*(one.remedy for one in found), restart, _command(port, servo, f"reboot(p, {servo.number})")),
    )


def _setting(port: Path, servo: FoundServo, register: str, value: str, words: str) -> tuple[str, ...]:
    """How a register is set; by a command only where its address is known for certain."""
    model = MODELS.get(servo.model)
    aim = f"set {register} of servo {servo.number} to {words}, with its torque off"
    if model is None:
        return (f"{aim}, with Dynamixel Wizard 2",)
    address = model.registers[register].address
    call = f"write1ByteTxRx(p, {servo.number}, {address}, {value})"
    return (f"{aim}; this prints (0, 0) when done:", _command(port, servo, call))


def _command(port: Path, servo: FoundServo, call: str) -> str:
    """For a shell: what dynamixel-sdk is to do with a servo at its rate."""
    code = f"from dynamixel_sdk import *; p = PortHandler({json.dumps(str(port))}); p.openPort(); "
    code += f"p.setBaudRate({servo.baud_rate}); print(PacketHandler(2.0).{call})"
    return shlex.join((sys.executable, "-c", code))
