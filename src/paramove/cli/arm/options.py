"""Options, the open port and errors of the commands about a servo arm."""

from __future__ import annotations

import contextlib
import errno
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from paramove.cli.output import ended, one_line
from paramove.documents import InputError, exit_codes
from paramove.robots.dynamixel import BY_ID_VARIABLE, DATA_VARIABLE, SerialAdapter, calibration_path, serial_adapter

if TYPE_CHECKING:
    from paramove.robots.dynamixel import ArmCalibration, ServoChain

DEFAULT_BAUD_RATE = 1_000_000
LATENCY_S = 0.1
"""No motion depends on this timeout, and an adapter or a busy machine may be slow."""

ByIdOption = Annotated[
    Path | None,
    typer.Option(
        "--by-id",
        metavar="FOLDER",
        envvar=BY_ID_VARIABLE,
        help="with links to the adapters [default: /dev/serial/by-id]",
    ),
]
SerialOption = Annotated[
    str, typer.Option("--serial", metavar="NUMBER", help="of the USB adapter; not needed if there is only one")
]
DataOption = Annotated[
    Path | None,
    typer.Option(
        "--data",
        metavar="FOLDER",
        envvar=DATA_VARIABLE,
        help="that holds calibrations [default: the user's data folder]",
    ),
]
BaudOption = Annotated[
    int, typer.Option("--baud", min=0, metavar="RATE", help="bit/s [default: as calibrated, else 1000000]")
]

RobotOption = Annotated[
    Path,
    typer.Option("--robot", metavar="FOLDER", help="with the arm's description, such as robot_description/koch_v1_1"),
]


@dataclass(frozen=True)
class OpenArm:
    """An adapter with its servos, while its port is open."""

    adapter: SerialAdapter
    chain: ServoChain
    path: Path

    def calibration(self) -> ArmCalibration:
        """Of this arm. Raises CalibrationError."""
        from paramove.robots.dynamixel import ArmCalibration

        return ArmCalibration.load(self.path, self.adapter.serial)


@contextlib.contextmanager
def open_arm(by_id: Path | None, serial: str, data: Path | None, baud_rate: int = 0) -> Iterator[OpenArm]:
    """The adapter's port, open at this baud rate or the calibrated one; ends the command, with the cause, on errors."""
    from paramove.robots.dynamixel import ServoChain, ServoPort

    with explained():
        try:
            adapter = serial_adapter(serial, by_id)
            path = calibration_path(adapter.serial, data)
            port = ServoPort(str(adapter.link), baud_rate or configured_baud_rate(path) or DEFAULT_BAUD_RATE, LATENCY_S)
            port.open()
        except InputError as error:
            raise ended(str(error), _code(error)) from error
        with contextlib.closing(port):
            yield OpenArm(adapter, ServoChain(port), path)


@contextlib.contextmanager
def explained() -> Iterator[None]:
    """Ends the command with a message on errors of a servo, the port or a file, and at Ctrl-C."""
    from paramove.robots.dynamixel import PortLostError, ServoError, ServoTimeoutError

    with one_line():
        try:
            yield
        except (ServoTimeoutError, PortLostError) as error:
            raise ended(str(error), exit_codes.UNAVAILABLE) from error
        except ServoError as error:
            raise ended(str(error), exit_codes.FAILURE) from error
        except KeyboardInterrupt:
            raise ended("interrupted", exit_codes.CTRL_C) from None


def configured_baud_rate(path: Path) -> int:
    """As calibrated, 0 without a calibration that can be read."""
    from paramove.robots.dynamixel import ArmCalibration

    try:
        return ArmCalibration.read(path).bus.baud_rate
    except InputError:
        return 0


def _code(error: InputError) -> int:
    """Of an adapter that is not there, or a port that cannot be opened."""
    if error.missing:
        return exit_codes.UNAVAILABLE
    codes: dict[int | None, int] = {
        errno.EAGAIN: exit_codes.TEMPORARY,
        errno.EBUSY: exit_codes.TEMPORARY,
        errno.EACCES: exit_codes.PERMISSION,
    }
    return codes.get(getattr(error.__cause__, "errno", None), exit_codes.CONFIGURATION)
