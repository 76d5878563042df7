"""Kernels of the background: how much each pixel has changed, and learning the background."""

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Bytes
from paramove.hmm import compiled

Signed = NDArray[np.int8]
Floats32 = NDArray[np.float32]

FULL = 100
"""Change of a pixel that certainly shows something else; its negative: certainly the background."""
DARKEST, BRIGHTEST = np.float32(0.35), np.float32(1.02)
"""A shadow multiplies the background's colour by a factor between these."""
SHIFTED_PX = 2
"""A colour that was this near before has only moved a little, such as the clothes of a person who sways."""


@compiled
def samples(image: Bytes, background: Floats32, known: Bytes, every: int) -> tuple[Floats32, Floats32]:
    """Colours of the background and of the image at one of `every` pixels along each axis where it is known, (n, 3)."""
    height, width = known.shape
    maximum = (1 + (height - 1) // every) * (1 + (width - 1) // every)
    was, now, count = np.empty((maximum, 3), np.float32), np.empty((maximum, 3), np.float32), 0
    for y in range(0, height, every):
        for x in range(0, width, every):
            if known[y, x] != 0:
                for c in range(3):
                    was[count, c], now[count, c] = background[y, x, c], np.float32(image[y, x, c])
                count += 1
    return was[:count], now[:count]


@compiled
def nearest_around(
    image: Bytes, background: Floats32, known: Bytes, scale: np.float32, row: int, column: int
) -> np.float32:
    """Minimum squared distance of the colour of a pixel from those of the known background around it."""
    height, width = known.shape
    minimum = np.float32(1e9)
    for y in range(max(row - SHIFTED_PX, 0), min(row + SHIFTED_PX + 1, height)):
        for x in range(max(column - SHIFTED_PX, 0), min(column + SHIFTED_PX + 1, width)):
            if known[y, x] != 0:
                squared = np.float32(0.0)
                for c in range(3):
                    difference = np.float32(image[row, column, c]) - scale * background[y, x, c]
                    squared += difference * difference
                minimum = min(minimum, squared)
    return minimum


@compiled
def changes(
    image: Bytes, background: Floats32, known: Bytes, gain: float, low: float, high: float, out: Signed, still: Bytes
) -> None:
    """How much each pixel differs from the background, -FULL to FULL; 0 where the background is not known.

    A pixel that may be in shadow gets 0 at most: it has the colour of the background, only darker.

    Args:
        image: (H, W, 3). background: (H, W, 3), times `gain`. known: 1 where it is known, (H, W).
        low, high: distances of colours, grey levels, that are certainly noise and certainly not.
        out: (H + 2, W + 2), a border of one pixel of zeros. still: 255 where nothing changed, else 0; (H, W).
    """
    height, width = known.shape
    unit = np.float32(2.0 / (high - low))
    scale = np.float32(gain)
    for y in range(height):
        for x in range(width):
            if known[y, x] == 0:
                out[y + 1, x + 1] = 0
                still[y, x] = 0
                continue
            squared, dot, square = np.float32(0.0), np.float32(0.0), np.float32(1e-3)
            for c in range(3):
                was, now = scale * background[y, x, c], np.float32(image[y, x, c])
                squared += (now - was) * (now - was)
                dot += now * was
                square += was * was
            distance = np.sqrt(squared)
            value = (distance - np.float32(low)) * unit - np.float32(1.0)
            value = min(max(value, np.float32(-1.0)), np.float32(1.0))
            factor = dot / square
            if value > np.float32(0.0) and DARKEST < factor < BRIGHTEST:
                beside = squared - (factor - np.float32(1.0)) * (factor - np.float32(1.0)) * square
                if np.sqrt(max(beside, np.float32(0.0))) < np.float32(high) * np.float32(0.7):
                    value = np.float32(0.0)
            if value > np.float32(0.0):
                distance = np.sqrt(min(squared, nearest_around(image, background, known, scale, y, x)))
                value = min(max((distance - np.float32(low)) * unit - np.float32(1.0), np.float32(0.0)), value)
            out[y + 1, x + 1] = np.int8(value * np.float32(FULL))
            still[y, x] = 255 if value < np.float32(-0.5) else 0


@compiled
def learn(
    image: Bytes, background: Floats32, known: Bytes, away: Floats32, hidden: Bytes, change: Signed, elapsed: float,
    numbers: tuple[float, float, float],
) -> None:  # fmt: skip
    """Takes an image into the background, where no arm is.

    Args:
        away: how long each pixel has been outside the arm and unknown, s. hidden: 1 where the arm may be, (H, W).
        change: of this image, see `changes`. elapsed: s since the last image.
        numbers: s after which a pixel is known; s in which the background follows slow changes, and larger ones.
    """
    height, width = known.shape
    slow = np.float32(min(1.0, elapsed / numbers[1]))
    slower = np.float32(min(1.0, elapsed / numbers[2]))
    for y in range(height):
        for x in range(width):
            if hidden[y, x] != 0:
                away[y, x] = np.float32(0.0)
                continue
            if known[y, x] != 0:
                gain = slow if change[y + 1, x + 1] < 0 else slower
                for c in range(3):
                    background[y, x, c] += gain * (np.float32(image[y, x, c]) - background[y, x, c])
                continue
            away[y, x] += np.float32(elapsed)
            if away[y, x] >= np.float32(numbers[0]):
                known[y, x] = 1
                for c in range(3):
                    background[y, x, c] = np.float32(image[y, x, c])


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
