"""The homography between image points and the plane of object centres (thesis 5.2.6, step 2).

"The mapping is a homography between two planes, which can be estimated based on four point correspondences." It holds
for points of one plane: here the plane of the middles of standing objects, at the height at which the robot put them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats
from paramove.msgs.plane_calibration_pb2 import PlaneCalibration, PlaneCorrespondence

MIN_FLATNESS = 0.03
"""Three points count as collinear below this ratio of the triangle's height to its longest side."""


class HomographyError(ValueError):
    """The correspondences do not determine a homography; the message gives the reason and the remedy."""


@dataclass(frozen=True)
class PlaneHomography:
    """Maps image points (u, v), px, to points (x, y), m, of a plane at `plane_z` in `plane_frame`, and back.

    Attributes:
        plane_from_image_matrix: [3, 3], element (2, 2) is 1.
        plane_z: height of the plane in `plane_frame`, m.
        plane_frame: name of the frame; empty if that is not known.
        correspondences: [M, 4] rows (u_px, v_px, x, y) that it was fitted to.
        object_name: Of the object whose middle was seen there; empty if that is not known.
    """

    plane_from_image_matrix: Floats
    plane_z: float = 0.0
    plane_frame: str = ""
    correspondences: Floats | None = None
    object_name: str = ""

    @classmethod
    def fit(
        cls,
        image_points: ArrayLike,
        plane_points: ArrayLike,
        plane_z: float = 0.0,
        plane_frame: str = "",
        object_name: str = "",
    ) -> PlaneHomography:
        """Least-squares homography of >= 4 correspondences by the normalised DLT.

        Args:
            image_points: [M, 2] px. plane_points: [M, 2] m. plane_z, plane_frame, object_name: see the attributes.
        Raises:
            HomographyError: fewer than 4, not finite, collinear or coinciding points, or an image that is a mirrored
                view of the plane (two points were mixed up: a camera above the plane never gives a mirrored view).
        """
        image, plane = _points(image_points, "image"), _points(plane_points, "plane")
        if len(image) != len(plane):
            raise HomographyError(f"{len(image)} image points and {len(plane)} plane points: equal numbers needed")
        if len(image) < 4:
            raise HomographyError(
                f"{len(image)} correspondences: at least 4 needed, such as the working area's corners"
            )
        _check_not_collinear(image, "image")
        _check_not_collinear(plane, "plane")
        matrix = _direct_linear_transform(image, plane)
        homography = cls(matrix, plane_z, plane_frame, np.hstack([image, plane]), object_name)
        homography._check_not_mirrored(image)
        return homography

    @classmethod
    def from_message(cls, message: PlaneCalibration) -> PlaneHomography:
        """Raises HomographyError unless the message holds nine finite numbers that form an invertible matrix."""
        matrix = np.array(message.plane_from_image, dtype=np.float64)
        if matrix.size != 9 or not np.all(np.isfinite(matrix)):
            raise HomographyError(f"plane_from_image holds {matrix.size} numbers {matrix}: nine finite ones needed")
        matrix = matrix.reshape(3, 3)
        if abs(np.linalg.det(matrix)) < 1e-15:
            raise HomographyError(f"plane_from_image is singular: {matrix.tolist()}")
        rows = [(c.u_px, c.v_px, c.x, c.y) for c in message.correspondences]
        known = np.array(rows, dtype=np.float64) if rows else None
        return cls(matrix, message.plane_z, message.plane_frame, known, message.object)

    def to_message(self, captured_ns: int = 0) -> PlaneCalibration:
        """The calibration as the message that `from_message` reads."""
        message = PlaneCalibration(
            image_frame="camera_optical",
            plane_frame=self.plane_frame,
            plane_z=self.plane_z,
            plane_from_image=self.plane_from_image_matrix.ravel().tolist(),
            object=self.object_name,
        )
        message.captured.FromNanoseconds(captured_ns)
        for u, v, x, y in [] if self.correspondences is None else self.correspondences:
            message.correspondences.append(PlaneCorrespondence(u_px=u, v_px=v, x=x, y=y))
        return message

    def plane_from_image(self, u_px: float, v_px: float) -> tuple[float, float]:
        """(x, y), m. Raises ValueError for a point on the plane's horizon."""
        return _apply(self.plane_from_image_matrix, u_px, v_px)

    def below_plane(self, u_px: float, v_px: float, depth: float) -> tuple[float, float]:
        """(x, y), m, of what is seen there and lies `depth`, m, below the plane: farther from the camera.

        By a parallel projection near (u, v), of a camera that is not upside down.
        """
        x, y = self.plane_from_image(u_px, v_px)
        if depth == 0.0:
            return x, y
        away, sine = self.away_from_camera(u_px, v_px)
        farther = depth * np.sqrt(1.0 - sine**2) / sine
        return float(x + farther * away[0]), float(y + farther * away[1])

    def away_from_camera(self, u_px: float, v_px: float) -> tuple[Floats, float]:
        """The direction in the plane, [2], that leads away from the camera near (u, v), and the sine of its elevation.

        A small circle is seen as an ellipse: foreshortened most along that direction, which leads up in the image.
        """
        directions = self.image_directions(u_px, v_px)
        _, (largest, smallest), axes = np.linalg.svd(directions)
        return -np.sign((directions @ axes[1])[1]) * axes[1], float(smallest / largest)

    def image_from_plane(self, x: float, y: float) -> tuple[float, float]:
        """(u, v), px. Raises ValueError for a point without a finite image."""
        return _apply(np.asarray(np.linalg.inv(self.plane_from_image_matrix), dtype=np.float64), x, y)

    def foreshortening(self, u_px: float, v_px: float) -> float:
        """Height over width of the box around a small circle of the plane, in the image near (u, v).

        Straight from above it is 1; of a camera that is not rolled, it is the sine of its elevation.
        """
        across, down = self.image_directions(u_px, v_px)
        return float(np.linalg.norm(down) / np.linalg.norm(across))

    def image_directions(self, u_px: float, v_px: float) -> Floats:
        """How u and v (rows) change along x and y (columns) near (u, v), px/m, [2, 2]."""
        x, y = self.plane_from_image(u_px, v_px)
        along_x, along_y = (np.array(self.image_from_plane(x + dx, y + dy)) for dx, dy in ((1e-3, 0.0), (0.0, 1e-3)))
        return np.asarray(np.column_stack([along_x, along_y]) - np.array([[u_px], [v_px]]), dtype=np.float64) / 1e-3

    def _check_not_mirrored(self, image: Floats) -> None:
        depths = image @ self.plane_from_image_matrix[2, :2] + self.plane_from_image_matrix[2, 2]
        if np.any(depths <= 0) and np.any(depths >= 0):
            raise HomographyError("the horizon runs between the points: corners are mixed up, or a point is wrong")
        # The image's v runs down, so a view from above reverses the sense of rotation: the determinant is negative.
        if np.linalg.det(self.plane_from_image_matrix) * np.sign(depths[0]) >= 0:
            raise HomographyError("the image shows the plane mirrored: two correspondences are mixed up")


