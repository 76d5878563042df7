"""Where things stand: the strip on the working plane, and the places out of the camera's sight. Shoulder frame, m."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from paramove.documents import Floats
from sim import tool_box

START = (0.165, -0.02)
"""Marked on the table: where a person stands an object for the robot, at first and where it needs help."""
STRIP_X = (0.168, 0.186)
STRIP_Y = (-0.100, 0.065)
MIN_GAP = 0.050  # between the axes of two cylinders

APPROACH = 0.100  # hand and wrist lie along this part before an object
FINGERS_BEYOND = 0.037  # and reaches so far past its axis
HALF_WIDTH_RIGHT = 0.037  # of the swept open hand and its clearance, on the side of the fingers
HALF_WIDTH_LEFT = 0.034  # on the side of the open thumb
ELBOW = np.array((0.02, -0.06))  # about where the elbow is while the hand is over the box: the forearm comes from there

IDLE_FINGERTIP = np.array((0.40, -0.52, 0.00))
PARKED = tuple(
    np.array((0.24 + 0.06 * place, -0.60, tool_box.TABLE_Z + tool_box.CYLINDER_HALF_HEIGHT)) for place in range(3)
)


def draw_layout(draw: np.random.Generator, count: int = 3) -> tuple[Floats, int]:
    """Places of `count` cylinders on the strip, [count, 2], and how many layouts were drawn again because the swept
    open hand would touch another cylinder. Layouts with too small gaps are not counted: they are no layouts."""
    redrawn = 0
    for _ in range(10_000):
        layout = np.column_stack((draw.uniform(*STRIP_X, count), draw.uniform(*STRIP_Y, count)))
        if _min_gap(layout) < MIN_GAP:
            continue
        if hand_has_room(layout):
            return layout, redrawn
        redrawn += 1
    raise RuntimeError(f"no layout of {count} cylinders on the strip {STRIP_X} x {STRIP_Y} found in 10000 draws")


def draw_place(draw: np.random.Generator, standing: Sequence[Floats]) -> Floats:
    """One more position [2] on the strip, apart from the cylinders that stand at `standing`, each [2].

    If the strip is too full for the open hand, the place with the largest gap of 200 draws is taken.
    """
    best, best_gap = np.zeros(2), -1.0
    for _ in range(200):
        place = np.array((draw.uniform(*STRIP_X), draw.uniform(*STRIP_Y)))
        layout = np.array([*standing, place])
        gap = _min_gap(layout)
        if gap >= MIN_GAP and hand_has_room(layout):
            return place
        if gap > best_gap:
            best, best_gap = place, gap
    return best


def redraw_rate(seed: int = 0, count: int = 1000) -> float:
    """Share of layouts that are drawn again because the swept open hand would touch another cylinder."""
    draw = np.random.default_rng(seed)
    redrawn = sum(draw_layout(draw)[1] for _ in range(count))
    return redrawn / (redrawn + count)


def hand_has_room(layout: Floats) -> bool:
    """Whether the open hand reaches each cylinder of `layout` [n, 2] without touching another one.

    The swept hand: a corridor from `APPROACH` before the object to `FINGERS_BEYOND` it, along the forearm's direction.
    """
    radius = tool_box.CYLINDER_RADIUS
    for target in range(len(layout)):
        ahead = (layout[target] - ELBOW) / np.linalg.norm(layout[target] - ELBOW)
        left = np.array((-ahead[1], ahead[0]))
        others = np.delete(layout, target, axis=0) - layout[target]
        along, aside = others @ ahead, others @ left
        beyond_end = np.maximum(0.0, np.maximum(along - FINGERS_BEYOND, -APPROACH - along))
        beyond_side = np.maximum(0.0, np.maximum(aside - HALF_WIDTH_LEFT, -HALF_WIDTH_RIGHT - aside))
        if (np.hypot(beyond_end, beyond_side) < radius).any():
            return False
    return True


def _min_gap(layout: Floats) -> float:
    if len(layout) < 2:
        return np.inf
    apart = np.linalg.norm(layout[:, None] - layout[None], axis=2)
    return float(apart[~np.eye(len(layout), dtype=bool)].min())
