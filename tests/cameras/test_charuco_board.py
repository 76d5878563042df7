"""The printed board: true scale, the table frame, and that it is found, or refused, in images."""

import re

import cv2
import numpy as np
import pytest

from paramove.cameras.charuco_board import (
    MARKER_FRACTION,
    MARKERS,
    Board,
    BoardError,
    BoardFinder,
    dictionary,
    nominal_square,
)
from paramove.cameras.charuco_sheet import PAPERS, board_sheet, marker_sheet
from paramove.observation.markers import DEFAULT_MARKERS
from tests.cameras.board_scene import Sheet, blank, camera, looking, raster, rectangles_mm

MM_PER_POINT = 25.4 / 72
SIZES_MM = {"a4": (297, 210), "a3": (420, 297), "letter": (279.4, 215.9), "tabloid": (431.8, 279.4)}


def parsed(pdf):
    """Size of the page and scale of the drawing, by the PDF's own words."""
    box = re.search(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", pdf)
    matrix = re.search(rb"([\d.]+) 0 0 ([\d.]+) 0 0 cm", pdf)
    return [float(number) for number in box.groups()], [float(number) for number in matrix.groups()]


@pytest.mark.parametrize("paper", PAPERS)
def test_pages_have_their_size_and_squares_are_true(paper):
    pdf = board_sheet(paper)
    box, scale = parsed(pdf)
    np.testing.assert_allclose(np.array(box) * MM_PER_POINT, SIZES_MM[paper], rtol=0, atol=0.01)
    np.testing.assert_allclose(np.array(scale) * MM_PER_POINT, 1.0, rtol=1e-8, atol=0)  # the drawing's unit is 1 mm
    sides = np.unique(rectangles_mm(pdf)[:, 2:].round(4))
    square = PAPERS[paper].square_mm
    np.testing.assert_allclose(sides, [MARKER_FRACTION * square / 6, square], rtol=0, atol=1e-4)
    assert (rectangles_mm(pdf)[:, :2] >= 6.0).all(), "printers leave a border of 6 mm white"


def test_the_ruler_is_100_mm_long():
    lines = re.findall(rb"^([\d.]+) ([\d.]+) m ([\d.]+) ([\d.]+) l$", board_sheet(), re.M)
    x0, y0, x1, y1 = (float(number) for number in lines[0])
    assert (x1 - x0, y1 - y0) == (pytest.approx(100.0, rel=0, abs=1e-3), 0.0)
    assert len(lines) >= 12, "and it has eleven strokes"


def test_the_file_is_a_whole_pdf():
    pdf = board_sheet("a3", 0.04)
    assert pdf.startswith(b"%PDF-1.4")
    start = int(re.search(rb"startxref\n(\d+)\n%%EOF\n$", pdf)[1])
    assert pdf[start:].startswith(b"xref\n")
    places = [int(place) for place in re.findall(rb"^(\d{10}) 00000 n $", pdf[start:], re.M)]
    assert [pdf[place:].split(b" ", 1)[0] for place in places] == [b"1", b"2", b"3", b"4", b"5", b"6"]
    length, stream = re.search(rb"/Length (\d+) >>\nstream\n(.*?)\nendstream", pdf, re.S).groups()
    assert int(length) == len(stream)
    assert b"/PrintScaling /None" in pdf
    assert b"squares of 40 mm" in pdf


@pytest.mark.parametrize(("paper", "first_id"), [("a4", 0), ("a3", 20), ("letter", 0), ("tabloid", 40)])
def test_the_printed_sheet_is_found_where_it_was_drawn(paper, first_id):
    """Every corner of the raster, in the table frame: x up on the sheet, y left, origin amid the lower edge."""
    sheet, per_mm = PAPERS[paper], 4
    view = BoardFinder().find(raster(board_sheet(paper), sheet.width_mm, sheet.height_mm, per_mm))
    assert view.first_id == first_id
    assert view.corner_ids.tolist() == list(range(28))
    corners_mm = 1000 * Board.printed(sheet.square_mm / 1000).corners()
    across = (sheet.width_mm / 2 - corners_mm[:, 1]) * per_mm - 0.5
    down = (sheet.height_mm - corners_mm[:, 0]) * per_mm - 0.5
    np.testing.assert_allclose(view.points, np.stack([across, down], axis=1), rtol=0, atol=0.5)
    assert (corners_mm[:, 2] == 0).all()


def test_a_thick_board_is_higher():
    np.testing.assert_allclose(Board(0.03, thickness=0.005).corners()[:, 2], 0.005, rtol=0, atol=1e-12)


def test_words_say_how_to_lay_it():
    text = b" ".join(re.findall(rb"\((.*?)\) Tj", board_sheet()))
    for words in (b"near edge of the table", b"x forward", b"y left", b"z is up", b"100 mm", b"origin", b"30 mm"):
        assert words in text


@pytest.mark.parametrize(
    ("paper", "square", "found"),
    [("a5", None, "paper 'a5': a4"), ("a4", 0.045, "on a4 20 to 31 mm fit"), ("a4", 0.01, "10 mm found")],
)
def test_sheets_that_cannot_be(paper, square, found):
    with pytest.raises(BoardError, match=re.escape(found)):
        board_sheet(paper, square)


@pytest.mark.parametrize(
    ("square", "thickness", "found"), [(30.0, 0.0, "30000 mm found"), (0.03, 0.5, "a board of 500 mm")]
)
def test_boards_that_cannot_be(square, thickness, found):
    with pytest.raises(BoardError, match=found):
        Board(square, thickness=thickness)


@pytest.mark.parametrize("distance", [0.5, 0.9, 1.3])
def test_corners_are_found_to_a_part_of_a_pixel(distance):
    seen_by = camera(pose=looking((0.15 + 0.75 * distance, 0.25 * distance, 0.6 * distance), (0.15, 0.0, 0.0)))
    view = BoardFinder().find(Sheet("a3").seen_by(seen_by))
    assert len(view.corner_ids) >= 22
    misfit = np.linalg.norm(view.points - seen_by.project(Board.printed(0.045).corners()[view.corner_ids]), axis=1)
    assert np.sqrt(np.mean(misfit**2)) < 0.2
    assert misfit.max() < 0.6


def test_partly_hidden_boards_are_found_and_others_are_not():
    seen_by = camera(pose=looking((0.6, 0.1, 0.45), (0.12, 0.0, 0.0)))
    image, finder = Sheet().seen_by(seen_by), BoardFinder()
    whole = finder.find(image)
    hidden = image.copy()
    hidden[:, : int(np.median(whole.points[:, 0]))] = 120
    view = finder.find(hidden)
    assert 8 <= len(view.corner_ids) < len(whole.corner_ids)
    truth = seen_by.project(Board.printed(0.03).corners()[view.corner_ids])
    np.testing.assert_allclose(view.points, truth, rtol=0, atol=0.6)
    assert finder.find(blank(seen_by)) is None
    assert finder.find(cv2.flip(image, 1)) is None, "a mirrored image"
    noise = np.random.default_rng(0).integers(0, 256, image.shape, dtype=np.uint8)
    assert finder.find(noise) is None


def test_ids_tell_the_printed_size():
    assert nominal_square(Board.printed(0.03).first_id) == 0.03
    assert nominal_square(Board.printed(0.045).first_id) == 0.045
    assert nominal_square(Board.printed(0.036).first_id) is None
    assert (
        len(set(Board.printed(0.03).ids) | set(Board.printed(0.045).ids) | set(Board.printed(0.036).ids)) == 3 * MARKERS
    )


def test_markers_for_the_arm_are_found_twice_on_their_sheet():
    numbers = {name: marker.number for name, marker in DEFAULT_MARKERS.items()}
    pdf = marker_sheet(numbers, side=0.04)
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary()).detectMarkers(raster(pdf, 297, 210, 4))
    assert sorted(ids.ravel().tolist()) == sorted([*numbers.values()] * 2)
    np.testing.assert_allclose([cv2.contourArea(one) for one in corners], 160.0**2, rtol=0.03, atol=0)
    for name, number in numbers.items():
        assert f"({name} \\({number}\\)) Tj".encode() in pdf
    with pytest.raises(BoardError, match="markers of 80 mm found; 4 of 10 to 49 mm fit twice on a4"):
        marker_sheet(numbers, side=0.08)


def test_markers_of_an_arm_are_no_board():
    numbers = {name: marker.number for name, marker in DEFAULT_MARKERS.items()}
    assert BoardFinder().find(raster(marker_sheet(numbers), 297, 210, 4)) is None