def _points(points: ArrayLike, which: str) -> Floats:
    array = np.asarray(points, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 2 or not np.all(np.isfinite(array)):
        raise HomographyError(f"{which} points have shape {array.shape}: finite numbers of shape [M, 2] needed")
    return array


def _check_not_collinear(points: Floats, which: str) -> None:
    """Raises HomographyError unless there are four points of which no three lie on one line."""
    distances = np.linalg.norm(points[:, None] - points[None], axis=2)
    i, j = np.unravel_index(int(np.argmax(distances)), distances.shape)
    a, b = points[i], points[j]  # the farthest apart, then the farthest from their line, then the best fourth
    c = points[int(np.argmax([_flatness(a, b, p) for p in points]))]
    best = max(min(_flatness(a, b, c), _flatness(a, b, p), _flatness(a, c, p), _flatness(b, c, p)) for p in points)
    if best < MIN_FLATNESS:
        raise HomographyError(
            f"{which} points {points.tolist()} are (nearly) collinear or coincide: "
            "four are needed of which no three lie on one line"
        )


def _flatness(a: Floats, b: Floats, c: Floats) -> float:
    """Height over longest side of the triangle; 0 for three points of one line."""
    longest = float(max(np.linalg.norm(a - b), np.linalg.norm(b - c), np.linalg.norm(a - c)))
    (x, y), (other_x, other_y) = b - a, c - a
    return abs(float(x * other_y - y * other_x)) / longest**2 if longest > 0 else 0.0


def _direct_linear_transform(image: Floats, plane: Floats) -> Floats:
    """Hartley and Zisserman, Multiple View Geometry, algorithm 4.2: with both point sets normalised."""
    to_unit_image, to_unit_plane = _normalising(image), _normalising(plane)
    u = np.hstack([image, np.ones((len(image), 1))]) @ to_unit_image.T
    x = np.hstack([plane, np.ones((len(plane), 1))]) @ to_unit_plane.T
    zero = np.zeros_like(u)
    rows = np.vstack([np.hstack([u, zero, -x[:, :1] * u]), np.hstack([zero, u, -x[:, 1:2] * u])])
    solution = np.linalg.svd(rows)[2][-1].reshape(3, 3)
    matrix = np.linalg.inv(to_unit_plane) @ solution @ to_unit_image
    if abs(matrix[2, 2]) < 1e-12 * np.abs(matrix).max():
        raise HomographyError(
            "the image's first pixel lies on the plane's horizon: the camera does not look at the plane"
        )
    return np.asarray(matrix / matrix[2, 2], dtype=np.float64)


def _normalising(points: Floats) -> Floats:
    """Similarity [3, 3] that moves the mean to 0 and makes the mean distance to it √2."""
    mean = points.mean(axis=0)
    scale = np.sqrt(2.0) / np.linalg.norm(points - mean, axis=1).mean()
    return np.array([[scale, 0.0, -scale * mean[0]], [0.0, scale, -scale * mean[1]], [0.0, 0.0, 1.0]])


def _apply(matrix: Floats, a: float, b: float) -> tuple[float, float]:
    x, y, w = matrix @ np.array([a, b, 1.0])
    if not np.isfinite(w) or abs(w) < 1e-12:
        raise ValueError(f"point ({a}, {b}) lies on the horizon and has no image")
    return float(x / w), float(y / w)
