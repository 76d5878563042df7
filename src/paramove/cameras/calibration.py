"""Lens of a camera from images of the ChArUco board (Zhang 2000, as in OpenCV); unsuitable images are rejected.

The lens comes from views of the board at many angles; `placement` derives the pose in the table frame from views in
which the board lies on the table. Image points: the middle of the first pixel is 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from paramove.cameras.charuco_board import Board, BoardView, nominal_square
from paramove.documents import Floats, InputError

MIN_VIEWS = 6
GOOD_VIEWS = 15
GOOD_ERROR_PX, POOR_ERROR_PX = 0.5, 1.0
MIN_TILT_DEG = 7.0
"""Root mean square angle of the boards to their mean direction; a hand that turns the board reaches 20 to 30."""
MAX_FOCAL_SD = 0.015
"""Maximum relative standard deviation of the focal length: 15 mm of distance at 1 m."""
OUTLIER_FACTOR, OUTLIER_PX = 3.0, 1.0
MAX_OUTLIERS = 0.25
SCALE_TOLERANCE, SCALE_SUSPICION = 0.005, 0.15
"""A printer that fits to the page changes sizes by 3 to 6 %. A difference above 15 % means another board."""
GRID = 4
"""Cells across and down the image in which corners should be detected."""
RADIAL_GAIN = 0.8
"""A third radial coefficient is used if it lowers the error below this fraction."""


class CalibrationError(InputError):
    """Images that cannot calibrate a camera; the message names what is missing and the remedy."""


@dataclass(frozen=True)
class Lens:
    """Lens of one camera.

    Attributes:
        name: Of the camera.
        size: Width and height of the image, px.
        matrix: [3, 3], px. distortion: [5] in OpenCV's order k1 k2 p1 p2 k3.
        error_px: Root mean square reprojection error of the corners. view_errors_px: The same of each used view.
        focal_sd_px, centre_sd_px: Standard deviations of the focal length and of the image's centre.
        tilt_deg: Root mean square angle of the boards to their mean direction.
        covered: Fraction of the image, in cells of a 4 x 4 grid, in which corners were detected.
        used, left_out: Names of the views that were used, and of those rejected as outliers.
    """

    name: str
    size: tuple[int, int]
    matrix: Floats
    distortion: Floats
    error_px: float
    view_errors_px: Floats
    focal_sd_px: float
    centre_sd_px: float
    tilt_deg: float
    covered: float
    used: tuple[str, ...]
    left_out: tuple[str, ...] = ()

    def advice(self) -> list[str]:
        """Advice for a better calibration; empty if it is good."""
        advice = []
        if self.error_px >= GOOD_ERROR_PX:
            degree = "poor" if self.error_px >= POOR_ERROR_PX else "usable, not good"
            advice.append(
                f"{self.error_px:.2f} px is {degree} (good: < {GOOD_ERROR_PX:g} px): hold the board still, with more "
                "light against blur, glue it to a flat plate, and switch the camera's autofocus off"
            )
        if len(self.used) < GOOD_VIEWS:
            advice.append(f"{len(self.used)} views were used; take {GOOD_VIEWS} or more")
        if self.tilt_deg < 2 * MIN_TILT_DEG:
            advice.append(f"the board was tilted by only {self.tilt_deg:.0f} deg: tilt it by 30 to 45 deg to all sides")
        if self.covered < 0.75:
            advice.append(
                f"corners were detected in {self.covered:.0%} of the image: hold the board near "
                "its borders and corners too"
            )
        return advice


def check_square(board: Board, views: Sequence[BoardView]) -> list[str]:
    """Remarks on the size of the squares; the ids of the markers encode the size that was printed.

    Raises CalibrationError if images show different boards, or one printed for another size.
    """
    firsts = {view.first_id: view for view in views}
    if len(firsts) > 1:
        boards = " and ".join(f"that of {_size_of(first)} in {view.name}" for first, view in sorted(firsts.items()))
        raise CalibrationError(f"the images show different boards: {boards}; use one board in all images")
    nominal = nominal_square(views[0].first_id) if views else None
    if nominal is None or abs(board.square / nominal - 1.0) <= SCALE_TOLERANCE:
        return []
    given, printed = f"{board.square * 1000:.4g} mm", f"{nominal * 1000:.4g} mm"
    if abs(board.square / nominal - 1.0) > SCALE_SUSPICION:
        raise CalibrationError(
            f"wrong size of the squares? --square is {given}, but the markers are those of a board printed with "
            f"{printed}: measure the side of one black square; for squares of another size print a board with "
            "`paramove calibrate board --square`"
        )
    return [f"squares of {given} on a board printed for {printed}: right if you measured it on the print"]


def _size_of(first_id: int) -> str:
    nominal = nominal_square(first_id)
    return "unusual squares" if nominal is None else f"squares of {nominal * 1000:g} mm"


def calibrate_lens(name: str, views: Sequence[BoardView], board: Board) -> Lens:
    """Lens of a camera from views of the board at different angles.

    Raises CalibrationError: different resolutions, too few views, all views parallel, a lens that cannot be determined.
    """
    _check_views(name, views)
    tilt = _tilt_deg(views, board)
    if tilt < MIN_TILT_DEG:
        raise CalibrationError(
            f"{name}: in all {len(views)} views the board is parallel (its directions differ by {tilt:.1f} deg, more "
            f"than {MIN_TILT_DEG:g} needed), so focal length and distance cannot be separated: tilt the board by 30 "
            "to 45 deg to all sides"
        )
    lens = _fit(name, views, board)
    inliers = _agreeing(lens.view_errors_px)
    left_out = tuple(view.name for view, used in zip(views, inliers, strict=True) if not used)
    if left_out:
        lens = _fit(name, [view for view, used in zip(views, inliers, strict=True) if used], board)
    _check_lens(lens)
    return replace(lens, tilt_deg=tilt, left_out=left_out)


def _check_views(name: str, views: Sequence[BoardView]) -> None:
    sizes = {view.size: view.name for view in views}
    if len(sizes) > 1:
        sizes_found = ", ".join(f"{width} x {height} px ({image})" for (width, height), image in sizes.items())
        raise CalibrationError(
            f"{name}: images of different resolutions: {sizes_found}; take all with the same setting"
        )
    if len(views) < MIN_VIEWS:
        raise CalibrationError(
            f"{name}: too few views: the board was found in {len(views)} images, at least {MIN_VIEWS} needed, "
            f"{GOOD_VIEWS} are good; keep the whole board in the image, sharp, and evenly lit"
        )


def _tilt_deg(views: Sequence[BoardView], board: Board) -> float:
    """Root mean square angle of the boards' normals to their mean, for a lens of 53 deg.

    The normal is Kᵀ l with l the vanishing line: boards that are parallel have one line, so one normal whatever K is.
    """
    width, height = views[0].size
    focal = float(max(width, height))
    guess = np.array([[focal, 0.0, (width - 1) / 2], [0.0, focal, (height - 1) / 2], [0.0, 0.0, 1.0]])
    normals = []
    for view in views:
        homography, _ = cv2.findHomography(board.corners()[view.corner_ids, :2] / board.square, view.points)
        normal = guess.T @ np.linalg.inv(homography)[2]
        normals.append(normal / np.linalg.norm(normal) * np.sign(normal[2]))
    middle = np.mean(normals, axis=0)
    cosines = np.clip(np.array(normals) @ (middle / np.linalg.norm(middle)), -1.0, 1.0)
    return float(np.rad2deg(np.sqrt(np.mean(np.arccos(cosines) ** 2))))


def _fit(name: str, views: Sequence[BoardView], board: Board) -> Lens:
    """Fits two radial coefficients, or three where the third lowers the error clearly."""
    plain, bent = (_fitted(name, views, board, flags) for flags in (cv2.CALIB_FIX_K3, 0))
    surely_better = bent.error_px < RADIAL_GAIN * plain.error_px and plain.error_px > 0.3 * GOOD_ERROR_PX
    return bent if surely_better else plain


def _fitted(name: str, views: Sequence[BoardView], board: Board, flags: int) -> Lens:
    corners = board.corners() - [0.0, 0.0, board.thickness]  # Zhang's method needs the plane z = 0
    on_board = [corners[view.corner_ids].astype(np.float32) for view in views]
    in_image = [view.points.astype(np.float32) for view in views]
    start: Any = None
    error, matrix, distortion, _, _, deviations, _, per_view = cv2.calibrateCameraExtended(
        on_board, in_image, views[0].size, start, start, flags=flags
    )
    return Lens(
        name=name,
        size=views[0].size,
        matrix=np.asarray(matrix, dtype=np.float64),
        distortion=np.asarray(distortion, dtype=np.float64).ravel()[:5],
        error_px=float(error),
        view_errors_px=np.asarray(per_view, dtype=np.float64).ravel(),
        focal_sd_px=float(np.max(deviations.ravel()[:2])),
        centre_sd_px=float(np.max(deviations.ravel()[2:4])),
        tilt_deg=_tilt_deg(views, board),
        covered=_covered(views),
        used=tuple(view.name for view in views),
    )


def _agreeing(errors_px: Floats) -> NDArray[np.bool_]:
    """Inliers among the views. Outliers are far worse than the rest (blurred, bent, moved), at most a quarter."""
    bad = errors_px > max(OUTLIER_PX, OUTLIER_FACTOR * float(np.median(errors_px)))
    too_many = bad.sum() > MAX_OUTLIERS * len(bad) or (~bad).sum() < MIN_VIEWS
    return np.ones(len(bad), dtype=np.bool_) if too_many else ~bad


def _check_lens(lens: Lens) -> None:
    size, focal = lens.size, 0.5 * float(lens.matrix[0, 0] + lens.matrix[1, 1])
    centre_x, centre_y = float(lens.matrix[0, 2]), float(lens.matrix[1, 2])
    inside = 0.0 < centre_x < size[0] and 0.0 < centre_y < size[1]
    plausible = 0.2 * max(size) < focal < 10.0 * max(size)
    if lens.focal_sd_px <= MAX_FOCAL_SD * focal and inside and plausible:
        return
    raise CalibrationError(
        f"{lens.name}: the views do not determine the lens (focal length {focal:.0f} ± {lens.focal_sd_px:.0f} px, ± "
        f"{MAX_FOCAL_SD:.1%} needed; centre {centre_x:.0f}, {centre_y:.0f} of {size[0]} x {size[1]} px; "
        f"error {lens.error_px:.2f} px): take more views, nearer, tilted by 30 to 45 deg to all sides"
    )


def _covered(views: Sequence[BoardView]) -> float:
    points = np.vstack([view.points for view in views])
    cells = np.clip((points / np.array(views[0].size) * GRID).astype(int), 0, GRID - 1)
    return len({(int(u), int(v)) for u, v in cells}) / GRID**2
