"""`paramove arm teach`: demonstrations of a movement, by leading the arm by hand."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from paramove.cli.arm.options import (
    ByIdOption,
    DataOption,
    OpenArm,
    RobotOption,
    SerialOption,
    explained,
    open_arm,
)
from paramove.cli.arm.terminal_person import QuitError, TerminalPerson
from paramove.cli.output import ended
from paramove.documents import exit_codes, printable
from paramove.supervision import QueuedOutput

if TYPE_CHECKING:
    from paramove.demonstrations import KinestheticTeacher
    from paramove.robots import RobotDescription
    from paramove.robots.dynamixel import TorqueOffArm

PERIOD_S = 0.02
KEYS = "space begins and ends a segment, d drops the last one, q ends"


def teach(
    folder: Annotated[Path, typer.Argument(metavar="SET", help="folder of the demonstration set")],
    robot: RobotOption,
    action: Annotated[str, typer.Option("--action", metavar="NAME", help="demonstrated action, such as reaching")],
    subject: Annotated[str, typer.Option("--subject", help="person who demonstrates it")] = "",
    floats: Annotated[
        bool, typer.Option("--float/--limp", help="its servos carry its own weight, or nothing (default)")
    ] = False,
    append: Annotated[bool, typer.Option("--append", help="to a set that is there already")] = False,
    serial: SerialOption = "",
    by_id: ByIdOption = None,
    data: DataOption = None,
) -> None:
    """Record demonstrations: you lead the arm by hand from its rest to a position, again and again.

    Torque goes off: hold the arm, at the end too. Keys: space begins and ends a segment, d drops the last one, q ends.
    Each segment is written as soon as it has ended; theta is where the end effector is then, frame of the arm's base.

    Exit codes: 0 ended by q; 1 no segment was recorded; 66 no calibration; 69 no adapter, or a servo does not answer;
    77 the set cannot be written; 78 there is a set already, or it has other parameters; 130 Ctrl-C, segments that have
    ended are kept.
    """
    from paramove.demonstrations import KinestheticTeacher
    from paramove.robots import RobotDescription
    from paramove.robots.dynamixel import GravityCompensatedArm, TorqueOffArm

    with explained():
        description = RobotDescription.load(robot)
        teacher = KinestheticTeacher(description, folder, action, subject, append=append)
        baud_rate = description.bus.baud_rate if description.bus is not None else 0
    person = TerminalPerson()
    try:
        # After Ctrl-S, the servos must still get the currents that carry the arm.
        with QueuedOutput(), open_arm(by_id, serial, data, baud_rate) as arm:
            torque_off = (GravityCompensatedArm if floats else TorqueOffArm)(arm.chain, _of_this_arm(description, arm))
            person.until_done("Hold the arm, it becomes limp.", list)
            try:
                torque_off.release()
                person.tell(KEYS)
                _lead(torque_off, teacher, person)
            finally:
                for failed in torque_off.put_down():
                    typer.echo(printable(f"not switched off: {failed}"), err=True)
                _tell_end(teacher, folder)
    except QuitError:
        raise typer.Exit(exit_codes.OK if teacher.taught.written else exit_codes.FAILURE) from None
    except KeyboardInterrupt:
        raise ended("interrupted", exit_codes.CTRL_C) from None


def _of_this_arm(description: RobotDescription, arm: OpenArm) -> RobotDescription:
    """With the units of the calibration; as described if the arm needs no calibration and has none."""
    if not arm.path.exists() and not (description.bus is not None and description.bus.calibrate):
        return description
    units = arm.calibration().units(description.joint_names, description.lower, description.upper)
    return replace(description, units=units)


def _lead(torque_off: TorqueOffArm, teacher: KinestheticTeacher, person: TerminalPerson) -> None:
    """Until the person ends it. Raises QuitError."""
    due_s = time.monotonic()
    with person.pressing() as pressed:
        while True:
            sample = torque_off.measured()
            if sample is not None:
                teacher.handle(*sample)
            due_s = max(due_s + PERIOD_S, time.monotonic())
            _press(pressed(max(0.0, due_s - time.monotonic())), teacher)


def _press(key: str, teacher: KinestheticTeacher) -> None:
    """Handles a key and prints the result."""
    from paramove.demonstrations import DemonstrationError

    try:
        if key == " " and not teacher.is_recording:
            teacher.begin()
            typer.echo("recording: lead the arm, and press space where it arrives")
        elif key == " ":
            x, y, z = 100.0 * teacher.end()
            written = teacher.taught.written
            typer.echo(f"{len(written)}: {written[-1]} ends at ({x:.1f}, {y:.1f}, {z:.1f}) cm")
        elif key == "d":
            typer.echo(f"dropped {teacher.taught.drop()}")
    except DemonstrationError as error:
        typer.echo(printable(str(error)))


def _tell_end(teacher: KinestheticTeacher, folder: Path) -> None:
    if teacher.is_recording:
        typer.echo("the segment that had not ended is left out")
    if not teacher.taught.written:
        typer.echo(f"no segment was recorded: {folder} is as it was")
        return
    typer.echo(f"{folder}: {len(teacher.taught.written)} new; look at them with `paramove demos list {folder}`")
