"""`paramove arm setup`: IDs and baud rate of a new arm's servos, one servo at a time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from paramove.cli.arm.options import ByIdOption, DataOption, RobotOption, SerialOption, explained, open_arm
from paramove.cli.arm.terminal_person import QuitError, TerminalPerson
from paramove.cli.output import ended
from paramove.documents import InputError, exit_codes

if TYPE_CHECKING:
    from paramove.robots.dynamixel import ArmPlan, DetectedServo, PlannedServo, ServoChain


def setup(
    robot: RobotOption,
    joints: Annotated[
        list[str] | None, typer.Option("--joint", metavar="NAME", help="only this one; may be repeated")
    ] = None,
    serial: SerialOption = "",
    by_id: ByIdOption = None,
    data: DataOption = None,
) -> None:
    """Give the servos of an arm their IDs and baud rate, one after the other: exactly one is connected at a time.

    It is found at any ID and usual baud rate. ID, Return Delay Time 0 and baud rate are written with torque off and
    read back.

    Exit codes: 0 all are set up; 1 ended before; 69 no adapter; 78 no such joint or description; 130 Ctrl-C.
    """
    from paramove.robots.dynamixel import load_plan

    with explained():
        plan = load_plan(robot)
        wanted = _wanted(plan, joints)
    person = TerminalPerson()
    with open_arm(by_id, serial, data, plan.baud_rate) as arm:
        done: list[PlannedServo] = []
        for servo in wanted:
            try:
                _set_up(arm.chain, plan, servo, person, done)
            except (QuitError, KeyboardInterrupt) as error:
                left = " ".join(f"--joint {one.joint}" for one in wanted[wanted.index(servo) :])
                code = exit_codes.FAILURE if isinstance(error, QuitError) else exit_codes.CTRL_C
                raise ended(f"ended before {servo.joint}; continue with {left}", code) from None
            done.append(servo)
    typer.echo("connect all servos and run `paramove arm scan`, then `paramove arm calibrate`")


def _wanted(plan: ArmPlan, joints: list[str] | None) -> list[PlannedServo]:
    known = {servo.joint: servo for servo in plan.servos}
    unknown = [name for name in joints or () if name not in known]
    if unknown:
        raise InputError(f"{plan.robot} has no joint {unknown[0]!r}, found {', '.join(known)}")
    return [known[name] for name in dict.fromkeys(joints)] if joints else list(plan.servos)


def _set_up(
    chain: ServoChain, plan: ArmPlan, servo: PlannedServo, person: TerminalPerson, done: Sequence[PlannedServo]
) -> None:
    """Asks until the right servo is connected alone and has taken its settings; it is none of those that are done."""
    from paramove.robots.dynamixel import ServoError, only_servo, set_up

    while True:
        person.until_done(f"Connect the servo of {servo.joint} ({servo.model}) and no other.", list)
        try:
            found = only_servo(chain)
            _check_is_new(found, plan, servo, done)
            set_up(chain, found, servo.number, plan.baud_rate, servo.model)
        except (InputError, ServoError) as error:
            person.tell(str(error))
            continue
        person.tell(
            f"{servo.joint}: ID {found.number} at {found.baud_rate} is now ID {servo.number} at {plan.baud_rate}, "
            "answers at once; label it"
        )
        return


def _check_is_new(found: DetectedServo, plan: ArmPlan, servo: PlannedServo, done: Sequence[PlannedServo]) -> None:
    """Raises InputError for a servo that was left connected: it would get a second ID, and its label be wrong."""
    for one in done:
        if (found.number, found.baud_rate) == (one.number, plan.baud_rate):
            raise InputError(
                f"the servo with ID {one.number} is that of {one.joint}, which was just set up: connect that of "
                f"{servo.joint}; if it is another one, press q and run this command with --joint {servo.joint}"
            )
