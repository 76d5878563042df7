"""The ChArUco board that cameras are calibrated with: its squares, its markers, and its detection in an image.

The board lies on the table with the lower edge of its sheet along the table's near edge. Its corners are given in the
frame "table": x forward (up on the sheet), y left, z up; the origin is the middle of the sheet's lower edge, which is
one square below the checkerboard.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from paramove.documents import Floats, Image, InputError

COLUMNS, ROWS = 8, 5
MARKERS = COLUMNS * ROWS // 2
MARKER_FRACTION = 0.75
"""Side of a marker by the side of its square: its modules are an eighth of a square."""
DICTIONARY = cv2.aruco.DICT_4X4_100
NOMINAL_SQUARES = (0.030, 0.045)
"""Sides of the squares, m, of boards whose markers encode their size: ids 0 to 19, the second 20 to 39."""
UNSIZED_BOARD_ID = MARKERS * len(NOMINAL_SQUARES)
"""First id of boards with squares of any other size."""
SQUARE_LIMITS = (0.004, 0.4)
MIN_CORNERS = 8
"""A view with fewer corners constrains the lens little, and a wrong one among them would not be detected."""
MIN_ROWS = 2
ENOUGH_TO_BEND = 14
"""With fewer corners a smooth bend of the board cannot be distinguished from a wrong detection."""
MIN_MISFIT_PX = (0.3, 0.6)
"""A corner with a smaller misfit to the others is never rejected; with a bend, and without."""
CORNER_OFFSET = 0.09
"""Where the squares around a corner are sampled, in squares along both sides: before a marker begins."""
MIN_CONTRAST = 0.3
"""Of the brighter black to the darker white square at a corner, by that of the extremes."""
MAGNIFICATIONS = (1, 2, 3)
LARGEST_PX = 4000
"""A magnified image is not wider than this: markers in it are large enough, and it would take seconds."""
AMPLE_SPACING_PX = 35.0
"""Between neighbouring corners; where they are farther apart, magnifying does not help."""
MAX_MISFIT = 0.12
"""Of a corner to the plane's perspective, in squares. A strong wide-angle lens bends the board by 0.05."""


class BoardError(InputError):
    """An impossible board; the message gives the value found and the values allowed."""


@dataclass(frozen=True)
class Board:
    """A board of 8 x 5 squares, the upper left one black, with markers in the white ones.

    Attributes:
        square: Side of a square, m.
        first_id: Id of the first marker; the others follow, row by row.
        thickness: Of the plate that the sheet is glued to, m: height of the corners above the table.

    Raises BoardError for a square or thickness that no sheet has.
    """

    square: float
    first_id: int = UNSIZED_BOARD_ID
    thickness: float = 0.0

    def __post_init__(self) -> None:
        low, high = SQUARE_LIMITS
        if not low <= self.square <= high:
            raise BoardError(
                f"squares of {self.square * 1000:g} mm found, {low * 1000:g} to {high * 1000:g} mm expected: "
                "the side of one square, such as 30mm"
            )
        if not 0.0 <= self.thickness <= 0.1:
            raise BoardError(f"a board of {self.thickness * 1000:g} mm found, 0 to 100 mm expected")

    @classmethod
    def printed(cls, square: float) -> Board:
        """The board that is printed for squares of this side, m; its markers encode a standard size."""
        standard = [index for index, nominal in enumerate(NOMINAL_SQUARES) if abs(square - nominal) < 1e-6]
        return cls(square, MARKERS * (standard[0] if standard else len(NOMINAL_SQUARES)))

    @property
    def ids(self) -> NDArray[np.int32]:
        """Ids of the markers, row by row from the upper left, [20]."""
        return np.arange(self.first_id, self.first_id + MARKERS, dtype=np.int32)

    @property
    def opencv(self) -> Any:
        """The same as a `cv2.aruco.CharucoBoard`: origin in the upper left corner, x right, y down, m."""
        size = (COLUMNS, ROWS)
        return cv2.aruco.CharucoBoard(size, self.square, MARKER_FRACTION * self.square, dictionary(), self.ids)

    def corners(self) -> Floats:
        """Inner corners of the squares, [28, 3], m, in the table frame, row by row from the upper left."""
        return self.on_table(self.opencv.getChessboardCorners())

    def on_table(self, points: NDArray[Any]) -> Floats:
        """Points [..., 3] of OpenCV's board frame in the table frame, m."""
        right, down, into = np.moveaxis(points.astype(np.float64), -1, 0)
        forward = (ROWS + 1) * self.square - down
        left = 0.5 * COLUMNS * self.square - right
        return np.stack([forward, left, self.thickness - into], axis=-1)


