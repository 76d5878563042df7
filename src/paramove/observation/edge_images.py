"""Edge images of a view: what the contour of the arm is matched against (thesis 6.6.3, 6.6.4).

The forward difference at x lies half a pixel beyond it: a point p of the image is at p - 1/2 in the edge images.
Edge images are bytes, 255 for 1, in flat arrays with a margin of zeros, so that no address has to be tested. A whole
image of one direction lies before the next.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from paramove.documents import Bytes, Image, Ints
from paramove.hmm import compiled, compiled_sums
from paramove.observation.options import ObservationOptions

Floats32 = NDArray[np.float32]

MARGIN = 32
"""Width of the border of zeros about an edge image; shifts, distance search and samples 10 px aside stay within it."""
DIRECTIONS = 10
"""D: search directions n_i = (sin(i pi / D), cos(i pi / D))."""
SINES, COSINES = (
    function(np.arange(DIRECTIONS) * np.pi / DIRECTIONS).astype(np.float32) for function in (np.sin, np.cos)
)
BINS_PER_LEVEL = 4
"""Bins of the histogram of gradients in one grey level."""
MAX_BINS = 361 * BINS_PER_LEVEL + 1
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


@compiled_sums
def strongest_gradients(red: Bytes, green: Bytes, blue: Bytes, along_x: Floats32, along_y: Floats32) -> None:
    """g(x, y): forward differences of the channel whose gradient is largest (corrected). All of shape (H, W).

    The last row and column have no forward difference and stay 0.
    """
    height, width = red.shape
    for y in range(height - 1):
        for x in range(width - 1):
            dx = np.int32(red[y, x + 1]) - np.int32(red[y, x])
            dy = np.int32(red[y + 1, x]) - np.int32(red[y, x])
            best = np.int32(dx * dx + dy * dy)
            ex = np.int32(green[y, x + 1]) - np.int32(green[y, x])
            ey = np.int32(green[y + 1, x]) - np.int32(green[y, x])
            size = np.int32(ex * ex + ey * ey)
            dx, dy, best = (ex, ey, size) if size > best else (dx, dy, best)
            ex = np.int32(blue[y, x + 1]) - np.int32(blue[y, x])
            ey = np.int32(blue[y + 1, x]) - np.int32(blue[y, x])
            size = np.int32(ex * ex + ey * ey)
            dx, dy, best = (ex, ey, size) if size > best else (dx, dy, best)
            along_x[y, x], along_y[y, x] = np.float32(dx), np.float32(dy)


@compiled
def gradient_scale(along_x: Floats32, along_y: Floats32, count: int, sizes: Floats32) -> float:
    """n: the largest gradient (to a quarter of a grey level) that at least `count` pixels reach. Fills `sizes`."""
    histogram = np.zeros(MAX_BINS, np.int64)
    flat_x, flat_y, flat = along_x.reshape(-1), along_y.reshape(-1), sizes.reshape(-1)
    for i in range(len(flat)):
        flat[i] = np.sqrt(flat_x[i] * flat_x[i] + flat_y[i] * flat_y[i])
    for i in range(len(flat)):
        histogram[np.int32(flat[i] * np.float32(BINS_PER_LEVEL))] += 1
    reached, bin_index = 0, MAX_BINS
    while bin_index > 0 and reached < count:
        bin_index -= 1
        reached += histogram[bin_index]
    return bin_index / BINS_PER_LEVEL


@compiled_sums
def gradient_factors(sizes: Floats32, scale: float, factors: Floats32) -> None:
    """255 |g^| / |g|^2, which times the square of g along a direction is (6.24) for alpha = 2; 0 where g is 0."""
    flat, out = sizes.reshape(-1), factors.reshape(-1)
    unit = np.float32(scale)
    for i in range(len(flat)):
        size = max(flat[i], np.float32(1e-3))
        out[i] = np.float32(255.0) / (size * max(size, unit))


@compiled_sums
def directional_intensity(along_x: Floats32, along_y: Floats32, factors: Floats32, i: int, image: Bytes) -> None:
    """g_i (6.24), alpha = 2, into one image with its margin (H', W')."""
    height, width = along_x.shape
    sx, sy, half = SINES[i], COSINES[i], np.float32(0.5)
    for y in range(height):
        row = image[y + MARGIN]
        gx, gy, factor = along_x[y], along_y[y], factors[y]
        for x in range(width):
            part = gx[x] * sx + gy[x] * sy
            row[x + MARGIN] = np.uint8(np.int32(part * part * factor[x] + half))


@compiled_sums
def whole_intensity(sizes: Floats32, scale: float, image: Bytes) -> None:
    """|g^| into one image with its margin (H', W')."""
    height, width = sizes.shape
    unit = np.float32(255.0 / scale)
    for y in range(height):
        row = image[y + MARGIN]
        for x in range(width):
            row[x + MARGIN] = np.uint8(np.int32(min(sizes[y, x] * unit, np.float32(255.0)) + np.float32(0.5)))


@compiled_sums
def distance_image(
    source: Bytes, steps: Ints, weights: NDArray[np.uint16], width: int, height: int, out: Bytes
) -> None:
    """max over the steps of source(p +- step) * weight / 256, for all p inside; (6.25) and (6.23), flat images.

    steps: flat offsets in one half plane, (S,); weights: 256 (1 - distance / L), (S,).
    """
    stride = width + 2 * MARGIN
    best = np.empty(width, np.uint8)
    for y in range(height):
        begin = (y + MARGIN) * stride + MARGIN
        best[:] = source[begin : begin + width]
        for j in range(len(steps)):
            there = source[begin + steps[j] : begin + steps[j] + width]
            opposite = source[begin - steps[j] : begin - steps[j] + width]
            weight = weights[j]
            for x in range(width):
                value = np.uint16(max(there[x], opposite[x]))
                best[x] = max(best[x], np.uint8(np.uint16(value * weight) >> np.uint16(8)))
        out[begin : begin + width] = best
