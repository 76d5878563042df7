"""`paramove arm reboot`: clears one servo's hardware error."""

from __future__ import annotations

from typing import Annotated

import typer

from paramove.cli.arm.options import BaudOption, ByIdOption, DataOption, SerialOption, open_arm
from paramove.cli.output import ended
from paramove.documents import exit_codes


def reboot(
    number: Annotated[int, typer.Argument(metavar="ID", min=0, max=252)],
    yes: Annotated[
        bool, typer.Option("--yes", help="the arm is held: reboot even while the joint carries a load")
    ] = False,
    serial: SerialOption = "",
    baud_rate: BaudOption = 0,
    by_id: ByIdOption = None,
    data: DataOption = None,
) -> None:
    """Reboot one servo: its hardware error is printed and cleared, its torque goes off. The others keep holding.

    Exit codes: 0 rebooted and without error; 1 it still has a hardware error; 2 its joint carries something, so hold
    the arm and say --yes; 69 it does not answer.
    """
    from paramove.robots.dynamixel import (
        ServoLoadedError,
        check_unloaded,
        reboot_messages,
        reboot_servo,
        servo_before_reboot,
    )

    with open_arm(by_id, serial, data, baud_rate) as arm:
        servo = servo_before_reboot(arm.chain, number)
        typer.echo("\n".join(reboot_messages(servo)))
        try:
            if not yes:
                check_unloaded(arm.chain, servo)
        except ServoLoadedError as error:
            raise ended(str(error), exit_codes.USAGE) from error
        after = reboot_servo(arm.chain, number)
    if after.hardware_error:
        raise ended(f"rebooted, but {reboot_messages(after)[0]}", exit_codes.FAILURE)
    typer.echo(f"servo {number} was rebooted: no hardware error, torque off")
