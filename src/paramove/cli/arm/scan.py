"""`paramove arm scan`: lists the servos on the bus of each adapter."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated, Any

import typer

from paramove.cli.arm.options import ByIdOption, DataOption, SerialOption, configured_baud_rate, open_arm
from paramove.cli.bus_options import show
from paramove.cli.output import JsonOption, ended
from paramove.documents import exit_codes
from paramove.robots.dynamixel import serial_adapters

if TYPE_CHECKING:
    from paramove.robots.dynamixel import DetectedServo


def scan(
    baud_rates: Annotated[
        list[int] | None,
        typer.Option("--baud", min=1, metavar="RATE", help="bit/s; may be repeated [default: all usual]"),
    ] = None,
    serial: SerialOption = "",
    by_id: ByIdOption = None,
    data: DataOption = None,
    as_json: JsonOption = False,
) -> None:
    """List the servos at every adapter: ID, model, firmware, baud rate, voltage, temperature, errors, torque.

    Reads only. All usual baud rates are asked, which takes about 10 s for each adapter, and 6 s more where two servos
    have one ID.

    Exit codes: 0 servos were found; 3 something about them must be put right; 69 no adapter, or no servo answers;
    75 the adapter is in use; 77 not allowed to open it.
    """
    from paramove.robots.dynamixel import USUAL_BAUD_RATES, listed, scan_bus

    adapters = [one for one in serial_adapters(by_id) if serial in ("", one.serial)]
    if not adapters:
        with open_arm(by_id, serial, data):  # says why there is none
            return
    rates = tuple(baud_rates or USUAL_BAUD_RATES)
    reports, count = [], 0
    findings: list[str] = []
    for adapter in adapters:
        with open_arm(by_id, adapter.serial, data) as arm:
            found = scan_bus(arm.chain, rates)
        sentences = found.findings(configured_baud_rate(arm.path))
        count += len(found.servos)
        findings += sentences
        names = {"serial": adapter.serial, "link": str(adapter.link), "device": adapter.device}
        reports.append({**names, "servos": [_row(servo) for servo in found.servos], "findings": sentences})
        if not as_json:
            _tell(reports[-1], listed(found.asked))
    if as_json:
        typer.echo(json.dumps(reports, indent=2))
    if findings:
        raise typer.Exit(exit_codes.JUDGED_A_FAILURE)
    if not count:
        raise ended("no servo answers: check the power of the arm and its cables", exit_codes.UNAVAILABLE)


def _tell(adapter: dict[str, Any], rates: str) -> None:
    typer.echo(f"adapter {adapter['serial']} ({adapter['device']}), scanned at {rates}")
    typer.echo(f"port {adapter['link']}")
    show(adapter["servos"], as_json=False)
    for line in adapter["findings"]:
        typer.echo(line)


def _row(servo: DetectedServo) -> dict[str, Any]:
    from paramove.robots.dynamixel import error_text

    return {
        "id": servo.number,
        "model": servo.model,
        "model_number": servo.model_number or None,
        "firmware": servo.firmware or None,
        "baud_rate": servo.baud_rate,
        "voltage": servo.voltage,
        "temperature": servo.temperature,
        "hardware_error": None if servo.hardware_error is None else error_text(servo.hardware_error) or "none",
        "torque": servo.torque,
    }
