"""The likelihood of arm postures given the images of one or several cameras (thesis 6.6)."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from paramove.cameras import CalibratedCamera
from paramove.documents import Floats, Image, InputError
from paramove.observation.arm_body import ArmSizes, fitted_poses
from paramove.observation.background import FULL, Background
from paramove.observation.contour_kernels import new_contour
from paramove.observation.edge_images import DIRECTIONS, EdgeImages
from paramove.observation.likelihood_kernels import matched_errors, outline, plain_errors, silhouette
from paramove.observation.options import ObservationOptions
from paramove.observation.presence import Presence, presence_in_view
from paramove.observation.silhouette_kernels import Camera, new_canvas

MIN_AREA_PX = 200.0
CHUNK = 50
"""Maximum number of postures that a thread takes at a time: their silhouettes use one canvas."""


@dataclass
class _View:
    """A camera, the same at the compared size, its edge images, whether it has an image now, the arm's area there."""

    camera: CalibratedCamera
    small: CalibratedCamera
    kernel: Camera
    edges: EdgeImages
    background: Background | None
    has_image: bool = False
    arm_area: float = 0.0


class ArmObserver:
    """Compares postures of an arm with images.

    Args:
        sizes: of the person's arm.
        cameras: one or more; images come in this order.
        options: parameters of the comparison.
        table: corners of the table's top in order, (n, 2), m, in its plane z = 0 of the world: it hides what is below.
        threads: number of worker threads; by default as many as there are processors.
    """

    def __init__(
        self,
        sizes: ArmSizes,
        cameras: Sequence[CalibratedCamera],
        options: ObservationOptions | None = None,
        *,
        table: ArrayLike | None = None,
        threads: int | None = None,
    ) -> None:
        if not cameras:
            raise InputError("no camera given: expected at least one")
        self.sizes = sizes
        self.options = options if options is not None else ObservationOptions()
        self.threads = max(1, threads if threads is not None else len(os.sched_getaffinity(0)))
        corners = None if table is None else np.asarray(table, dtype=np.float64)
        if corners is not None and (corners.ndim != 2 or corners.shape[1] != 2 or len(corners) < 3):
            raise InputError(f"expected a table of three or more corners (x, y) in m, found shape {corners.shape}")
        self.table = corners
        self._views = [self._view(camera) for camera in cameras]
        radii = (sizes.shoulder_radius, sizes.elbow_radius, sizes.wrist_radius)
        self._body = np.array([sizes.forearm, sizes.hand, *radii, sizes.hand_width, sizes.hand_thickness])
        self._unchanged = np.zeros((self.options.height_px + 2) * (self.options.width_px + 2), np.int8)
        self._pool = ThreadPoolExecutor(self.threads, "arm_observer") if self.threads > 1 else None

    def _view(self, camera: CalibratedCamera) -> _View:
        small = camera.resized(self.options.width_px, self.options.height_px)
        rotation, shift = small.camera_from_world[:3, :3].copy(), small.camera_from_world[:3, 3].copy()
        table = _table_mask(small, self.table)
        kernel = Camera(rotation, shift, small.matrix.copy(), small.width_px, small.height_px, table)
        learned = self.options.region_weight > 0.0 and self.options.likelihood == "matched"
        background = Background(small.width_px, small.height_px, self.options.still_edges) if learned else None
        return _View(camera, small, kernel, EdgeImages(self.options), background)

    @property
    def cameras(self) -> tuple[CalibratedCamera, ...]:
        """The cameras, in the order of the images."""
        return tuple(view.camera for view in self._views)

    @property
    def has_image(self) -> tuple[bool, ...]:
        """Which views had an image in the last `look`."""
        return tuple(view.has_image for view in self._views)

    @property
    def sharpness(self) -> Floats:
        """Gradient that N pixels of each view reach, grey levels per px, (V,); NaN for a missing view.

        A covered or dark camera stays below about 2, whatever its noise; a lit scene has 10 and more.
        """
        return np.array([view.edges.sharpness if view.has_image else np.nan for view in self._views])

    def look(self, images: Sequence[Image | None]) -> None:
        """Take one image of each view, (H, W, 3) uint8, RGB or BGR; None for a missing view.

        The images must have the sizes of the calibration. Lens distortion is undone here, in the image. Raises
        InputError for another number, shape or type of images; the observer then has no image at all.
        """
        for view in self._views:
            view.has_image = False
        if len(images) != len(self._views):
            raise InputError(f"expected {len(self._views)} images, None for a missing one; found {len(images)}")
        given = [(view, image) for view, image in zip(self._views, images, strict=True) if image is not None]
        for view, image in given:
            view.camera.check_image(image)
        self._run([partial(_see, view, image) for view, image in given])
        step = -(-DIRECTIONS // self.threads)
        self._run(
            [
                partial(view.edges.fill, first, min(first + step, view.edges.count))
                for view, _ in given
                for first in range(0, view.edges.count, step)
            ]
        )
        for view, _ in given:
            view.has_image = True

    def log_likelihoods(self, poses: ArrayLike) -> Floats:
        """ln P(I | x) of postures (M, 9), m, in the world's frame, up to a constant; (M,).

        Postures are fitted to the arm first. The errors of the views that have an image are added, (6.22), and
        divided by 2 gamma^2, gamma for that many views. A view without the arm in sight counts as one without
        edges. A posture with NaN or infinity gets -inf. Without any image all are 0: nothing is known.
        """
        fitted = fitted_poses(poses, self.sizes)
        views = [view for view in self._views if view.has_image]
        usable = np.isfinite(fitted).all(axis=1)
        result = np.where(usable, 0.0, -np.inf)
        if views and usable.any():
            errors, regions = self._errors(np.ascontiguousarray(fitted[usable]), views)
            gamma = self.options.view_gamma(len(views))
            result[usable] = -errors.sum(axis=0) / (2.0 * gamma**2)
            # Under the arm the background must have changed: its mean change there, of an arm as large as they are.
            areas = regions[:, 1].mean(axis=1)
            for view, area in zip(views, areas, strict=True):
                view.arm_area = float(area)
            weight = self.options.region_weight * (self.options.gamma / gamma) ** 2 / FULL
            result[usable] += weight * (regions[:, 0] / np.maximum(areas, MIN_AREA_PX)[:, None]).sum(axis=0)
        return result

    def change(self, view: int) -> NDArray[np.int8]:
        """How much each pixel of the last image differs from the learned background, at the compared size, (H, W).

        100 surely, -100 surely not, 0 unknown or a shadow.
        """
        small, background = self._views[view].small, self._views[view].background
        flat = self._unchanged if background is None else background.change
        return flat.reshape(small.height_px + 2, small.width_px + 2)[1:-1, 1:-1].copy()

    def presence(self, pose: ArrayLike) -> Presence:
        """Evidence that the images show an arm in this posture, (9,), m; call after `log_likelihoods`.

        Mean over the views; zeros without any.
        """
        fitted = fitted_poses(np.reshape(pose, (1, -1)), self.sizes)[0]
        presences = [
            presence_in_view(
                fitted, view.small, view.kernel.table, view.background.change, max(view.arm_area, MIN_AREA_PX)
            )
            for view in self._views
            if view.background is not None and view.has_image and np.isfinite(fitted).all()
        ]
        if not presences:
            return Presence()
        there, changed = [one.there for one in presences], [one.changed for one in presences]
        return Presence(float(np.mean(there)), float(np.mean(changed)))

    def learn(self, pose: ArrayLike, elapsed_s: float) -> None:
        """Update the background from the images of the last `look`, around the arm in this posture, (9,), m.

        The cameras must stand still. Call it after each image in which the arm is not lost.
        """
        fitted = fitted_poses(np.reshape(pose, (1, -1)), self.sizes)[0]
        if not np.isfinite(fitted).all():
            return
        for view in self._views:
            if view.background is None or not view.has_image:
                continue
            hidden = np.zeros((view.small.height_px, view.small.width_px), np.uint8)
            silhouette(fitted, self._body, view.kernel, new_canvas(view.kernel.width, view.kernel.height), hidden)
            size = 2 * self.options.hidden_px + 1
            hidden = np.asarray(cv2.dilate(hidden, np.ones((size, size), np.uint8)), np.uint8)
            view.background.learn(hidden, elapsed_s)

    def _errors(self, poses: Floats, views: list[_View]) -> tuple[Floats, Floats]:
        """Mean squared error of each posture in each view, (V, M); change under it and its area, (V, 2, M)."""
        errors, regions = np.empty((len(views), len(poses))), np.zeros((len(views), 2, len(poses)))
        size = max(1, min(CHUNK, -(-len(poses) * len(views) // (2 * self.threads))))
        self._run(
            [
                partial(self._measure, view, poses[at : at + size], row[at : at + size], region[:, at : at + size])
                for view, row, region in zip(views, errors, regions, strict=True)
                for at in range(0, len(poses), size)
            ]
        )
        return errors, regions

    def _measure(self, view: _View, poses: Floats, errors: Floats, regions: Floats) -> None:
        intensities, distances = view.edges.intensities.reshape(-1), view.edges.distances.reshape(-1)
        if self.options.likelihood == "simple":
            plain_errors(poses, self._body, view.kernel, distances, errors)
        else:
            change = view.background.change if view.background is not None else self._unchanged
            numbers = (self.options.key_point_px, self.options.shift_unit, self.options.min_background)
            images = (intensities, distances)
            matched_errors(poses, self._body, view.kernel, *images, numbers, change, errors, regions)

    def _run(self, jobs: Sequence[Callable[[], None]]) -> None:
        """Run all jobs, which release the interpreter lock, on the threads; raises what a job raises."""
        if self._pool is None or len(jobs) < 2:
            for job in jobs:
                job()
            return
        for done in [self._pool.submit(job) for job in jobs]:
            done.result()

    def outline(self, pose: ArrayLike, view: int) -> Floats:
        """The contour of the fitted arm in a view, (N, 2), px of the image as captured; (0, 2) if out of sight."""
        camera, small, kernel = self._views[view].camera, self._views[view].small, self._views[view].kernel
        fitted = fitted_poses(np.reshape(pose, (1, -1)), self.sizes)[0]
        contour, count = new_contour(kernel.width, kernel.height), 0
        if np.isfinite(fitted).all():
            count = outline(fitted, self._body, kernel, new_canvas(kernel.width, kernel.height), contour)
        points = np.stack([contour.x[:count], contour.y[:count]], axis=1).astype(np.float64)
        scale = np.array([camera.width_px / small.width_px, camera.height_px / small.height_px])
        return camera.distort((points + 0.5) * scale - 0.5)


def _table_mask(camera: CalibratedCamera, corners: Floats | None) -> NDArray[np.uint8]:
    """1 where the undistorted image shows the table, flat with a border of one pixel; empty without a table."""
    if corners is None:
        return np.zeros(0, np.uint8)
    corners_px = camera.project(np.column_stack([corners, np.zeros(len(corners))]), distorted=False)
    mask = np.zeros((camera.height_px + 2, camera.width_px + 2), np.uint8)
    if np.isfinite(corners_px).all():  # a table that reaches behind the camera is ignored
        inside = np.zeros((camera.height_px, camera.width_px), np.uint8)
        cv2.fillPoly(inside, [np.clip(corners_px, -1e4, 1e4).round().astype(np.int32)], 1)
        mask[1:-1, 1:-1] = inside
    return mask.reshape(-1)


def _see(view: _View, image: Image) -> None:
    """Scale down, undo the lens, and make the gradients."""
    size = (view.small.width_px, view.small.height_px)
    if image.shape[1::-1] != size:
        image = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)
    smoothed = view.edges.smoothed(view.small.undistort(image))
    if view.background is None:
        view.edges.see(smoothed)
        return
    view.background.see(smoothed)
    view.edges.see(smoothed, view.background.weights if view.background.known_fraction > 0.0 else None)
