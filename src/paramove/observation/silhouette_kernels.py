"""Kernels that draw the silhouette of the projected arm: outlines of its parts as convex polygons, filled by rows.

A sphere or ellipsoid projects to an ellipse: with c its centre and M = A A^T its shape in the camera's frame, the lines
that touch the ellipse satisfy l^T (M - c c^T) l = 0. The point of an ellipse furthest in a direction is known in closed
form, and the furthest point of a hull of two ellipses is the further one of theirs: so the hulls need no search.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Bytes, Floats
from paramove.hmm import compiled, compiled_arithmetic

Ints32 = NDArray[np.int32]

CORNERS = 32
"""Corners of the polygon of one part."""
NEAREST_M = 0.02
"""A part less far before the camera than this is not drawn."""

TURN = 2.0 * np.pi * np.arange(CORNERS) / CORNERS
COSINES, SINES = np.cos(TURN), np.sin(TURN)


class Camera(NamedTuple):
    """What a kernel needs of a camera: rotation (3, 3) and shift (3,) of the world, matrix (3, 3), size, px.

    table: 1 where the table is visible, flat with one pixel of zeros about the image; of length 0 if there is none.
    """

    rotation: Floats
    shift: Floats
    matrix: Floats
    width: int
    height: int
    table: Bytes


class Canvas(NamedTuple):
    """Where one thread draws.

    Attributes:
        mask: 1 in the silhouette, flat (height + 2) (width + 2), one pixel of zeros about the image.
        left, right: first and last column drawn in each row, (height,).
        ends: first and last column of the polygon that is being drawn in each row, (2, height).
        corners: of that polygon, (2, CORNERS), px.
        ellipses: of shoulder, elbow, wrist and hand: centre x y, shape xx xy yy, px; (4, 5).
        points: shoulder, elbow, hand, wrist in the camera's frame, (4, 3), m.
        axes: of the hand in that frame, (3, 3); centre, shape: of the part that is being projected, (3,), (3, 3).
    """

    mask: Bytes
    left: Ints32
    right: Ints32
    ends: Floats
    corners: Floats
    ellipses: Floats
    points: Floats
    axes: Floats
    centre: Floats
    shape: Floats


@compiled
def new_canvas(width: int, height: int) -> Canvas:
    """An empty canvas for images of this size."""
    return Canvas(
        np.zeros((width + 2) * (height + 2), np.uint8),
        np.full(height, width, np.int32),
        np.full(height, -1, np.int32),
        np.empty((2, height)),
        np.empty((2, CORNERS)),
        np.empty((4, 5)),
        np.empty((4, 3)),
        np.empty((3, 3)),
        np.empty(3),
        np.empty((3, 3)),
    )


@compiled_arithmetic
def project_ellipsoid(centre: Floats, shape: Floats, matrix: Floats, ellipse: Floats) -> bool:
    """The ellipse, px, to which an ellipsoid projects; centre (3,) and shape (3, 3) in the camera's frame, m."""
    x, y, z = centre[0], centre[1], centre[2]
    below = z * z - shape[2, 2]
    if z < NEAREST_M or not below > NEAREST_M * NEAREST_M:
        return False
    u, v = (x * z - shape[0, 2]) / below, (y * z - shape[1, 2]) / below
    xx = u * u + (shape[0, 0] - x * x) / below
    xy = u * v + (shape[0, 1] - x * y) / below
    yy = v * v + (shape[1, 1] - y * y) / below
    fx, skew, fy = matrix[0, 0], matrix[0, 1], matrix[1, 1]
    ellipse[0] = fx * u + skew * v + matrix[0, 2]
    ellipse[1] = fy * v + matrix[1, 2]
    ellipse[2] = fx * fx * xx + 2.0 * fx * skew * xy + skew * skew * yy
    ellipse[3] = fy * (fx * xy + skew * yy)
    ellipse[4] = fy * fy * yy
    return True


