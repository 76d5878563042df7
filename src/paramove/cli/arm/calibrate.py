"""`paramove arm calibrate`: calibrates the counts of an arm's servos, as a person moves it by hand."""

from __future__ import annotations

import datetime
from importlib.metadata import version

import typer

from paramove.cli.arm.options import ByIdOption, DataOption, RobotOption, SerialOption, explained, open_arm
from paramove.cli.arm.terminal_person import QuitError, TerminalPerson
from paramove.cli.output import ended
from paramove.documents import exit_codes


def calibrate(
    robot: RobotOption,
    serial: SerialOption = "",
    by_id: ByIdOption = None,
    data: DataOption = None,
) -> None:
    """Calibrate an arm: you move every joint through its travel, hold a posture, and show each joint's direction.

    Torque goes off: hold the arm. At the end operating modes, limits and offsets are written to the servos, and a file
    for this adapter to the data folder. A file that is there is kept beside it, under another name: without a serial
    number of the adapter it may be of another arm.

    Exit codes: 0 calibrated; 1 ended before, and the old file stays; 69 no adapter, or a servo does not answer;
    77 the data folder cannot be written, which is checked first; 78 the measurements do not fit the description,
    with the cause; 130 Ctrl-C, and the old file stays.
    """
    from paramove.robots.dynamixel import ArmCalibrator, check_writable, keep_earlier, load_plan

    with explained():
        plan = load_plan(robot)
    created = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    with open_arm(by_id, serial, data, plan.baud_rate) as arm:
        check_writable(arm.path)
        calibrator = ArmCalibrator(arm.chain, plan, arm.adapter.serial, TerminalPerson())
        try:
            calibration = calibrator.run(created, f"paramove {version('paramove')}")
        except (QuitError, KeyboardInterrupt) as error:
            code = exit_codes.FAILURE if isinstance(error, QuitError) else exit_codes.CTRL_C
            raise ended("ended before the calibration was complete: nothing was saved", code) from None
        kept = keep_earlier(arm.path)
        calibration.save(arm.path)
    if kept is not None:
        typer.echo(f"the calibration that was there is kept as {kept}")
    typer.echo(f"{arm.path}: {len(calibration.joints)} joints; check it with `paramove arm verify`")
