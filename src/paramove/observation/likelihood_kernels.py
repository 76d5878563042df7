"""Kernels of the likelihood: errors of matched contours (6.27) and of plain ones (6.21), for many postures."""

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Bytes, Floats
from paramove.hmm import compiled, compiled_arithmetic, compiled_sums
from paramove.observation.contour_kernels import (
    MIN_POINTS,
    Contour,
    fill_segments,
    new_contour,
    place_key_points,
    trace,
)
from paramove.observation.edge_images import MARGIN
from paramove.observation.matching_kernels import Shifts, match, new_shifts
from paramove.observation.segment_sums import BASE, FRACTION, LANES, NX, NY, PX, PY
from paramove.observation.silhouette_kernels import Camera, Canvas, draw_arm, new_canvas, wipe

Signed = NDArray[np.int8]
Floats32 = NDArray[np.float32]

LOOK_ASIDE = np.float32(10.0)
"""Pixels along the normal at which G+ looks for gradients of the same direction."""
BETA = np.float32(1.0 / 7.5)
"""1 / beta_1; beta_2 = 2."""
SCRATCH = 5
"""Rows of numbers, one a contour point, that the strengths need."""


@compiled
def outline(pose: Floats, body: Floats, camera: Camera, canvas: Canvas, contour: Contour) -> int:
    """The contour of the projected arm; its number of points, 0 if it is nearly out of sight."""
    top, bottom, start = draw_arm(pose, body, camera, canvas)
    count = 0
    if bottom >= top:
        count = trace(canvas.mask, camera.width, start, canvas.left[start], contour)
        wipe(top, bottom, camera.width, canvas)
    return count if count >= MIN_POINTS else 0


@compiled
def outline_over(
    pose: Floats, body: Floats, camera: Camera, canvas: Canvas, contour: Contour, change: Signed
) -> tuple[int, int, int]:
    """`outline`, and of the silhouette the sum of the changes under it and its area, px."""
    top, bottom, start = draw_arm(pose, body, camera, canvas)
    count, total, area = 0, 0, 0
    if bottom >= top:
        count = trace(canvas.mask, camera.width, start, canvas.left[start], contour)
        total, area = covered(canvas.mask, change, top, bottom, camera.width, canvas.left, canvas.right)
        wipe(top, bottom, camera.width, canvas)
    return count if count >= MIN_POINTS else 0, total, area


@compiled
def covered(mask: Bytes, change: Signed, top: int, bottom: int, width: int, left: NDArray[np.int32],
            right: NDArray[np.int32]) -> tuple[int, int]:  # fmt: skip
    """Sum of the changes under a silhouette and its area, px; mask and change flat with a border of one pixel."""
    total, area = np.int32(0), np.int32(0)
    for y in range(top, bottom + 1):
        offset = (y + 1) * (width + 2) + 1
        inside, changed = (
            mask[offset + left[y] : offset + right[y] + 1],
            change[offset + left[y] : offset + right[y] + 1],
        )
        for x in range(len(inside)):
            total += np.int32(inside[x]) * np.int32(changed[x])
            area += np.int32(inside[x])
    return int(total), int(area)


@compiled
def silhouette(pose: Floats, body: Floats, camera: Camera, canvas: Canvas, out: Bytes) -> None:
    """Writes 1 where the arm is visible, else 0, into an image (H, W)."""
    top, bottom, _ = draw_arm(pose, body, camera, canvas)
    stride = camera.width + 2
    for y in range(camera.height):
        out[y] = canvas.mask[(y + 1) * stride + 1 : (y + 2) * stride - 1]
    if bottom >= top:
        wipe(top, bottom, camera.width, canvas)


@compiled_arithmetic
def strengths(
    images: Bytes, stride: int, number: int, minimum: float, contour: Contour, shifts: Shifts, out: Floats32
) -> None:
    """G+ of every contour point after the matching, from the intensities g_b (corrected).

    out: (SCRATCH, slots LANES); its first row takes the result, in the order of `contour.lanes`.
    """
    end = (number + 1) * LANES
    moved, fraction = out[1], contour.lanes[FRACTION]
    for k in range(number):
        here, there = shifts.shift[k], shifts.shift[k + 1 if k + 1 < number else 0]
        for lane in range(LANES):
            at = np.uint64((k + 1) * LANES + lane)
            moved[at] = here + fraction[at] * (there - here)
    for row in range(3):
        side = np.float32(0.0) if row == 0 else LOOK_ASIDE if row == 1 else -LOOK_ASIDE
        addresses(contour.lanes, out[1], side, np.float32(stride), end, out[2])
        taken = out[0] if row == 0 else out[2 + row]
        for i in range(LANES, end):
            taken[i] = np.float32(images[np.uint32(np.int32(out[2, i]))])
    boosted(out[1], out[3], out[4], np.float32(255.0 * minimum), end, out[0])


