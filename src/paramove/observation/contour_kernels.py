"""Kernels of the contour: traced as a closed loop (thesis 6.6.2), key points, normals, segments between key points."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Bytes
from paramove.hmm import compiled, compiled_arithmetic
from paramove.observation.edge_images import COSINES, DIRECTIONS, MARGIN, SINES
from paramove.observation.segment_sums import BASE, FIELDS, FRACTION, LANES, NX, NY, PX, PY

Floats32 = NDArray[np.float32]
Ints32 = NDArray[np.int32]

MIN_POINTS = 24
"""A shorter contour is ignored: the arm is nearly out of sight."""
EVERY = 2
"""Of the contour pixels every second one is compared: in a smoothed image the one between adds nothing."""
NORMAL_STEP = 4
"""The normal at a point is across the line between the points this many pixels before and after it."""

STEPS_X = np.array([-1, -1, 0, 1, 1, 1, 0, -1], np.int32)
STEPS_Y = np.array([0, 1, 1, 1, 0, -1, -1, -1], np.int32)
"""The eight neighbours of a pixel, counterclockwise as seen in the image, from the left one on."""


def next_steps() -> NDArray[np.int8]:
    """For each neighbour that the loop came from and each set of neighbours that are in the mask, as bits: the next.

    The first neighbour in the mask after the one that the loop came from, which is tried last; -1: none. Flat, 8 x 256.
    """
    orders = (np.arange(8)[:, None] + np.arange(1, 9)) & 7
    in_mask = np.arange(256)[None, :, None] >> orders[:, None, :] & 1
    neighbour = np.take_along_axis(orders[:, None, :], in_mask.argmax(axis=2)[:, :, None], axis=2)[:, :, 0]
    return np.where(in_mask.any(axis=2), neighbour, -1).astype(np.int8).reshape(-1)


NEXT_STEPS = next_steps()


class Contour(NamedTuple):
    """A contour and its segments; arrays are large enough for any contour of the image.

    Attributes:
        x, y: contour pixels in order, (N_max,).
        starts: index of each key point in the contour, (K_max + 1,); starts[K] = N.
        normals: outward at the key points, (2, K_max).
        keys: the key points, (2, K_max), in the edge images' coordinates without margin.
        lanes: of each segment, (FIELDS, (K_max + 1) LANES). Segment k is at slot k + 1; slot 0 repeats the last one, so
            that the two segments about key point k are at slots k and k + 1.
    """

    x: Ints32
    y: Ints32
    starts: Ints32
    normals: Floats32
    keys: Floats32
    lanes: Floats32


@compiled
def new_contour(width: int, height: int) -> Contour:
    """Room for a contour in an image of this size."""
    maximum = 6 * (width + height)
    segments = maximum // 3
    return Contour(
        np.empty(maximum, np.int32),
        np.empty(maximum, np.int32),
        np.empty(segments + 1, np.int32),
        np.empty((2, segments), np.float32),
        np.empty((2, segments), np.float32),
        np.zeros((FIELDS, (segments + 1) * LANES), np.float32),
    )


@compiled
def trace(mask: Bytes, width: int, row: int, left: int, contour: Contour) -> int:
    """Contour pixels, counterclockwise, from the first silhouette pixel of a row on; their number.

    mask has one pixel of zeros about the image. `left` is a column at or before that pixel. The loop ends where its
    first step would be repeated, so that it may pass its first pixel on the way.
    """
    stride, xs, ys = width + 2, contour.x, contour.y
    steps = (-1, stride - 1, stride, stride + 1, 1, 1 - stride, -stride, -stride - 1)
    x, y = np.int32(left), np.int32(row)
    pixel = (row + 1) * stride + left + 1
    while x < width and mask[pixel] == 0:
        x, pixel = np.int32(x + 1), pixel + 1
    if x == width:
        return 0
    maximum, count, first, first_step, came_from = len(xs), 0, pixel, -1, 0
    one, line = np.uint64(1), np.uint64(stride)  # unsigned: such an index is not tested for counting from the end
    while count < maximum:
        here = np.uint64(pixel)
        above, below = here - line, here + line
        code = mask[here - one] | mask[below - one] << 1 | mask[below] << 2 | mask[below + one] << 3
        code |= mask[here + one] << 4 | mask[above + one] << 5 | mask[above] << 6 | mask[above - one] << 7
        step = NEXT_STEPS[np.uint64(came_from << 8 | code)]
        if step < 0:  # a single pixel
            xs[0], ys[0] = x, y
            return 1
        if pixel == first and step == first_step:
            return count
        if count == 0:
            first_step = step
        xs[np.uint64(count)], ys[np.uint64(count)] = x, y
        count += 1
        pixel, x, y = pixel + steps[step], np.int32(x + STEPS_X[step]), np.int32(y + STEPS_Y[step])
        came_from = (step + 4) & 7
    return count


@compiled_arithmetic
def place_key_points(count: int, spacing: float, contour: Contour) -> int:
    """Key points every `spacing` px and their outward normals; returns K.

    A contour pixel lies half a pixel inside the outline, and the edge images half a pixel up and left.
    """
    number = max(int(np.round(count / spacing)), (count + EVERY * LANES - 1) // (EVERY * LANES))
    half = np.float32(0.5)
    for k in range(number):
        i = (k * count) // number
        contour.starts[k] = i
        before, after = i - NORMAL_STEP, i + NORMAL_STEP
        before = before + count if before < 0 else before
        after = after - count if after >= count else after
        along_x = np.float32(contour.x[after] - contour.x[before])
        along_y = np.float32(contour.y[after] - contour.y[before])
        size = np.sqrt(along_x * along_x + along_y * along_y)
        nx = -along_y / size if size > np.float32(0.0) else np.float32(0.0)
        ny = along_x / size if size > np.float32(0.0) else np.float32(1.0)
        contour.normals[0, k], contour.normals[1, k] = nx, ny
        contour.keys[0, k] = np.float32(contour.x[i]) + half * nx - half
        contour.keys[1, k] = np.float32(contour.y[i]) + half * ny - half
    contour.starts[number] = count
    return number


@compiled_arithmetic
def fill_segments(number: int, area: int, contour: Contour) -> int:
    """Positions, normals and directions of the compared contour points, segment by segment; returns their number.

    Normals between key points are interpolated. A segment is filled up with points in the margin.
    """
    lanes, aside, points = contour.lanes, np.float32(1 - MARGIN), 0
    for k in range(number):
        after = k + 1 if k + 1 < number else 0
        begin, length, at = contour.starts[k], contour.starts[k + 1] - contour.starts[k], (k + 1) * LANES
        nx, ny = contour.normals[0, k], contour.normals[1, k]
        change_x, change_y = contour.normals[0, after] - nx, contour.normals[1, after] - ny
        step, taken = np.float32(EVERY) / np.float32(length), (length + EVERY - 1) // EVERY
        points += taken
        for lane in range(taken):
            fraction = np.float32(lane) * step
            lanes[FRACTION, at + lane] = fraction
            lanes[NX, at + lane], lanes[NY, at + lane] = nx + fraction * change_x, ny + fraction * change_y
            lanes[PX, at + lane] = np.float32(contour.x[begin + EVERY * lane])
            lanes[PY, at + lane] = np.float32(contour.y[begin + EVERY * lane])
        for lane in range(taken, LANES):
            lanes[FRACTION, at + lane] = lanes[NX, at + lane] = lanes[NY, at + lane] = np.float32(0.0)
            lanes[PX, at + lane] = lanes[PY, at + lane] = aside
    place_points(lanes[PX], lanes[PY], lanes[NX], lanes[NY], (number + 1) * LANES)
    choose_directions(lanes[NX], lanes[NY], area, lanes[BASE], (number + 1) * LANES)
    for field in range(FIELDS):
        for lane in range(LANES):
            lanes[field, lane] = lanes[field, number * LANES + lane]
    return points


@compiled_arithmetic
def place_points(px: Floats32, py: Floats32, nx: Floats32, ny: Floats32, end: int) -> None:
    """Normals get length 1; points move half a pixel outward, half up and left, half for rounding, and the margin."""
    half, offset = np.float32(0.5), np.float32(MARGIN)
    for i in range(LANES, end):
        shrink = np.float32(1.0) / np.sqrt(max(nx[i] * nx[i] + ny[i] * ny[i], np.float32(1e-6)))
        x, y = nx[i] * shrink, ny[i] * shrink
        nx[i], ny[i] = x, y
        px[i] += half * x + offset
        py[i] += half * y + offset


@compiled_arithmetic
def choose_directions(nx: Floats32, ny: Floats32, area: int, base: Floats32, end: int) -> None:
    """b_i H' W' of all points: b_i is the direction most nearly parallel to the normal."""
    for i in range(LANES, end):
        x, y, nearest, chosen = nx[i], ny[i], np.float32(-1.0), np.float32(0.0)
        for d in range(DIRECTIONS):
            value = abs(x * SINES[d] + y * COSINES[d])
            chosen = np.float32(d) if value > nearest else chosen
            nearest = max(value, nearest)
        base[i] = chosen * np.float32(area)
