"""`paramove webcam`: what tracking with a webcam needs once: the pose network, and the person's measures."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from paramove.cli.output import ended, one_line
from paramove.cli.set_up_view import Prompts, ViewOption, begun, prompts
from paramove.documents import InputError, exit_codes

if TYPE_CHECKING:
    from paramove.cameras import CalibratedCamera
    from paramove.documents import Image
    from paramove.observation import BodyKeyPoints, MeasuredArm

app = typer.Typer(name="webcam", no_args_is_help=True, help="Track a person with a webcam.")

SOURCE = "device:/dev/video0, file:VIDEO, folder:PICTURES@RATE, or recording:FILE of a run"
BOARD_LOOKS = 5
CHEST_M = 0.08
"""The joints of the shoulders are so much farther away than a board that is held at the chest."""


@app.command()
def setup(
    wheel: Annotated[
        Path | None, typer.Option(metavar="FILE", help="the package as a file, for a machine without network")
    ] = None,
    heavy: Annotated[
        bool, typer.Option("--heavy", help="also a slower, more exact one for video files (41 MB, needs npm)")
    ] = False,
    heavy_package: Annotated[Path | None, typer.Option(metavar="FILE", help="the same as a file")] = None,
) -> None:
    """Fetch the pose network that finds a person's arms in pictures (35.6 MB, once), and check it.

    Exit codes: 0 it is there; 66 it could not be had.
    """
    from paramove.observation import HEAVY, fetch_networks, stored_network

    try:
        folder = fetch_networks(wheel)
        if heavy or heavy_package is not None:
            fetch_networks(heavy_package, package=HEAVY)
        stored_network(folder, offline=True)
    except InputError as error:
        raise ended(str(error), exit_codes.INPUT_MISSING) from error
    typer.echo(f"the pose network is in {folder}")


@app.command()
def look(
    source: Annotated[
        str, typer.Option(metavar="SOURCE", help="device:/dev/video0, file:VIDEO or folder:PICTURES@RATE")
    ],
    size: Annotated[str, typer.Option(metavar="WxH", help="resolution; files have their own")] = "640x480",
    view: ViewOption = False,
) -> None:
    """Try a camera in the first minute, uncalibrated: where the right arm points, once a second, and what is wrong.

    Directions only, of the picture: 0, 0 is the camera's axis, away from it; without a calibration nothing is known of
    distances, and a direction towards the camera may be 20 degrees off. Ctrl-C ends it.

    Exit codes: 0 the file has ended, or Ctrl-C; 66 no pose network or camera; 78 a source of no use.
    """
    import numpy as np

    from paramove.cameras import CalibratedCamera
    from paramove.cli.calibrate import pixels
    from paramove.observation import checked_networks

    with one_line(), contextlib.suppress(KeyboardInterrupt):
        width, height = pixels(size)
        checked_networks()
        camera = CalibratedCamera("webcam", width, height, np.diag([width, width, 1.0]), np.zeros(0), np.eye(4))
        latest_s = -1.0
        with prompts("Try the camera", view) as to_person:
            for _, captured_ns, points in seen_by([camera], [source], to_person):
                x, y, z = points.arm_direction
                if captured_ns * 1e-9 - latest_s >= 1.0 and np.isfinite(z):
                    latest_s = captured_ns * 1e-9
                    aside, up = np.degrees(np.arctan2(x, np.hypot(y, z))), np.degrees(np.arctan2(-y, np.hypot(x, z)))
                    towards = "towards the camera" if z < 0.0 else "away from the camera"
                    to_person.prompt(
                        f"right arm: {abs(aside):.0f} deg to the picture's {'right' if aside > 0 else 'left'}, "
                        f"{abs(up):.0f} deg {'up' if up > 0 else 'down'}, {towards}; uncalibrated: directions only"
                    )


@app.command()
def person(
    out: Annotated[Path, typer.Option(metavar="FILE", help="YAML file to write; an existing one is overwritten")],
    source: Annotated[str, typer.Option(metavar="SOURCE", help=SOURCE)],
    cameras: Annotated[Path, typer.Option(metavar="FILE", help="calibration; the first camera is used")] = Path(
        "cameras.yaml"
    ),
    square: Annotated[
        str | None, typer.Option(metavar="LENGTH", help="of the board, which you then hold at your chest: best")
    ] = None,
    distance: Annotated[
        str | None, typer.Option(metavar="LENGTH", help="of your right shoulder from the camera, such as 1.5m")
    ] = None,
    height: Annotated[str | None, typer.Option(metavar="LENGTH", help="your height, such as 1.75m")] = None,
    view: ViewOption = False,
) -> None:
    """Measure a person without a ruler: follow the prompts for ten seconds.

    How large you are follows from the board at your chest, from the distance or from your height; without any, from
    the height of a mean adult.

    Exit codes: 0 written; 1 the images ended before; 66 no calibration, pose network or camera; 77 not allowed to
    write; 78 a wrong length, a damaged network, or images of no use.
    """
    from paramove.action_space import Person, write_person
    from paramove.cameras import check_square_of, measured_cameras
    from paramove.cli.calibrate import length
    from paramove.observation import checked_networks

    with one_line():
        if (square, distance, height) == (None, None, None):
            typer.echo("no --square, --distance or --height: a mean adult of 1.70 m is assumed")
        camera = measured_cameras(Path(), cameras)[0]
        far = None if distance is None else length(distance, "--distance")
        tall = None if height is None else length(height, "--height")
        live = not source.startswith("recording:")
        if live:
            checked_networks()
        with prompts("Measure a person", view) as to_person:
            images = _images([camera], [source], to_person) if live else None
            if square is not None:
                side = length(square, "--square")
                check_square_of(cameras, side)
                far = _at_chest(camera, images, side, to_person)
            arm = _measured(camera, source, images, to_person, far, tall)
        sizes = {"upper_arm": arm.upper_arm, "forearm": arm.forearm, "hand": arm.hand}
        write_person(out, Person(shoulder=tuple(arm.shoulder), **sizes))
    typer.echo(f"{out}: written; the shoulder is in the frame of the table")


def as_source(text: str) -> str:
    """A camera may be named by its path, number or URL alone."""
    from paramove.cameras import is_network_camera

    return f"device:{text}" if text.isdigit() or text.startswith("/dev/") or is_network_camera(text) else text


def _measured(
    camera: CalibratedCamera, source: str, images: Iterator[tuple[CalibratedCamera, int, Image]] | None,
    to_person: Prompts, distance: float | None, height: float | None,
) -> MeasuredArm:  # fmt: skip
    """The arm of a person who follows the prompts."""
    from paramove.observation import PersonSetUp

    set_up = PersonSetUp(camera, distance=distance, height=height)
    to_person.prompt(set_up.prompt)
    for name, _, points in seen_by([camera], [source], to_person, images):
        if name != camera.name:
            continue
        happened = set_up.see(points)
        if happened:
            to_person.prompt(set_up.prompt, happened)
        if set_up.arm is not None:
            return set_up.arm
    raise ended("the images ended before the person was measured", exit_codes.FAILURE)


def _images(
    cameras: Sequence[CalibratedCamera], sources: Sequence[str], to_person: Prompts
) -> Iterator[tuple[CalibratedCamera, int, Image]]:
    """Images of sources as named on the command line; the page shows those of the first camera on their way."""
    from paramove.observation import images_of

    images = begun(images_of(cameras, [as_source(source) for source in sources]))
    return images if to_person.page is None else to_person.page.passing(images, cameras[0].name)


def _at_chest(
    camera: CalibratedCamera, images: Iterator[tuple[CalibratedCamera, int, Image]] | None, square: float,
    to_person: Prompts,
) -> float:  # fmt: skip
    """Distance of the shoulder, m, by a board that is held at the chest."""
    import numpy as np

    from paramove.cameras import Board, BoardFinder, board_depth

    if images is None:
        raise InputError("--square needs images of the board: a recording of key points has none")
    to_person.prompt("hold the board flat at your chest, towards the camera")
    finder, depths = BoardFinder(), list[float]()
    for _, _, image in images:
        view = finder.find(image)
        if view is not None:
            depths.append(board_depth(camera, view, Board(square)))
        if len(depths) == BOARD_LOOKS:
            break
    if len(depths) < BOARD_LOOKS:
        raise InputError("the images ended before the board was detected at the chest")
    far = float(np.median(depths)) + CHEST_M
    to_person.prompt(f"your shoulder is {far:.2f} m from the camera; put the board away")
    return far


def seen_by(
    cameras: Sequence[CalibratedCamera], sources: Sequence[str], to_person: Prompts,
    images: Iterator[tuple[CalibratedCamera, int, Image]] | None = None,
) -> Iterator[tuple[str, int, BodyKeyPoints]]:  # fmt: skip
    """Camera, capture time, ns, and key points of images, or of sources as named on the command line.

    `to_person` shows both, unless the images are given, and what is wrong with the pictures.
    """
    from paramove.observation import detected_key_points, recorded_key_points

    if sources[0].startswith("recording:"):
        return recorded_key_points(Path(sources[0].removeprefix("recording:")))
    if len(sources) != len(cameras):
        raise InputError(f"{len(cameras)} cameras are calibrated, {len(sources)} sources given: one --source for each")
    offline = not any(as_source(source).startswith("device:") for source in sources)
    found = detected_key_points(
        _images(cameras, sources, to_person) if images is None else images,
        lambda trouble: to_person.report(trouble or "all is well again"),
        offline=offline,
    )
    return found if to_person.page is None else to_person.page.drawing(found, cameras[0].name)
