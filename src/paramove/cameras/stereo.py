"""Points in space from two or more calibrated cameras, with their uncertainty.

First linearly (Hartley and Zisserman, Multiple View Geometry, 12.2), then refined: Gauss-Newton
steps minimize the distances between detected and projected points in images without lens distortion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paramove.cameras.calibrated import CalibratedCamera
from paramove.documents import Floats, InputError

MIN_BASELINE = 0.01
"""m. Cameras with a smaller baseline give no depth."""
MIN_ANGLE_DEG = 1.0
"""Minimum angle between the rays to a point: below, 0.1 px of error is 10 % of the distance."""
STEPS = 6


class StereoError(InputError):
    """Cameras or points that give no positions in space; the message gives the reason and the remedy."""


@dataclass(frozen=True)
class Triangulation:
    """Points in space; unknown values are NaN.

    Attributes:
        points: (N, 3), m, world frame.
        covariances: (N, 3, 3), m², for image points with the given standard deviation.
        residuals_px: (N,) root mean square distance of image points to the projected point.
        angles_deg: (N,) largest angle between two rays to the point.
    """

    points: Floats
    covariances: Floats
    residuals_px: Floats
    angles_deg: Floats

    @property
    def known(self) -> NDArray[np.bool_]:
        """(N,) whether at least two cameras detected the point well enough."""
        return np.asarray(np.isfinite(self.points).all(axis=1))

    @property
    def deviations(self) -> Floats:
        """(N,) standard deviation of each point over all directions, m."""
        return np.asarray(np.sqrt(np.trace(self.covariances, axis1=1, axis2=2)), dtype=np.float64)


class StereoRig:
    """Two or more cameras that view the same scene.

    Raises StereoError for fewer than two cameras, and for cameras at the same position.
    """

    def __init__(self, cameras: Sequence[CalibratedCamera]) -> None:
        if len(cameras) < 2:
            raise StereoError(f"{len(cameras)} camera found: positions in space need at least two calibrated cameras")
        positions = np.array([camera.position for camera in cameras])
        self.baseline = float(np.linalg.norm(positions[:, None] - positions[None], axis=2).max())
        if self.baseline < MIN_BASELINE:
            names = ", ".join(camera.name for camera in cameras)
            raise StereoError(
                f"the cameras {names} stand {self.baseline * 1000:.1f} mm apart: they see the same, so distances "
                "cannot be measured; at least 10 mm are needed, a third of the distance to the scene is good. "
                "Was one camera calibrated twice?"
            )
        self.cameras = tuple(cameras)
        self._positions = positions
        self._from_world = np.array([camera.camera_from_world[:3] for camera in cameras])

    def triangulate(self, pixels: ArrayLike, sigma_px: float = 0.5) -> Triangulation:
        """Positions of points from their pixels in the images as captured.

        Args:
            pixels: (K, N, 2) of K cameras and N points; NaN where a camera did not detect a point.
            sigma_px: Standard deviation of the image points in each direction.

        A point is NaN if fewer than two cameras detected it, if it would lie behind one of them, or if the rays are
        parallel to less than a degree. Raises StereoError for another shape.
        """
        detected = np.asarray(pixels, dtype=np.float64)
        if detected.ndim != 3 or detected.shape[0] != len(self.cameras) or detected.shape[2] != 2:
            raise StereoError(f"image points of shape {detected.shape} found, ({len(self.cameras)}, N, 2) expected")
        rays = np.stack([camera.normalised(points) for camera, points in zip(self.cameras, detected, strict=True)])
        focal = np.array([np.diag(camera.matrix)[:2] for camera in self.cameras])
        used = np.asarray(np.isfinite(rays).all(axis=2))  # [K, N]
        points = self._linear(np.nan_to_num(rays), used)
        for _ in range(STEPS):
            residuals, jacobians = self._linearised(points, rays, focal, used)
            information = np.einsum("knij,knil->njl", jacobians, jacobians)
            slope = np.einsum("knij,kni->nj", jacobians, residuals)
            points = points + _solved(information, slope[..., None])[..., 0]
        residuals, jacobians = self._linearised(points, rays, focal, used)
        information = np.einsum("knij,knil->njl", jacobians, jacobians)
        count = used.sum(axis=0)
        residual_px = np.sqrt(np.sum(residuals**2, axis=(0, 2)) / np.maximum(count, 1))
        angles = self._angles_deg(points, used)
        depths = np.einsum("kj,nj->kn", self._from_world[:, 2, :3], points) + self._from_world[:, 2, 3:]
        known = (count >= 2) & (angles >= MIN_ANGLE_DEG) & np.all((depths > 0.0) | ~used, axis=0)
        covariances = sigma_px**2 * _solved(information, np.broadcast_to(np.eye(3), information.shape))
        unknown = np.where(known, 0.0, np.nan)
        return Triangulation(
            points + unknown[:, None], covariances + unknown[:, None, None], residual_px + unknown, angles
        )

    def _linear(self, rays: Floats, used: NDArray[np.bool_]) -> Floats:
        """Points that fulfil x (p3 · X) = p1 · X and y (p3 · X) = p2 · X best, [N, 3]."""
        rows = rays[..., None] * self._from_world[:, None, None, 2] - self._from_world[:, None, :2]  # [K, N, 2, 4]
        rows = rows * used[..., None, None]
        stacked = rows.transpose(1, 0, 2, 3).reshape(rays.shape[1], 2 * len(rays), 4)
        normal = np.einsum("nij,nik->njk", stacked[..., :3], stacked[..., :3])
        return _solved(normal, -np.einsum("nij,ni->nj", stacked[..., :3], stacked[..., 3])[..., None])[..., 0]

    def _linearised(
        self, points: Floats, rays: Floats, focal: Floats, used: NDArray[np.bool_]
    ) -> tuple[Floats, Floats]:
        """Detected minus projected, px [K, N, 2], and d(projected)/d(point) [K, N, 2, 3]; 0 if not detected."""
        rotations = self._from_world[:, :, :3]
        local = np.einsum("kij,nj->kni", rotations, points) + self._from_world[:, None, :, 3]
        depth = np.where(np.abs(local[..., 2:]) > 1e-9, local[..., 2:], 1e-9)
        projected = local[..., :2] / depth
        residuals = np.where(used[..., None], (rays - projected) * focal[:, None], 0.0)
        bracket = rotations[:, None, :2] - projected[..., None] * rotations[:, None, 2:]
        jacobians = bracket / depth[..., None] * focal[:, None, :, None]
        return residuals, np.where(used[..., None, None], jacobians, 0.0)

    def _angles_deg(self, points: Floats, used: NDArray[np.bool_]) -> Floats:
        towards = points[None] - self._positions[:, None]
        towards = towards / np.maximum(np.linalg.norm(towards, axis=2, keepdims=True), 1e-12)
        cosines = np.einsum("kni,mni->kmn", towards, towards)
        both = used[:, None] & used[None]
        return np.asarray(np.rad2deg(np.arccos(np.clip(np.where(both, cosines, 1.0), -1.0, 1.0)).max(axis=(0, 1))))


def _solved(matrices: Floats, right: Floats) -> Floats:
    """Solutions [N, 3, M] of symmetric [N, 3, 3] systems; those of singular systems stay finite."""
    scale = np.maximum(np.trace(matrices, axis1=1, axis2=2), 1e-12)[:, None, None]
    return np.asarray(np.linalg.solve(matrices + 1e-12 * scale * np.eye(3), right), dtype=np.float64)