@compiled_arithmetic
def arm_ellipses(pose: Floats, body: Floats, camera: Camera, canvas: Canvas) -> bool:
    """Ellipses of shoulder, elbow, wrist and hand; False if a part is not before the camera.

    pose: shoulder, elbow, hand, (9,), the wrist then on the line from elbow to hand; or also the wrist, (12,);
    body: forearm, hand, radii of shoulder, elbow and wrist, width and thickness of the hand, m; (7,).
    """
    points, matrix, ellipses = canvas.points, camera.matrix, canvas.ellipses
    for i in range(len(pose) // 3):
        for j in range(3):
            points[i, j] = camera.shift[j]
            for k in range(3):
                points[i, j] += camera.rotation[j, k] * pose[3 * i + k]
    if len(pose) == 9:
        put_wrist_straight(points, body[0])
    hand_axes(points, canvas.axes)
    along, centre, shape = canvas.axes[0], canvas.centre, canvas.shape
    for number in range(4):
        at, further = (number, 0.0) if number < 2 else (3, 0.0 if number == 2 else 0.5 * body[1])
        for i in range(3):
            centre[i] = points[at, i] + further * along[i]
            for j in range(3):
                shape[i, j] = 0.0 if number == 3 or i != j else body[2 + min(number, 2)] ** 2
        if number == 3:
            for axis in range(3):
                half = 0.5 * body[1 if axis == 0 else 4 + axis]
                for i in range(3):
                    for j in range(3):
                        shape[i, j] += half * half * canvas.axes[axis, i] * canvas.axes[axis, j]
        if not project_ellipsoid(centre, shape, matrix, ellipses[number]):
            return False
    return True


@compiled_arithmetic
def put_wrist_straight(points: Floats, forearm: float) -> None:
    """The wrist on the line from elbow to hand."""
    length = 0.0
    for i in range(3):
        length += (points[2, i] - points[1, i]) ** 2
    for i in range(3):
        points[3, i] = points[1, i] + forearm * (points[2, i] - points[1, i]) / np.sqrt(length)


@compiled_arithmetic
def hand_axes(points: Floats, axes: Floats) -> None:
    """Unit vectors along the hand, across it in the plane of the arm's bend, and at right angles; (3, 3)."""
    size, length, dot, width = 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        axes[0, i] = points[2, i] - points[3, i]
        axes[2, i] = points[2, i] - points[1, i]
        size += axes[0, i] ** 2
        length += axes[2, i] ** 2
        dot += (points[0, i] - points[1, i]) * axes[2, i]
    along = 0.0
    for i in range(3):
        axes[0, i] /= np.sqrt(size)
        axes[1, i] = points[0, i] - points[1, i] - dot / length * axes[2, i]
        along += axes[1, i] * axes[0, i]
    for i in range(3):
        axes[1, i] -= along * axes[0, i]
        width += axes[1, i] ** 2
    if width < 1e-18:  # a stretched arm defines no plane: the width lies across the view
        axes[1, 0], axes[1, 1], axes[1, 2] = -axes[0, 1], axes[0, 0], 1e-9
        width = axes[0, 0] ** 2 + axes[0, 1] ** 2 + 1e-18
    for i in range(3):
        axes[1, i] /= np.sqrt(width)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        axes[2, i] = axes[0, j] * axes[1, k] - axes[0, k] * axes[1, j]


@compiled_arithmetic
def hull_corners(first: Floats, second: Floats, corners: Floats) -> None:
    """Corners of the convex hull of two ellipses: the furthest point in each of CORNERS directions."""
    for i in range(CORNERS):
        dx, dy = COSINES[i], SINES[i]
        ax, ay = first[2] * dx + first[3] * dy, first[3] * dx + first[4] * dy
        bx, by = second[2] * dx + second[3] * dy, second[3] * dx + second[4] * dy
        a, b = np.sqrt(ax * dx + ay * dy), np.sqrt(bx * dx + by * dy)
        take = first[0] * dx + first[1] * dy + a >= second[0] * dx + second[1] * dy + b
        corners[0, i] = first[0] + ax / a if take else second[0] + bx / b
        corners[1, i] = first[1] + ay / a if take else second[1] + by / b


@compiled_arithmetic
def fill_polygon(camera_size: tuple[int, int], canvas: Canvas) -> tuple[int, int, bool]:
    """Draw the convex polygon of `canvas.corners`. First and last row drawn (last < first: none), and if it was cut."""
    width, height = camera_size
    xs, ys = canvas.corners[0], canvas.corners[1]
    left, right, upmost, lowest = xs[0], xs[0], ys[0], ys[0]
    for i in range(1, CORNERS):
        left, right = min(left, xs[i]), max(right, xs[i])
        upmost, lowest = min(upmost, ys[i]), max(lowest, ys[i])
    top, bottom = max(np.ceil(upmost), 0.0), min(np.floor(lowest), height - 1.0)
    cut = upmost < 0.0 or lowest > height - 1.0 or left < 0.0 or right > width - 1.0
    first, last = int(min(top, float(height))), int(max(bottom, -1.0))
    starts, ends = canvas.ends[0], canvas.ends[1]
    for y in range(first, last + 1):
        starts[y], ends[y] = 1e9, -1e9
    for i in range(CORNERS):
        j = i + 1 if i + 1 < CORNERS else 0
        upper, lower = (i, j) if ys[i] <= ys[j] else (j, i)
        begin, end = max(np.ceil(ys[upper]), 0.0), min(np.floor(ys[lower]), height - 1.0)
        if begin > end:
            continue
        slope = (xs[lower] - xs[upper]) / (ys[lower] - ys[upper]) if ys[lower] > ys[upper] else 0.0
        x = xs[upper] + slope * (begin - ys[upper])
        for y in range(int(begin), int(end) + 1):
            starts[y] = min(starts[y], x)
            ends[y] = max(ends[y], x)
            x += slope
    return _fill_rows(width, first, last, cut, canvas)


@compiled
def _fill_rows(width: int, first: int, last: int, cut: bool, canvas: Canvas) -> tuple[int, int, bool]:
    """Set the mask between the ends of each row."""
    top, bottom = last + 1, first - 1
    for y in range(first, last + 1):
        begin = max(np.int32(np.ceil(canvas.ends[0, y])), np.int32(0))
        end = min(np.int32(np.floor(canvas.ends[1, y])), np.int32(width - 1))
        if begin > end:
            continue
        top, bottom = min(top, y), y
        canvas.left[y] = min(canvas.left[y], begin)
        canvas.right[y] = max(canvas.right[y], end)
        offset = (y + 1) * (width + 2) + 1
        canvas.mask[offset + begin : offset + end + 1] = 1
    return top, bottom, cut


@compiled
def draw_arm(pose: Floats, body: Floats, camera: Camera, canvas: Canvas) -> tuple[int, int, int]:
    """Draw the arm's silhouette. First and last row (last < first: nothing is visible), and the row to trace it from.

    The outline is traced from the first row of all, or, where the image cuts the arm and may have parted it, from the
    first row of the forearm or hand.
    """
    width, height = camera.width, camera.height
    top, bottom, trace_from, cut = height, -1, height, False
    if not arm_ellipses(pose, body, camera, canvas):
        return 0, -1, 0
    for part in range(3):
        first, second = (part, part + 1) if part < 2 else (3, 3)
        hull_corners(canvas.ellipses[first], canvas.ellipses[second], canvas.corners)
        part_top, part_bottom, part_cut = fill_polygon((width, height), canvas)
        if part_bottom >= part_top:
            top, bottom = min(top, part_top), max(bottom, part_bottom)
            if part > 0:
                trace_from = min(trace_from, part_top)
        cut = cut or part_cut
    begin = trace_from if cut and trace_from < height else top
    if len(camera.table) > 0 and pose[8] < 0.0 and bottom >= top:
        hide_below_table(pose, camera, top, bottom, canvas)
        begin = first_row(begin, bottom, width, canvas)
    return top, bottom, begin


@compiled_arithmetic
def hide_below_table(pose: Floats, camera: Camera, top: int, bottom: int, canvas: Canvas) -> None:
    """Takes from the silhouette what lies below the table, z < 0 in the world, and is visible where the table is.

    That is all beyond the point where the arm's axis crosses the plane.
    """
    ends, through = np.empty((2, 2)), 1 if pose[5] > 0.0 else 0
    upper, lower = pose[3 * through + 2], pose[3 * through + 5]
    fraction = upper / (upper - lower) if upper > 0.0 else 0.0
    for end in range(2):
        along = fraction if end == 0 else 1.0
        x, y, z = 0.0, 0.0, 0.0
        for i in range(3):
            here, there = canvas.points[through, i], canvas.points[through + 1, i]
            value = here + along * (there - here)
            x += camera.matrix[0, i] * value
            y += camera.matrix[1, i] * value
            z += camera.matrix[2, i] * value
        if z < NEAREST_M:
            return
        ends[end, 0], ends[end, 1] = x / z, y / z
    dx, dy = ends[1, 0] - ends[0, 0], ends[1, 1] - ends[0, 1]
    for row in range(top, bottom + 1):
        offset = (row + 1) * (camera.width + 2) + 1
        beyond = (row - ends[0, 1]) * dy - ends[0, 0] * dx
        for column in range(canvas.left[row], canvas.right[row] + 1):
            if camera.table[offset + column] != 0 and beyond + column * dx > 0.0:
                canvas.mask[offset + column] = 0


@compiled
def first_row(begin: int, bottom: int, width: int, canvas: Canvas) -> int:
    """The first row from `begin` on in which something of the silhouette is left; `begin` if none has."""
    for row in range(begin, bottom + 1):
        offset = (row + 1) * (width + 2) + 1
        for column in range(canvas.left[row], canvas.right[row] + 1):
            if canvas.mask[offset + column] != 0:
                return row
    return begin


@compiled
def wipe(top: int, bottom: int, width: int, canvas: Canvas) -> None:
    """Empty the canvas between these rows."""
    for y in range(top, bottom + 1):
        offset = (y + 1) * (width + 2) + 1
        if canvas.right[y] >= canvas.left[y]:
            canvas.mask[offset + canvas.left[y] : offset + canvas.right[y] + 1] = 0
        canvas.left[y], canvas.right[y] = width, -1
