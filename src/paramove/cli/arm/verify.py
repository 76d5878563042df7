"""`paramove arm verify`: calibration file, description and servos compared."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from paramove.cli.arm.options import (
    BaudOption,
    ByIdOption,
    DataOption,
    OpenArm,
    SerialOption,
    explained,
    open_arm,
)
from paramove.cli.bus_options import show
from paramove.cli.output import JsonOption, ended
from paramove.documents import exit_codes

CHOICE = (
    "--write writes the file's settings to the servos, --adopt takes the servos' into the file; where IDs, models or "
    "joints differ, the file is of another arm: `paramove arm scan` shows who is there"
)

ANOTHER_ARM = (
    "no servo is set as this file has it, and its adapter has no serial number, so that this seems to be another arm: "
    "nothing was written; run `paramove arm calibrate`, or connect the arm of the file"
)


def verify(
    robot: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="description, which is then also compared")
    ] = None,
    write: Annotated[bool, typer.Option("--write", help="write the file's settings to the servos")] = False,
    adopt: Annotated[
        bool, typer.Option("--adopt", help="take the servos' firmware, modes and limits into the file")
    ] = False,
    sign: Annotated[bool, typer.Option("--sign", help="the file was edited on purpose: renew its sha256")] = False,
    serial: SerialOption = "",
    baud_rate: BaudOption = 0,
    by_id: ByIdOption = None,
    data: DataOption = None,
    as_json: JsonOption = False,
) -> None:
    """Compare the calibration of the arm with its servos: models, firmware, modes, limits, offsets, delays.

    Reads only, without --write, --adopt or --sign.

    Exit codes: 0 no difference; 2 contrary options; 3 differences, in a table; 66 no calibration; 69 no adapter, or no
    servo answers; 78 the file is damaged, edited and not signed, or of another arm.
    """
    from paramove.robots.dynamixel import adopted, compare, is_same_arm, load_plan, sign_again

    if write and adopt:
        raise ended("--write and --adopt are contrary: choose one", exit_codes.USAGE)
    with explained():
        plan = None if robot is None else load_plan(robot)
    with open_arm(by_id, serial, data, baud_rate) as arm:
        if sign:
            sign_again(arm.path)
        _check_baud_rate(arm)
        is_known = arm.adapter.is_numbered or is_same_arm(arm.chain, arm.calibration())
        if (write or adopt) and not is_known:
            raise ended(f"{arm.path}: {ANOTHER_ARM}", exit_codes.CONFIGURATION)
        if write:
            _write(arm)
        if adopt:
            adopted(arm.chain, arm.calibration()).save(arm.path)
        rows = [asdict(one) for one in compare(arm.chain, arm.calibration(), plan)]
    if as_json:
        typer.echo(json.dumps(rows, indent=2))
    else:
        show(rows, as_json=False)
        typer.echo(f"{arm.path}: {len(rows) or 'no'} difference{'s' * (len(rows) != 1)}")
    if rows:
        typer.echo(CHOICE if is_known else ANOTHER_ARM, err=True)
        raise typer.Exit(exit_codes.JUDGED_A_FAILURE)


def _check_baud_rate(arm: OpenArm) -> None:
    """Looks for the servos at other baud rates if none answers, and ends the command."""
    from paramove.robots.dynamixel import USUAL_BAUD_RATES, scan_bus

    rate = arm.chain.port.baud_rate
    if any(arm.chain.ping(joint.id) for joint in arm.calibration().joints.values()):
        return
    found = scan_bus(arm.chain, [other for other in USUAL_BAUD_RATES if other != rate])
    reason = "; ".join(found.findings(rate)) or f"no servo answers, neither at {rate} nor at another usual baud rate"
    raise ended(f"{reason}; `paramove arm setup` sets the baud rate", exit_codes.UNAVAILABLE)


def _write(arm: OpenArm) -> None:
    from paramove.robots.dynamixel import write_settings

    for name, joint in arm.calibration().joints.items():
        for register, (before, after) in write_settings(arm.chain, joint).items():
            typer.echo(f"{name}: {register} {before} is now {after}", err=True)
