"""The stereo body tracker: an arm pose from marked points in the images of calibrated cameras (paper 5.4).

"The recognition is based on the position of the elbow and wrist, that are estimated by our online body tracker based on
3D data of a stereo head camera." Here the points carry ArUco markers or patches of one colour each.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import cv2
import numpy as np

from paramove.cameras import MARKERS, UNSIZED_BOARD_ID, CalibratedCamera, StereoRig, dictionary
from paramove.documents import Floats, Image, InputError
from paramove.msgs.arm_pose_pb2 import ArmPose
from paramove.objects import Colour, ColourTracker
from paramove.observation.arm_messages import pose_message

BOARD_IDS = UNSIZED_BOARD_ID + MARKERS
"""Smaller ids are those of calibration boards, which may lie on the table at the same time."""
MIN_SIDE, MAX_SIDE = 0.005, 0.15
"""m. A marker reconstructed with sides outside these limits was a wrong match."""
SQUARENESS = 0.25
"""Sides of a marker differ by less than this fraction of their mean."""


@dataclass(frozen=True)
class ArucoMarker:
    """A printed marker of the boards' dictionary (4 x 4 bits, 100 markers) on a point of the body.

    Attributes:
        number: Id of the marker, 60 to 99; smaller ones are on calibration boards.
        inset: How deep below the marker's middle the point lies, m, such as the elbow's joint below the skin.
    """

    number: int
    inset: float = 0.0

    def __post_init__(self) -> None:
        last = len(dictionary().bytesList) - 1
        if not BOARD_IDS <= self.number <= last:
            raise InputError(
                f"expected a marker from {BOARD_IDS} to {last}, found {self.number}: smaller numbers are on boards"
            )
        if not 0.0 <= self.inset <= 0.15:
            raise InputError(f"marker {self.number}: expected an inset of 0 to 0.15 m, found {self.inset:g} m")


DEFAULT_MARKERS: Mapping[str, ArucoMarker | Colour] = {
    "shoulder": ArucoMarker(90),
    "elbow": ArucoMarker(91),
    "wrist": ArucoMarker(92),
    "index": ArucoMarker(93),
}
"""The names are those of `ArmPose`; "index" is the end of the hand."""


@dataclass(frozen=True)
class BodyTrackerOptions:
    """What marks which point, and which points are accepted.

    Attributes:
        markers: Name of a body point -> its marker, or its colour, which nothing else in view may have.
        max_residual_px: A point whose views disagree by more (root mean square) is a wrong match and rejected.
    """

    markers: Mapping[str, ArucoMarker | Colour] = field(default_factory=lambda: dict(DEFAULT_MARKERS))
    max_residual_px: float = 3.0


@dataclass(frozen=True)
class MarkedPoint:
    """A point in space: position, m; its standard deviation over all directions, m; how far its views disagree, px."""

    position: Floats
    deviation: float
    residual_px: float


class StereoBodyTracker:
    """Locates marked points in the images of two or more cameras.

    Raises StereoError for cameras that cannot triangulate, InputError for duplicate markers or none.
    """

    def __init__(self, cameras: Sequence[CalibratedCamera], options: BodyTrackerOptions | None = None) -> None:
        self._rig = StereoRig(cameras)
        self._options = options or BodyTrackerOptions()
        markers = self._options.markers
        self._aruco = {name: marker for name, marker in markers.items() if isinstance(marker, ArucoMarker)}
        self._colours = [
            replace(colour, name=name, hand=False) for name, colour in markers.items() if isinstance(colour, Colour)
        ]
        numbers = [marker.number for marker in self._aruco.values()]
        hues = [colour.hue_deg for colour in self._colours]
        if not markers or len(set(numbers)) < len(numbers) or len(set(hues)) < len(hues):
            raise InputError(
                "expected at least one marker, and a number or colour of its own for each point; found markers "
                f"{', '.join(map(str, numbers)) or 'none'} and {len(hues)} colours"
            )
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        self._detector = cv2.aruco.ArucoDetector(dictionary(), parameters)
        self._trackers = [ColourTracker(self._colours) for _ in cameras] if self._colours else []

    def update(self, images: Sequence[Image | None], captured_ns: int = 0) -> ArmPose:
        """The arm pose at one time, of the points that at least two cameras detected.

        Args:
            images: One per camera, [H, W, 3] uint8 BGR, taken at the same time; None for a missing one.
            captured_ns: That time.

        Raises InputError for another number of images, and for an image of another size than calibrated.
        """
        return pose_message(captured_ns, {name: point.position for name, point in self.located(images).items()})

    def located(self, images: Sequence[Image | None]) -> dict[str, MarkedPoint]:
        """The points with their uncertainty, in the order of the options; arguments as for `update`."""
        cameras = self._rig.cameras
        if len(images) != len(cameras):
            raise InputError(f"expected one image of each of {len(cameras)} cameras, found {len(images)}")
        for image, camera in zip(images, cameras, strict=True):
            if image is not None:
                camera.check_image(image)
        points = self._aruco_points(images) | self._colour_points(images)
        return {name: points[name] for name in self._options.markers if name in points}

    def _aruco_points(self, images: Sequence[Image | None]) -> dict[str, MarkedPoint]:
        """The middle of each marker's corners in space, moved inwards against the marker's normal."""
        pixels = np.full((len(images), 4 * len(self._aruco), 2), np.nan)
        rows = {marker.number: 4 * row for row, marker in enumerate(self._aruco.values())}
        for view, image in enumerate(images):
            if image is None or not rows:
                continue
            gray: Any = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
            corners, numbers, _ = self._detector.detectMarkers(gray)
            for number, of_marker in zip([] if numbers is None else numbers.ravel(), corners, strict=True):
                if int(number) in rows:
                    at = rows[int(number)]
                    pixels[view, at : at + 4] = of_marker.reshape(4, 2)
        triangulated = self._rig.triangulate(pixels)
        points = {}
        for row, (name, marker) in enumerate(self._aruco.items()):
            own = slice(4 * row, 4 * row + 4)
            residual_px = float(np.sqrt(np.mean(triangulated.residuals_px[own] ** 2)))
            corners_3d = triangulated.points[own]
            if not residual_px <= self._options.max_residual_px or not _is_square(corners_3d):
                continue
            inwards = np.cross(corners_3d[2] - corners_3d[0], corners_3d[3] - corners_3d[1])
            position = corners_3d.mean(axis=0) + marker.inset * inwards / np.linalg.norm(inwards)
            deviation = float(np.sqrt(np.sum(triangulated.deviations[own] ** 2))) / 4.0
            points[name] = MarkedPoint(position, deviation, residual_px)
        return points

    def _colour_points(self, images: Sequence[Image | None]) -> dict[str, MarkedPoint]:
        """The middle of each coloured region, as if it were the image of one point."""
        names = [colour.name for colour in self._colours]
        pixels = np.full((len(images), len(names), 2), np.nan)
        for view, (image, tracker) in enumerate(zip(images, self._trackers, strict=False)):
            for region in [] if image is None else tracker.update(image).objects:
                pixels[view, names.index(region.name)] = region.u_px, region.v_px
        triangulated = self._rig.triangulate(pixels)
        rows = zip(names, triangulated.points, triangulated.deviations, triangulated.residuals_px, strict=True)
        return {
            name: MarkedPoint(position, float(deviation), float(residual_px))
            for name, position, deviation, residual_px in rows
            if residual_px <= self._options.max_residual_px
        }


def _is_square(corners: Floats) -> bool:
    """Whether four points in space, [4, 3], m, can be the corners of a marker."""
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)
    mean = float(sides.mean())
    return MIN_SIDE < mean < MAX_SIDE and bool(np.all(np.abs(sides - mean) < SQUARENESS * mean))
