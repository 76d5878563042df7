"""`paramove calibrate`: print the board and markers, and find lens and pose of cameras from images of the board."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from paramove.cli.output import one_line
from paramove.cli.set_up_view import Prompts, ViewOption, begun, prompts
from paramove.documents import InputError, printable

if TYPE_CHECKING:
    from paramove.cameras import Board, BoardView, ImageSource, Lens, Placement
    from paramove.documents import Image

app = typer.Typer(name="calibrate", no_args_is_help=True, help="Print the calibration board; calibrate cameras.")

LENGTH = re.compile(r"\s*(\d+(?:\.\d+)?)\s*(mm|cm|m)\s*")
PER_M = {"mm": 1000.0, "cm": 100.0, "m": 1.0}
LIVE_SIZE = "1280x720"
LIVE_TIMEOUT_NS = 10_000_000_000
"""A camera that is switched on may take seconds to its first frame."""


@app.command("board")
def board(
    out: Annotated[Path, typer.Option(metavar="FILE", help="PDF to write; an existing one is overwritten")],
    paper: Annotated[str, typer.Option(help="a4, a3, letter or tabloid")] = "a4",
    square: Annotated[
        str | None, typer.Option(metavar="LENGTH", help="side of a square, such as 30mm; default: what fills the paper")
    ] = None,
) -> None:
    """Write a ChArUco board as PDF in true scale, with instructions how to lay it on the table.

    Exit codes: 0 written; 77 not allowed to write; 78 no such board.
    """
    from paramove.cameras import PAPERS, board_sheet

    with one_line():
        side = None if square is None else length(square, "--square")
        out.write_bytes(board_sheet(paper, side))
    square_mm = PAPERS[paper].square_mm if side is None else 1000.0 * side
    typer.echo(f"{out}: squares of {square_mm:g} mm on {paper}")
    typer.echo("print it at 100 % (not fitted to the page), check its line of 100 mm, glue it to a flat plate")


@app.command("markers")
def markers(
    out: Annotated[Path, typer.Option(metavar="FILE", help="PDF to write; an existing one is overwritten")],
    side: Annotated[str, typer.Option(metavar="LENGTH", help="of a marker's black square")] = "45mm",
    paper: Annotated[str, typer.Option(help="a4, a3, letter or tabloid")] = "a4",
) -> None:
    """Write markers for a person's shoulder, elbow, wrist and hand as PDF in true scale.

    Exit codes: 0 written; 77 not allowed to write; 78 no such markers.
    """
    from paramove.cameras import marker_sheet
    from paramove.observation import DEFAULT_MARKERS, ArucoMarker

    numbers = {name: marker.number for name, marker in DEFAULT_MARKERS.items() if isinstance(marker, ArucoMarker)}
    with one_line():
        out.write_bytes(marker_sheet(numbers, length(side, "--side"), paper))
    typer.echo(f"{out}: markers of {side} for {', '.join(numbers)}, two of each")


@app.command("cameras")
def cameras(
    sources: Annotated[
        list[str],
        typer.Argument(
            metavar="SOURCE...",
            help="one per camera: a folder with images, a video file, or a live camera (0, /dev/video0)",
        ),
    ],
    out: Annotated[Path, typer.Option(metavar="FILE", help="YAML file to write; an existing one is overwritten")],
    square: Annotated[
        str, typer.Option(metavar="LENGTH", help="side of a square as measured on the print, such as 30mm")
    ],
    thickness: Annotated[
        str, typer.Option(metavar="LENGTH", help="of the plate that the sheet is glued to, such as 5mm")
    ] = "0mm",
    size: Annotated[
        str, typer.Option(metavar="WxH", help="resolution requested from live cameras; files have their own")
    ] = LIVE_SIZE,
    view: ViewOption = False,
) -> None:
    """Find lens and pose of cameras from images of the board; all poses in the frame of the table.

    Images of a folder whose names begin with "table", and the last second of a video, show the board as it lies on the
    table, at the same position for all cameras; the others show it at many angles.

    Exit codes: 0 written; 66 no such source; 77 not allowed to write; 78 images that do not calibrate, with the cause.
    """
    from paramove.cameras import Board, write_cameras

    with one_line():
        with prompts("Calibrate cameras", view) as to_person:
            side = length(square, "--square")
            board = Board(side, thickness=length(thickness, "--thickness"))
            placed = _calibrated(sources, board, pixels(size), to_person)
        write_cameras(out, [placement.camera for placement in placed], side)
    typer.echo(f"{out}: {len(placed)} camera{'s' * (len(placed) > 1)} in the frame 'table'")


def length(text: str, option: str) -> float:
    """A length such as 30mm, 3cm or 0.03m in m. Raises InputError for a text without unit."""
    match = LENGTH.fullmatch(text)
    if match is None:
        raise InputError(f"{option} {text!r}: a length with its unit expected, such as 30mm, 3cm or 0.03m")
    return float(match[1]) / PER_M[match[2]]


def pixels(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d+)x(\d+)", text)
    if match is None:
        raise InputError(f"--size {text!r}: width and height in pixels expected, such as {LIVE_SIZE}")
    return int(match[1]), int(match[2])


def _calibrated(texts: Sequence[str], board: Board, size: tuple[int, int], to_person: Prompts) -> list[Placement]:
    """First all lenses, then all poses: the board lies on the table once for all cameras."""
    from paramove.cameras import CalibrationError, calibrate_lens, check_square, place_camera

    sources = [_source(text, size, to_person) for text in texts]
    names = [source.name for source in sources]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"two sources are named {twice!r}: cameras are named after their folder or file; rename one")
    lenses: list[Lens] = []
    views_of_all: list[BoardView] = []
    for source in sources:
        held = source.held()
        if not held.views:
            raise CalibrationError(
                f"{source.name}: board not found in any of {held.looked_at} images: it must be one of `paramove "
                "calibrate board`, flat, sharp and large in the image (a square 10 px or more), and not mirrored"
            )
        views_of_all += held.views
        remarks = check_square(board, views_of_all)
        lens = calibrate_lens(source.name, held.views, board)
        _print_lens(lens, held.looked_at)
        lenses.append(lens)
    for remark in remarks:
        typer.echo(f"  {remark}")
    placed = []
    if any(_is_live(text) for text in texts):
        to_person.prompt("now lay the board on the table as printed on it, in view of all cameras, and leave it there")
    for source, lens in zip(sources, lenses, strict=True):
        views = source.table().views
        check_square(board, [*views_of_all, *views])
        placed.append(place_camera(lens, views, board))
        _tell_place(placed[-1])
    _tell_agreement(placed, board)
    return placed


def _print_lens(lens: Lens, looked_at: int) -> None:
    from paramove.cameras import GOOD_ERROR_PX

    verdict = "good" if lens.error_px < GOOD_ERROR_PX else f"not good, < {GOOD_ERROR_PX:g} px is"
    focal = 0.5 * (lens.matrix[0, 0] + lens.matrix[1, 1])
    typer.echo(
        printable(f"{lens.name}: {lens.size[0]} x {lens.size[1]} px, {len(lens.used)} views of {looked_at} images")
    )
    typer.echo(f"  reprojection error {lens.error_px:.2f} px ({verdict})")
    typer.echo(f"  focal length {focal:.1f} ± {lens.focal_sd_px:.1f} px, distortion k1 {lens.distortion[0]:.3f}")
    if lens.left_out:
        typer.echo(printable(f"  left out, as they do not agree with the others: {', '.join(lens.left_out)}"))
    for advice in lens.advice():
        typer.echo(f"  to do better: {advice}")


def _tell_place(placement: Placement) -> None:
    x, y, z = placement.camera.position
    name, error_px = printable(placement.camera.name), placement.error_px
    typer.echo(
        f"{name}: stands at x {x:.3f}, y {y:.3f}, z {z:.3f} m (± {placement.position_sd * 1000:.1f} mm, direction ± "
        f"{placement.turn_sd_deg:.2f} deg), error on the table {error_px:.2f} px"
    )
    if error_px >= 1.0:
        typer.echo("  the board on the table does not fit the lens: is it flat, and was focus or zoom changed?")


def _tell_agreement(placed: Sequence[Placement], board: Board) -> None:
    """Prints the accuracy of the board's corners as triangulated by all cameras."""
    if len(placed) < 2:
        return
    import numpy as np

    from paramove.cameras import StereoRig

    rig = StereoRig([placement.camera for placement in placed])
    corners = board.corners()
    pixels = np.stack([placement.camera.project(corners) for placement in placed])
    points = rig.triangulate(pixels, sigma_px=max(0.1, *(placement.error_px for placement in placed)))
    deviation_mm = 1000.0 * float(np.nanmedian(points.deviations))
    typer.echo(f"together: accuracy of a point on the board that all see ± {deviation_mm:.1f} mm")


