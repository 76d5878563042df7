"""`paramove teach`: demonstrations by showing them to cameras."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from paramove.cli.output import ended, one_line
from paramove.cli.set_up_view import Prompts, ViewOption, prompts
from paramove.documents import exit_codes

if TYPE_CHECKING:
    from paramove.observation import BodyKeyPoints, WebcamTeacher

app = typer.Typer(name="teach", no_args_is_help=True, help="Teach a movement by showing it.")


@app.callback()
def _group() -> None:
    """Teach a movement by showing it."""


@app.command()
def webcam(
    folder: Annotated[Path, typer.Argument(metavar="SET", help="folder of the demonstration set")],
    action: Annotated[str, typer.Option("--action", metavar="NAME", help="demonstrated action, such as reach")],
    square: Annotated[
        str, typer.Option(metavar="LENGTH", help="side of a square of the board on the table, such as 30mm")
    ],
    source: Annotated[
        list[str],
        typer.Option(
            metavar="SOURCE",
            help="one per camera of the calibration: device:/dev/video0, file:VIDEO; or recording:FILE for all",
        ),
    ],
    targets: Annotated[str, typer.Option(help="what is touched: nine corners of the board")] = "board",
    cameras: Annotated[Path, typer.Option(metavar="FILE", help="calibration")] = Path("cameras.yaml"),
    person: Annotated[
        Path | None, typer.Option(metavar="FILE", help="measures of the person; needed with one camera")
    ] = None,
    subject: Annotated[str, typer.Option("--subject", help="person who demonstrates it")] = "",
    append: Annotated[bool, typer.Option("--append", help="to a set that is there already")] = False,
    view: ViewOption = False,
) -> None:
    """Record demonstrations: your arm hangs, then you touch a corner of the board and hold it there; nine times.

    The board lies on the table where the cameras were calibrated with it. A movement begins and ends by itself, is
    written at once; after a bad one the prompt is repeated. Theta is the touched position, frame of the table.

    Exit codes: 0 all corners were touched; 1 some were not; 66 no calibration, pose network or camera; 77 the set
    cannot be written; 78 there is a set already, or one camera and no person; 130 Ctrl-C: what has ended is in the set.
    """
    from paramove.action_space import read_person
    from paramove.cameras import Board, check_square_of, measured_cameras
    from paramove.cli.calibrate import length
    from paramove.cli.webcam import seen_by
    from paramove.demonstrations import TaughtSet
    from paramove.observation import WebcamTeacher, board_targets

    if targets != "board":
        raise ended(f"--targets {targets!r}: 'board' expected", exit_codes.USAGE)
    with one_line():
        calibrated = measured_cameras(Path(), cameras)
        taught = TaughtSet(
            folder, action, subject, "performed before cameras; theta is the touched position", append=append
        )
        side = length(square, "--square")
        check_square_of(cameras, side)
        places = board_targets(Board(side).corners())
        who = None if person is None else read_person(person)
        sizes, shoulder = (None, None) if who is None else (who.sizes, who.shoulder)
        teacher = WebcamTeacher(calibrated, places, taught, sizes=sizes, shoulder=shoulder)
        try:
            with prompts(f"Teach {action}", view) as to_person:
                _lead(teacher, seen_by(calibrated, source, to_person), to_person)
        except KeyboardInterrupt:
            raise ended(f"{folder}: {len(taught.written)} movements", exit_codes.CTRL_C) from None
    if not teacher.finished:
        raise ended(f"{len(taught.written)} new movements; --append goes on with the others", exit_codes.FAILURE)
    typer.echo(f"{folder}: {len(taught.written)} new; train a model with `paramove train {folder}`")


def _lead(teacher: WebcamTeacher, key_points: Iterator[tuple[str, int, BodyKeyPoints]], to_person: Prompts) -> None:
    """Until all positions are touched, or the images end."""
    to_person.prompt(teacher.prompt)
    for camera, captured_ns, points in key_points:
        happened = teacher.see(camera, captured_ns, points)
        if happened:
            to_person.prompt(teacher.prompt, happened)
        if teacher.finished:
            return