def nominal_square(first_id: int) -> float | None:
    """Side for which boards with these ids of markers are printed, m; None if the ids do not encode it."""
    index = first_id // MARKERS
    return NOMINAL_SQUARES[index] if index < len(NOMINAL_SQUARES) else None


def dictionary() -> Any:
    """The markers' dictionary: 4 x 4 bits, as few as possible, so that they are detected from afar."""
    return cv2.aruco.getPredefinedDictionary(DICTIONARY)


@dataclass(frozen=True)
class BoardView:
    """The detected corners of a board in one image.

    Attributes:
        name: Of the image.
        corner_ids: Numbers of the corners, [N], ascending.
        points: Their positions, [N, 2], px; the middle of the first pixel is 0.
        size: Width and height of the image, px.
        first_id: Of the board's markers.
    """

    name: str
    corner_ids: NDArray[np.int32]
    points: Floats
    size: tuple[int, int]
    first_id: int

    @property
    def nearly_whole(self) -> bool:
        """Whether at least nine of ten corners were detected."""
        return len(self.corner_ids) >= 0.9 * (COLUMNS - 1) * (ROWS - 1)

    @property
    def spacing_px(self) -> float:
        """Median distance of neighbouring corners, px."""
        between = np.linalg.norm(self.points[:, None] - self.points[None], axis=2)
        np.fill_diagonal(between, np.inf)
        return float(np.median(between.min(axis=1)))


class BoardFinder:
    """Detects any of the boards of `Board.printed` in an image."""

    def __init__(self) -> None:
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        self._markers = cv2.aruco.ArucoDetector(dictionary(), parameters)
        expected = cv2.aruco.CharucoParameters()
        expected.checkMarkers = False  # OpenCV's check rejects boards at a slant; `_agreeing` does not
        expected.minMarkers = 1
        self._detectors = {
            first: cv2.aruco.CharucoDetector(Board(NOMINAL_SQUARES[0], first).opencv, expected, parameters)
            for first in range(0, UNSIZED_BOARD_ID + 1, MARKERS)
        }

    def find(self, image: Image, name: str = "image") -> BoardView | None:
        """The board in an image [H, W] or [H, W, 3] uint8; None if there is none, or too few corners are visible.

        Small markers are detected in a magnified image only: magnifications are tried until most corners are detected.
        """
        gray: Any = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        best: BoardView | None = None
        for times in MAGNIFICATIONS:
            if times > 1 and times * max(gray.shape) > LARGEST_PX:
                break
            view = self._detected(gray, times, name)
            if view is not None and (best is None or len(view.corner_ids) >= len(best.corner_ids)):
                best = view
            if best is not None and (times > 1 or best.spacing_px > AMPLE_SPACING_PX) and best.nearly_whole:
                break
        return best

    def _detected(self, gray: Image, times: int, name: str) -> BoardView | None:
        large: Any = gray
        if times > 1:
            large = cv2.resize(gray, None, fx=times, fy=times, interpolation=cv2.INTER_CUBIC)
        marker_corners, marker_ids, _ = self._markers.detectMarkers(large)
        if marker_ids is None:
            return None
        first = _board_of(marker_ids.ravel())
        if first is None:
            return None
        corners, ids, _, _ = self._detectors[first].detectBoard(
            large, markerCorners=marker_corners, markerIds=marker_ids
        )
        if ids is None or len(ids) < MIN_CORNERS:
            return None
        order = np.argsort(ids.ravel())
        which = ids.ravel()[order].astype(np.int32)
        points = (corners.reshape(-1, 2).astype(np.float64)[order] + 0.5) / times - 0.5
        on_board = np.stack(np.divmod(which, COLUMNS - 1), axis=1)[:, ::-1].astype(np.float64)
        usable = _crossing(gray, on_board, points)
        if usable.sum() < MIN_CORNERS:
            return None
        usable[usable] = _agreeing(on_board[usable], points[usable])
        if usable.sum() < MIN_CORNERS or _on_one_line(which[usable]):
            return None
        size = (int(gray.shape[1]), int(gray.shape[0]))
        return BoardView(name, which[usable], points[usable], size, first)


