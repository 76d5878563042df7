"""Printable sheets, as PDF in true scale: the calibration board, and markers for a person's arm.

Everything is drawn as vectors in millimetres; one matrix converts them to points. The sheet shows how to lay it on the
table, and has a line of 100 mm to check the printer's scale.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2

from paramove.cameras.charuco_board import COLUMNS, MARKER_FRACTION, ROWS, Board, BoardError, dictionary

POINTS_PER_MM = 72.0 / 25.4
UNPRINTED_MM = 6.0
"""Border that common printers leave white."""
HEAD_MM = 19.0
"""Minimum height above the checkerboard, for the ruler and its text."""
MIN_SQUARE_MM = 20.0
"""The margin below the checkerboard is one square high; the text needs this much."""
RULER_MM = 100.0
MODULES = 6
"""Of a marker's side: 4 bits and a black border."""


@dataclass(frozen=True)
class Paper:
    """A sheet, lying on its long side, mm; and the squares that fill it, mm."""

    width_mm: float
    height_mm: float
    square_mm: float


PAPERS = {
    "a4": Paper(297.0, 210.0, 30.0),
    "a3": Paper(420.0, 297.0, 45.0),
    "letter": Paper(279.4, 215.9, 30.0),
    "tabloid": Paper(431.8, 279.4, 40.0),
}


def board_sheet(paper: str = "a4", square: float | None = None) -> bytes:
    """The PDF of a board on a sheet of `PAPERS`, with squares of a side in m (default: the paper's own).

    Raises BoardError for an unknown paper and for squares that do not fit it.
    """
    if paper not in PAPERS:
        raise BoardError(f"unknown paper {paper!r}: {', '.join(PAPERS)} expected")
    sheet = PAPERS[paper]
    square_mm = sheet.square_mm if square is None else 1000.0 * square
    maximum = min((sheet.width_mm - 2 * UNPRINTED_MM) / COLUMNS, (sheet.height_mm - HEAD_MM) / (ROWS + 1))
    if not MIN_SQUARE_MM <= square_mm <= maximum:
        raise BoardError(
            f"squares of {square_mm:g} mm found; on {paper} {MIN_SQUARE_MM:g} to {int(maximum)} mm fit, "
            "with the text around them"
        )
    drawing = _chequers(Board.printed(square_mm / 1000.0), sheet)
    drawing += _ruler(sheet, ROWS * square_mm + square_mm)
    drawing += _directions(sheet, square_mm)
    return _document(sheet, drawing, f"ChArUco board, squares of {square_mm:g} mm, {paper}")


def marker_sheet(numbers: Mapping[str, int], side: float = 0.045, paper: str = "a4") -> bytes:
    """The PDF of markers to be cut out, two of each, with the names of the points that they are for.

    Args:
        numbers: Name of a point -> id of its marker. side: Of a marker's black square, m. paper: One of `PAPERS`.

    Raises BoardError for an unknown paper and for markers that do not fit it.
    """
    if paper not in PAPERS:
        raise BoardError(f"unknown paper {paper!r}: {', '.join(PAPERS)} expected")
    sheet, side_mm = PAPERS[paper], 1000.0 * side
    cell = side_mm * (1.0 + 2.0 / MODULES)  # a white module around it, needed for its detection
    pitch, maximum = cell + 4.0, min((sheet.width_mm - 16.0) / len(numbers), (sheet.height_mm - 40.0) / 2) - 4.0
    largest = int(maximum / (1.0 + 2.0 / MODULES))
    if not 10.0 <= side_mm <= largest:
        raise BoardError(
            f"markers of {side_mm:g} mm found; {len(numbers)} of 10 to {largest} mm fit twice on {paper}, with borders"
        )
    black, frames, words = [], [], []
    for row, (column, (name, number)) in itertools.product(range(2), enumerate(numbers.items())):
        x = sheet.width_mm / 2 + (column - 0.5 * len(numbers)) * pitch + 2.0
        y = sheet.height_mm - 20.0 - cell - row * (cell + 12.0)
        black += _modules(number, x + side_mm / MODULES, y + side_mm / MODULES, side_mm / MODULES)
        frames.append(_rectangle(x, y, cell, cell))
        words += _text(x, y - 4.0, 3.2, f"{name} ({number})")
    advice = "Cut along the lines and keep the white borders. Wear one of each; the others are spare."
    words += _text(sheet.width_mm / 2 - 74.0, sheet.height_mm - 14.0, 3.2, advice)
    drawing = ["0 g", *black, "f", "0.1 w", *frames, "S", *words]
    return _document(sheet, drawing, f"Markers of {side_mm:g} mm, {paper}")


def _chequers(board: Board, sheet: Paper) -> list[str]:
    """Black squares and markers as one path, so that no hairlines appear between neighbours."""
    side = 1000.0 * board.square
    gap = 0.5 * (1.0 - MARKER_FRACTION) * side
    left, upper = sheet.width_mm / 2 - COLUMNS / 2 * side, (ROWS + 1) * side
    path = []
    markers = iter(board.ids)
    for row in range(ROWS):
        for column in range(COLUMNS):
            x, y = left + column * side, upper - (row + 1) * side
            if (row + column) % 2 == 0:
                path.append(_rectangle(x, y, side, side))
            else:
                path += _modules(int(next(markers)), x + gap, y + gap, MARKER_FRACTION * side / MODULES)
    return ["0 g", *path, "f"]