@compiled_arithmetic
def addresses(lanes: Floats32, shift: Floats32, aside: np.float32, stride: np.float32, end: int, out: Floats32) -> None:
    """Flat addresses of the contour points moved by their shift and by `aside` along their normals; exact to 2^24."""
    px, py, nx, ny, base = lanes[PX], lanes[PY], lanes[NX], lanes[NY], lanes[BASE]
    for i in range(LANES, end):
        move = shift[i] + aside
        x, y = np.float32(np.int32(px[i] + move * nx[i])), np.float32(np.int32(py[i] + move * ny[i]))
        out[i] = y * stride + x + base[i]


@compiled_arithmetic
def boosted(shift: Floats32, one: Floats32, other: Floats32, minimum: np.float32, end: int, values: Floats32) -> None:
    """x of the matched points, 0 to 255, becomes G+ (corrected), 0 to 1, with z the larger of what lies beside."""
    full = np.float32(255.0)
    for i in range(LANES, end):
        x, far = values[i], shift[i] * BETA
        ratio = max(x / max(max(one[i], other[i]), minimum), np.float32(1.0))
        values[i] = min(full, x * ratio * ratio) / (full * (np.float32(1.0) + far * far))


@compiled_sums
def mean_error(number: int, points: int, values: Floats32) -> float:
    """Mean of (1 - G)^2 over the contour, (6.27). Points that fill up segments lie in the margin, where G is 0."""
    end, total = (number + 1) * LANES, np.float32(0.0)
    for i in range(LANES, end):
        total += (np.float32(1.0) - values[i]) ** 2
    return float(total - (number * LANES - points)) / points


@compiled
def plain_error(image: Bytes, stride: int, points: int, contour: Contour) -> float:
    """Mean of (1 - G)^2 over the contour pixels as they are, (6.21), half a pixel shifted (corrected).

    An edge image's pixel lies at + 1/2, so a contour pixel is in the middle of four: their mean counts.
    """
    total = 0.0
    for i in range(points):
        offset = (contour.y[i] + MARGIN) * stride + contour.x[i] + MARGIN
        four = (
            int(image[offset]) + int(image[offset - 1]) + int(image[offset - stride]) + int(image[offset - stride - 1])
        )
        total += (1.0 - four / 1020.0) ** 2
    return total / points


@compiled
def matched_errors(
    poses: Floats,
    body: Floats,
    camera: Camera,
    intensities: Bytes,
    distances: Bytes,
    numbers: tuple[float, float, float],
    change: Signed,
    errors: Floats,
    regions: Floats,
) -> None:
    """Mean of (1 - G+)^2 of each posture (M, 9) in one view, into errors (M,); 1 if it is out of sight.

    intensities, distances: flat edge images of all directions;
    numbers: spacing of key points, unit of the shifts, smallest background;
    change: of each pixel from the background; its sum under the silhouette and the area go into regions (2, M).
    """
    stride = camera.width + 2 * MARGIN
    area = stride * (camera.height + 2 * MARGIN)
    canvas, contour = new_canvas(camera.width, camera.height), new_contour(camera.width, camera.height)
    shifts = new_shifts(len(contour.starts))
    values = np.empty((SCRATCH, len(contour.lanes[0])), np.float32)
    for i in range(len(poses)):
        errors[i] = 1.0
        points, regions[0, i], regions[1, i] = outline_over(poses[i], body, camera, canvas, contour, change)
        if points > 0:
            number = place_key_points(points, numbers[0], contour)
            points = fill_segments(number, area, contour)
            match(distances, stride, number, points, numbers[1], contour, shifts)
            strengths(intensities, stride, number, numbers[2], contour, shifts, values)
            errors[i] = mean_error(number, points, values[0])


@compiled
def plain_errors(poses: Floats, body: Floats, camera: Camera, image: Bytes, errors: Floats) -> None:
    """Mean of (1 - G)^2 of each posture (M, 9) in one view without matching, into errors (M,)."""
    canvas, contour = new_canvas(camera.width, camera.height), new_contour(camera.width, camera.height)
    for i in range(len(poses)):
        errors[i] = 1.0
        points = outline(poses[i], body, camera, canvas, contour)
        if points > 0:
            errors[i] = plain_error(image, camera.width + 2 * MARGIN, points, contour)
