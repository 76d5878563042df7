"""Edge images of a view: what the contour of the arm is matched against (thesis 6.6.3, 6.6.4).

The forward difference at x lies half a pixel beyond it: a point p of the image is at p - 1/2 in the edge images.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from paramove.documents import Image, Ints
from paramove.observation.edge_kernels import (
    DIRECTIONS,
    MARGIN,
    directional_intensity,
    distance_image,
    gradient_factors,
    gradient_scale,
    strongest_gradients,
    whole_intensity,
)
from paramove.observation.options import ObservationOptions

REACH_PX = 10
"""L of (6.25) and (6.23)."""


class EdgeImages:
    """The edge images of one view, computed anew by each `see`.

    Attributes:
        intensities: g_i (6.24), flat, (D, H' W'), 255 for 1, with a margin of zeros; of "simple": |g^| alone, D = 1.
        distances: the distance images (6.25), or (6.23), of the same shape.
        sharpness: the gradient, grey levels per px, that N pixels reach: near 0 for a black or covered camera.
    """

    def __init__(self, options: ObservationOptions) -> None:
        self.options = options
        self.sharpness = 0.0
        shape = (options.height_px, options.width_px)
        self.stride = shape[1] + 2 * MARGIN
        self._simple = options.likelihood == "simple"
        area = (shape[0] + 2 * MARGIN) * self.stride
        self.count = 1 if self._simple else DIRECTIONS
        self.intensities = np.zeros((self.count, area), np.uint8)
        self.distances = np.zeros((self.count, area), np.uint8)
        self._along_x, self._along_y, self._sizes, self._factors = (np.zeros(shape, np.float32) for _ in range(4))
        self._steps = (
            [disc_steps(self.stride)] if self._simple else [line_steps(i, self.stride) for i in range(DIRECTIONS)]
        )

    def smoothed(self, image: Image) -> Image:
        """The image slightly smoothed, by the options."""
        sigma = self.options.smoothing_px
        return np.asarray(cv2.GaussianBlur(image, (3, 3), sigma), np.uint8) if sigma > 0.0 else image

    def see(self, image: Image, weights: NDArray[np.float32] | None = None) -> None:
        """Gradients of an undistorted, smoothed image (H, W, 3), scaled so that N pixels reach 1.

        weights: of each pixel's gradient, 0 to 1, (H, W). `fill` completes the work.
        """
        options = self.options
        red, green, blue = (np.asarray(channel, np.uint8) for channel in cv2.split(image))
        strongest_gradients(red, green, blue, self._along_x, self._along_y)
        count = round(options.normalised_pixels * self._sizes.size / (320 * 240))
        self.sharpness = gradient_scale(self._along_x, self._along_y, count, self._sizes)
        reached = self.sharpness
        if weights is not None:
            self._along_x *= weights
            self._along_y *= weights
            reached = gradient_scale(self._along_x, self._along_y, count, self._sizes)
        self.scale = max(reached, options.min_gradient)
        gradient_factors(self._sizes, self.scale, self._factors)

    def fill(self, first: int, last: int) -> None:
        """The images of directions `first` to `last` (exclusive). Several threads may fill different ones."""
        size = (self.options.width_px, self.options.height_px)
        for i in range(first, last):
            flat = self.intensities[i]
            image = flat.reshape(-1, self.stride)
            if self._simple:
                whole_intensity(self._sizes, self.scale, image)
            else:
                directional_intensity(self._along_x, self._along_y, self._factors, i, image)
            distance_image(flat, *self._steps[i], *size, self.distances[i])


def line_steps(i: int, stride: int) -> tuple[Ints, NDArray[np.uint16]]:
    """Steps l n_i of (6.25), l > 0, rounded to pixels, as flat offsets, and their weights 256 (1 - l / L)."""
    angle = i * np.pi / DIRECTIONS
    along = np.arange(1, REACH_PX)
    offsets = np.rint(along * np.cos(angle)).astype(np.int64) * stride + np.rint(along * np.sin(angle)).astype(np.int64)
    return offsets, np.rint(256.0 * (1.0 - along / REACH_PX)).astype(np.uint16)


def disc_steps(stride: int) -> tuple[Ints, NDArray[np.uint16]]:
    """Steps q - p of (6.23) in half the disc of radius L, as flat offsets, and their weights 256 (1 - |q - p| / L)."""
    dy, dx = np.indices((2 * REACH_PX + 1, 2 * REACH_PX + 1)).reshape(2, -1) - REACH_PX
    distance = np.hypot(dx, dy)
    inside = (distance < REACH_PX) & ((dy > 0) | ((dy == 0) & (dx > 0)))
    weights = np.rint(256.0 * (1.0 - distance[inside] / REACH_PX)).astype(np.uint16)
    return (dy * stride + dx)[inside].astype(np.int64), weights
