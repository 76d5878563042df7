"""Kernels of the edge images: gradients, directional intensities (6.24), distance images (6.25) and (6.23).

Edge images are bytes, 255 for 1, in flat arrays with a margin of zeros, so that no address has to be tested. A whole
image of one direction lies before the next.
"""

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Bytes, Ints
from paramove.hmm import compiled, compiled_sums

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