def _is_live(text: str) -> bool:
    from paramove.cameras import is_network_camera

    text = text.removeprefix("device:")
    return text.isdigit() or text.startswith("/dev/") or is_network_camera(text)


def _source(text: str, size: tuple[int, int], to_person: Prompts) -> ImageSource:
    from paramove.cameras import LiveImages, file_source, without_password

    text = text.removeprefix("device:").removeprefix("file:")
    if not _is_live(text):
        return file_source(Path(text))
    host = re.match(r"\w+://([^/:?#]+)", without_password(text))
    name = f"camera{text}" if text.isdigit() else host[1] if host else Path(text).name
    return LiveImages(name, _shown(begun(_live_frames(text, size)), to_person), to_person.prompt)


def _shown(frames: Iterator[tuple[float, Image]], to_person: Prompts) -> Iterator[tuple[float, Image]]:
    """The same frames, which the page shows on their way."""
    for time_s, image in frames:
        if to_person.page is not None:
            to_person.page.show(image)
        yield time_s, image


def _live_frames(device: str, size: tuple[int, int]) -> Iterator[tuple[float, Image]]:
    """Frames of a camera without end, with the time since the first, s."""
    from paramove.cameras import DeviceFrames, FrameError

    frames = DeviceFrames(device, *size, timeout_ns=LIVE_TIMEOUT_NS)
    try:
        while True:
            now_ns = time.monotonic_ns()
            frame = frames.frame(now_ns)
            if frame is None:
                time.sleep(0.005)
            else:
                yield now_ns * 1e-9, frame.image_bgr
    except FrameError as error:
        raise InputError(str(error)) from error
    finally:
        frames.close()
