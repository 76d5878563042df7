"""The likelihood of arm postures given key points of a pose network, and the posture corrected by them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from paramove.cameras import CalibratedCamera
from paramove.documents import Floats, InputError
from paramove.observation.arm_body import ArmSizes, fitted_poses
from paramove.observation.body_key_points import ARM_POINTS, SIDES, BodyKeyPoints

BODY_PER_DEVIATION = 35.0
"""Side of a square as large as a person, in deviations of a key point: a point elsewhere on the body lies anywhere in
it."""
ELSEWHERE = -2.0 * np.log(BODY_PER_DEVIATION)
"""ln of the density of such a point, per squared deviation."""
MIN_INLIER = 1e-3
"""A point that is less probably of the arm does not count."""
STEP_M = 1e-4
"""Of the slopes by which a projected point follows the posture."""


@dataclass(frozen=True)
class KeyPointOptions:
    """How key points and postures are compared.

    Attributes:
        outlier: Probability that a single point is elsewhere on the body.
        exchanged: Probability that an image's points of the right arm are those of the left one, and vice versa.
        other: Probability that none of an image's points is of this arm.
        model: Deviation of a point of a good hypothesis from the arm, m, along each axis.
        wrist: Deviation of the wrist from the line between elbow and fingertip, m, at right angles to it.
        elbow_depth, hand_depth: Deviation of the network's depths behind the shoulder, m.
        across, along: By how much the filter's posture is off, m, at right angles to the ray of a single view and along
            it; several views correct by `across` in each direction.
    """

    outlier: float = 0.05
    exchanged: float = 0.06
    other: float = 0.02
    model: float = 0.02
    wrist: float = 0.025
    elbow_depth: float = 0.08
    hand_depth: float = 0.15
    across: float = 0.05
    along: float = 0.01

    def __post_init__(self) -> None:
        for name in ("outlier", "exchanged", "other"):
            if not 0.0 < getattr(self, name) < 0.5:
                raise InputError(f"expected a probability {name} of 0 to 0.5, found {getattr(self, name)}")
        for name in ("model", "wrist", "elbow_depth", "hand_depth", "across", "along"):
            if not getattr(self, name) > 0.0:
                raise InputError(f"expected {name} above 0 m, found {getattr(self, name)}")

    @property
    def depths(self) -> Floats:
        """Deviation of the depths of shoulder, elbow, wrist, hand, m; inf where the depth does not count."""
        return np.array([np.inf, self.elbow_depth, np.inf, self.hand_depth])

    @property
    def weights(self) -> Floats:
        """ln of the probabilities that the points are as named, exchanged, or of something else."""
        return np.log([1.0 - self.exchanged - self.other, self.exchanged, self.other])


class KeyPointObserver:
    """Compares postures of a right arm with the key points of one or several cameras.

    A network exchanges the sides of a whole image with full certainty, and single points lie elsewhere. So each point
    is of the arm or anywhere on the body, and the points of each image are those of the named arm, of the other one, or
    of something else.

    Args:
        sizes: Of the person's arm.
        cameras: One or more; key points come in this order.
        options: Parameters of the comparison.
    """

    def __init__(
        self, sizes: ArmSizes, cameras: Sequence[CalibratedCamera], options: KeyPointOptions | None = None
    ) -> None:
        self.sizes = sizes
        self.cameras = tuple(cameras)
        self.options = options if options is not None else KeyPointOptions()
        self._points: list[BodyKeyPoints | None] = [None] * len(self.cameras)

    def look(self, points: Sequence[BodyKeyPoints | None]) -> None:
        """Take the key points of an image of each camera, None for one without. Raises InputError for another count."""
        if len(points) != len(self.cameras):
            raise InputError(
                f"expected key points of {len(self.cameras)} cameras, None for a missing one: {len(points)}"
            )
        self._points = [one if one is not None and one.has_person else None for one in points]

    @property
    def has_points(self) -> tuple[bool, ...]:
        """Which cameras had key points in the last `look`."""
        return tuple(one is not None for one in self._points)

    def log_likelihoods(self, poses: ArrayLike) -> Floats:
        """ln p(key points | x) of postures (M, D), m, in the world's frame, up to a constant; (M,).

        Postures are fitted to the arm first. Without key points all are 0. A posture with NaN or infinity gets -inf.
        """
        fitted = fitted_poses(poses, self.sizes)
        usable = np.isfinite(fitted).all(axis=1)
        result = np.where(usable, 0.0, -np.inf)
        if usable.any():
            arm = self._arm_points(fitted[usable])
            for camera, points in self._detected():
                _, total = self.densities(arm, camera, points, self.options.model)
                result[usable] += np.logaddexp.reduce(self.hypotheses(total), axis=0)
        return result

    def detects(self, pose: ArrayLike) -> bool:
        """Whether the key points of some camera are probably of an arm near this posture, (D,), m, in the world."""
        one = np.asarray(pose, dtype=np.float64)
        if not np.isfinite(one).all():
            return False
        arm = self._arm_points(one[None])
        totals = (self.densities(arm, *view, self.options.across)[1] for view in self._detected())
        return any(int(self.hypotheses(total)[:, 0].argmax()) < len(SIDES) for total in totals)

    def corrected(self, pose: ArrayLike, covariance: ArrayLike | None = None) -> Floats:
        """The posture (D,), m, in the world, moved to where the key points are; lengths may be off by some cm.

        The most probable posture, linearised, of one that is off by `across` and `along`, and by what the filter itself
        is unsure of: `covariance` (D, D), m². Only images whose points are probably of this arm count, and of them the
        points that are probably no outliers.
        """
        before = np.asarray(pose, dtype=np.float64)
        detected = self._detected()
        if not detected or not np.isfinite(before).all():
            return before
        arm = self._arm_points(before[None])
        unsure = np.zeros((len(before), len(before))) if covariance is None else np.asarray(covariance)
        precision = np.linalg.inv(self._off(before, [camera for camera, _ in detected]) + unsure)
        towards = np.zeros(len(before))
        for camera, points in detected:
            slopes, projected = self._slopes(before, camera)
            ahead = camera.depths(arm[0])
            unsure_px = np.sqrt(0.5 * np.einsum("pid,de,pie->p", slopes, unsure, slopes))
            off = np.hypot(self.options.across, unsure_px * ahead / camera.matrix[0, 0])
            own, total = self.densities(arm, camera, points, off)
            hypothesis = int(self.hypotheses(total)[:, 0].argmax())
            if hypothesis >= len(SIDES):
                continue
            bent_px = self._model_px(ahead, camera, 0.0)
            inlier = np.exp(own - total)[hypothesis, 0]
            for point in np.flatnonzero(inlier > MIN_INLIER):
                weight = inlier[point] / (points.deviations[hypothesis, point] ** 2 + bent_px[point] ** 2)
                precision += weight * slopes[point].T @ slopes[point]
                towards += weight * slopes[point].T @ (points.positions[hypothesis, point] - projected[point])
        return np.asarray(before + np.linalg.solve(precision, towards))

    def _detected(self) -> list[tuple[CalibratedCamera, BodyKeyPoints]]:
        return [(one, points) for one, points in zip(self.cameras, self._points, strict=True) if points is not None]

    def _arm_points(self, poses: Floats) -> Floats:
        """Shoulder, elbow, wrist, middle of the hand of postures (M, D), m; (M, 4, 3)."""
        points = poses.reshape(len(poses), -1, 3)
        shoulder, elbow, tip = points[:, 0], points[:, 1], points[:, 2]
        fraction = self.sizes.forearm / self.sizes.lower_arm
        wrist = points[:, 3] if points.shape[1] == 4 else (1.0 - fraction) * elbow + fraction * tip
        return np.stack([shoulder, elbow, wrist, 0.5 * (wrist + tip)], axis=1)

    def hypotheses(self, total: Floats) -> Floats:
        """ln p of the points of the right arm being its own, those of the left one, or none of the arm; (3, M).

        `total`: densities of each point as any, of `densities`.
        """
        nothing = np.full((1, total.shape[1]), len(ARM_POINTS) * ELSEWHERE)
        return np.asarray(np.concatenate([total.sum(axis=2), nothing]) + self.options.weights[:, None])

    def densities(
        self, arm: Floats, camera: CalibratedCamera, points: BodyKeyPoints, model: float | Floats
    ) -> tuple[Floats, Floats]:
        """ln of the density of each point, as a point of the arm and as any; (2, M, 4) by side, of squared deviations.

        An unknown point is no point of the arm. `model`: by how much the arm is off, of each point or all, m.
        """
        ahead = camera.depths(arm)
        deviations, positions = points.deviations[:, None], points.positions[:, None]
        with np.errstate(invalid="ignore", divide="ignore"):
            widened = 1.0 + (self._model_px(ahead, camera, model) / deviations) ** 2
            squared = ((camera.project(arm) - positions) ** 2).sum(axis=3) / deviations**2
            depths = np.moveaxis(points.depths_at(ahead[:, 0], camera.matrix[0, 0]), 1, 0)
            behind = (ahead - ahead[:, :1] - depths) / self.options.depths
            own = -0.5 * squared / widened - np.log(2.0 * np.pi * widened) - 0.5 * np.nan_to_num(behind) ** 2
        own = np.where(np.isfinite(own) & (ahead > 0.0), own, -np.inf) + np.log1p(-self.options.outlier)
        total = np.logaddexp(own, np.log(self.options.outlier) + ELSEWHERE)
        known = np.isfinite(positions[..., 0])
        return np.where(known, own, -np.inf), np.where(known, total, ELSEWHERE)

    def _model_px(self, ahead: Floats, camera: CalibratedCamera, model: float | Floats) -> Floats:
        """Deviation of each point of a good posture from the arm, px, at these depths (M, 4), m; a wrist is in line."""
        off: Floats = np.hypot(model, [0.0, 0.0, self.options.wrist, 0.0]) * camera.matrix[0, 0] / ahead
        return off

    def _off(self, pose: Floats, cameras: Sequence[CalibratedCamera]) -> Floats:
        """Covariance of a posture of the filter, beside the filter's own, (D, D), m²."""
        covariance = np.eye(len(pose)) * self.options.across**2
        if len(cameras) == 1:
            less = self.options.along**2 - self.options.across**2
            for at in range(0, len(pose), 3):
                ray = pose[at : at + 3] - cameras[0].position
                ray = ray / np.linalg.norm(ray)
                covariance[at : at + 3, at : at + 3] += less * np.outer(ray, ray)
        return covariance

    def _slopes(self, pose: Floats, camera: CalibratedCamera) -> tuple[Floats, Floats]:
        """How the four points of an image follow the posture, (4, 2, D), px per m; and where they are, (4, 2)."""
        moved = np.vstack([pose, pose + STEP_M * np.eye(len(pose))])
        pixels = camera.project(self._arm_points(moved).reshape(-1, 3)).reshape(len(moved), -1, 2)
        return np.moveaxis(pixels[1:] - pixels[0], 0, -1) / STEP_M, pixels[0]