def _board_of(marker_ids: NDArray[np.int32]) -> int | None:
    """First id of the board that most of the markers belong to; None for other markers, such as those on an arm."""
    counts = np.bincount(marker_ids // MARKERS)[: UNSIZED_BOARD_ID // MARKERS + 1]
    return int(np.argmax(counts)) * MARKERS if counts.any() else None


def _crossing(gray: Image, on_board: Floats, in_image: Floats) -> NDArray[np.bool_]:
    """Whether two black and two white squares meet at each corner, [N]: not where a finger hides one of them."""
    homography, _ = cv2.findHomography(on_board, in_image, cv2.RANSAC, 3.0)
    if homography is None:
        return np.zeros(len(on_board), dtype=np.bool_)
    aside = CORNER_OFFSET * np.array([[-1.0, -1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, 1.0]])
    around = cv2.perspectiveTransform((on_board[:, None] + aside).reshape(-1, 1, 2), homography).reshape(-1, 4, 2)
    around = around + in_image[:, None] - cv2.perspectiveTransform(on_board[:, None], homography)
    levels = cv2.remap(gray, around.astype(np.float32), np.empty(0), cv2.INTER_LINEAR).astype(np.float64)
    even = on_board.sum(axis=1) % 2 == 0  # the upper left square is black, and so the lower right one
    black = np.where(even[:, None], levels[:, :2], levels[:, 2:])
    white = np.where(even[:, None], levels[:, 2:], levels[:, :2])
    contrast = white.max(axis=1) - black.min(axis=1)
    return np.asarray(white.min(axis=1) - black.max(axis=1) > MIN_CONTRAST * contrast)


def _agreeing(on_board: Floats, in_image: Floats) -> NDArray[np.bool_]:
    """Whether each corner agrees with a view of a plane, [N].

    First with a perspective view, within the tolerance of a lens; then with a smooth bend: the remaining distances are
    fitted by a quadratic of the position on the board, and corners with a large misfit are rejected.
    """
    homography, inliers = cv2.findHomography(in_image, on_board, cv2.RANSAC, MAX_MISFIT)
    if homography is None or inliers is None:
        return np.zeros(len(on_board), dtype=np.bool_)
    usable = np.asarray(inliers.ravel() > 0)
    while usable.sum() >= MIN_CORNERS:
        view, _ = cv2.findHomography(on_board[usable], in_image[usable])
        projected = cv2.perspectiveTransform(on_board[:, None], view)[:, 0]
        x, y = (on_board - on_board.mean(axis=0)).T
        bends = usable.sum() >= ENOUGH_TO_BEND
        terms = np.column_stack([np.ones_like(x), x, y, *([x * x, x * y, y * y] if bends else [])])
        weights = np.linalg.lstsq(terms[usable], (in_image - projected)[usable], rcond=None)[0]
        misfit = np.linalg.norm(in_image - projected - terms @ weights, axis=1)
        limit = max(MIN_MISFIT_PX[0 if bends else 1], 4.0 * float(np.median(misfit[usable])))
        worst = int(np.argmax(np.where(usable, misfit, 0.0)))  # one at a time, as it bends the others' fit
        if misfit[worst] <= limit:
            break
        usable[worst] = False
    return usable


def _on_one_line(corner_ids: NDArray[np.int32]) -> bool:
    rows, columns = np.divmod(corner_ids, COLUMNS - 1)
    return len(set(rows.tolist())) < MIN_ROWS or len(set(columns.tolist())) < MIN_ROWS