def _modules(number: int, x: float, y: float, module: float) -> list[str]:
    """Black modules of a marker whose lower left corner is (x, y); `module` is the side of one, mm."""
    modules = cv2.aruco.generateImageMarker(dictionary(), number, MODULES, borderBits=1)
    return [
        _rectangle(x + column * module, y + (MODULES - 1 - row) * module, module, module)
        for row in range(MODULES)
        for column in range(MODULES)
        if modules[row, column] == 0
    ]


def _ruler(sheet: Paper, above_mm: float) -> list[str]:
    """A line of 100 mm with a stroke every 10 mm, in the margin above the checkerboard."""
    x, y = sheet.width_mm / 2 - RULER_MM / 2, above_mm + 5.0
    strokes = [f"{x:.4f} {y:.4f} m {x + RULER_MM:.4f} {y:.4f} l"]
    for tenth in range(11):
        height = 3.0 if tenth % 5 == 0 else 1.8
        at = x + tenth * RULER_MM / 10
        strokes.append(f"{at:.4f} {y:.4f} m {at:.4f} {y + height:.4f} l")
    words = "This line must be 100 mm long. Print at 100 %, not fitted to the page; else measure a square and say so."
    return ["0.25 w", *strokes, "S", *_text(sheet.width_mm / 2 - 74.0, y + 5.0, 3.2, words)]


def _directions(sheet: Paper, square_mm: float) -> list[str]:
    """Where the person sits, where the edge is to be laid, and the axes of the table frame."""
    middle, foot = sheet.width_mm / 2, square_mm - 3.0
    origin = [f"{middle - 2:.4f} {UNPRINTED_MM + 1:.4f} m {middle + 2:.4f} {UNPRINTED_MM + 1:.4f} l"]
    origin += [f"{middle:.4f} 0.2 l h f"]
    forward = _arrow(middle, UNPRINTED_MM + 1.0, 0.0, min(foot - UNPRINTED_MM - 1.0, 18.0))
    left = _arrow(middle, UNPRINTED_MM + 1.0, -22.0, 0.0)
    y = UNPRINTED_MM + 1.0
    lines = [
        "Lay this edge along the near edge of the table,",
        "the triangle in front of the person's chest.",
        f"Squares: {square_mm:g} mm. z is up.",
    ]
    words = [
        *_text(middle + 2.0, foot - 5.0, 3.6, "x forward"),
        *_text(middle - 38.0, y + 2.0, 3.6, "y left"),
        *_text(middle + 3.0, y, 3.0, "origin: middle of this edge"),
    ]
    for number, line in enumerate(lines):
        words += _text(middle - 120.0, foot - 4.5 - 4.2 * number, 3.0, line)
    return ["0 g", *origin, *forward, *left, *words]


def _arrow(x: float, y: float, dx: float, dy: float) -> list[str]:
    """An arrow from (x, y), along one axis, with a filled head of 3 mm."""
    length = abs(dx) + abs(dy)
    ux, uy = dx / length, dy / length
    neck_x, neck_y = x + dx - 3.0 * ux, y + dy - 3.0 * uy
    head = f"{x + dx:.4f} {y + dy:.4f} m {neck_x - 1.2 * uy:.4f} {neck_y + 1.2 * ux:.4f} l "
    head += f"{neck_x + 1.2 * uy:.4f} {neck_y - 1.2 * ux:.4f} l h f"
    return ["0.6 w", f"{x:.4f} {y:.4f} m {neck_x:.4f} {neck_y:.4f} l S", head]


def _text(x: float, y: float, size_mm: float, words: str) -> list[str]:
    escaped = words.replace("\\", r"\\").replace("(", r"\(").replace(")", r"\)")
    return [f"BT /F {size_mm:g} Tf {x:.4f} {y:.4f} Td ({escaped}) Tj ET"]


def _rectangle(x: float, y: float, width: float, height: float) -> str:
    return f"{x:.4f} {y:.4f} {width:.4f} {height:.4f} re"


def _document(sheet: Paper, drawing: Sequence[str], title: str) -> bytes:
    """A PDF 1.4 of one page. Viewers are asked not to scale it when it is printed."""
    scale = f"{POINTS_PER_MM:.9f}"
    content = "\n".join([f"{scale} 0 0 {scale} 0 0 cm", *drawing]).encode("ascii")
    box = f"0 0 {sheet.width_mm * POINTS_PER_MM:.4f} {sheet.height_mm * POINTS_PER_MM:.4f}"
    resources = "/Resources << /Font << /F 5 0 R >> >>"
    objects = [
        b"<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox [{box}] {resources} /Contents 4 0 R >>".encode("ascii"),
        f"<< /Length {len(content)} >>\nstream\n".encode("ascii") + content + b"\nendstream",
        b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
        f"<< /Title ({title}) >>".encode("ascii"),
    ]
    document, offsets = b"%PDF-1.4\n", []
    for number, body in enumerate(objects, 1):
        offsets.append(len(document))
        document += f"{number} 0 obj\n".encode("ascii") + body + b"\nendobj\n"
    table = f"xref\n0 {len(objects) + 1}\n0000000000 65535 f \n" + "".join(f"{at:010d} 00000 n \n" for at in offsets)
    trailer = f"trailer\n<< /Size {len(objects) + 1} /Root 1 0 R /Info 6 0 R >>\nstartxref\n{len(document)}\n%%EOF\n"
    return document + (table + trailer).encode("ascii")
