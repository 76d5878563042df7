"""The inner loop of the matching, with loads one by one and with gathered ones, on any processor."""

import numba
import numpy as np
import pytest

from paramove.observation.segment_sums import (
    BASE,
    FIELDS,
    FRACTION,
    LANES,
    NX,
    NY,
    PX,
    PY,
    trial_sums,
    trial_sums_gathered,
    trial_sums_loaded,
)

STRIDE, HEIGHT, IMAGES, SLOTS = 100, 80, 3, 6


@pytest.fixture(scope="module")
def lanes():
    rng = np.random.default_rng(5)
    values = rng.uniform(size=(FIELDS, SLOTS * LANES)).astype(np.float32)
    turn = 2.0 * np.pi * rng.uniform(size=SLOTS * LANES)
    values[PX], values[PY] = 20.0 + 60.0 * values[PX], 20.0 + 40.0 * values[PY]
    values[NX], values[NY] = np.cos(turn), np.sin(turn)
    values[FRACTION] = np.tile(np.arange(LANES) / LANES, SLOTS)
    values[BASE] = rng.integers(IMAGES, size=SLOTS * LANES) * STRIDE * HEIGHT
    return values


def expected(images, lanes, slot, left, here, right, move):
    """The two sums, each as the least and the greatest that rounding to single precision may give."""
    first, second = (lanes[:, (slot + i) * LANES : (slot + i + 1) * LANES].astype(np.float64) for i in range(2))
    found = []
    for rows, earlier, later in ((first, left, here + move), (second, here + move, right)):
        shift = (1.0 - rows[FRACTION]) * earlier + rows[FRACTION] * later
        sums = []
        for nudge_x, nudge_y in ((-1e-4, -1e-4), (-1e-4, 1e-4), (1e-4, -1e-4), (1e-4, 1e-4)):
            x = np.floor(rows[PX] + shift * rows[NX] + nudge_x).astype(int)
            y = np.floor(rows[PY] + shift * rows[NY] + nudge_y).astype(int)
            sums.append(images[rows[BASE].astype(int) + y * STRIDE + x].astype(int))
        found.append((np.min(sums, axis=0).sum(), np.max(sums, axis=0).sum()))
    return found


@pytest.mark.parametrize("sums", [trial_sums_loaded, trial_sums_gathered], ids=["loaded", "gathered"])
def test_both_ways_to_read_give_the_sums_of_the_definition(sums, lanes):
    @numba.njit
    def found(images, lanes, slot, left, here, right, step):
        return sums(images, lanes, slot, left, here, right, step, np.float32(STRIDE))

    rng = np.random.default_rng(6)
    images = rng.integers(256, size=IMAGES * STRIDE * HEIGHT).astype(np.uint8)
    images[: STRIDE * HEIGHT] = 255  # the largest sum there is
    for _ in range(200):
        slot, (left, here, right) = int(rng.integers(SLOTS - 1)), rng.uniform(-8.0, 8.0, 3).astype(np.float32)
        step = np.float32(0.5 ** rng.integers(5))
        four = found(images, lanes, slot, left, here, right, step)
        bounds = [b for move in (step, -step) for b in expected(images, lanes, slot, left, here, right, move)]
        for value, (minimum, maximum) in zip(four, bounds, strict=True):
            assert minimum <= value <= maximum


def test_one_of_the_two_is_used():
    assert trial_sums in (trial_sums_loaded, trial_sums_gathered)
