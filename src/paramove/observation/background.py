"""The background of a fixed camera: learned while the arm is tracked, and how an image differs from it."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from paramove.documents import Bytes, Image
from paramove.hmm import compiled

Signed = NDArray[np.int8]
Floats32 = NDArray[np.float32]

FULL = 100
"""Change of a pixel that certainly shows something else; its negative: certainly the background."""
DARKEST, BRIGHTEST = np.float32(0.35), np.float32(1.02)
"""A shadow multiplies the background's colour by a factor between these."""
SHIFTED_PX = 2
"""A colour that was this near before has only moved a little, such as the clothes of a person who sways."""
KNOWN_AFTER_S, FOLLOWS_S, FOLLOWS_LARGE_S = 0.4, 3.0, 20.0
"""Time after which a pixel is known; times in which the background follows slow changes, and larger ones."""
MIN_NOISE = 2.0
"""Grey levels; a rendered or compressed image may have less."""
SPARSE = 4
"""Noise and brightness are measured at one of this many pixels along each axis."""
LOW, HIGH = 2.0, 5.0
"""Multiples of the noise: below the first a difference is certainly noise, above the second certainly not."""
BORDER_PX = 3
"""A contour separates changed from unchanged pixels: edges count up to this distance from changed ones."""
DISTANCE_OF_NOISE = 1.54
"""Median length of three normally distributed numbers."""


class Background:
    """The background of one view at the size at which images are compared.

    Attributes:
        change: see `changes`, flat with a border of one pixel, (H + 2) (W + 2); 0 everywhere before the background is
            known.
        weights: of the edges of each pixel, 0 to 1, (H, W).
        known_fraction: fraction of the pixels whose background is known.
    """

    def __init__(self, width_px: int, height_px: int, still_weight: float) -> None:
        shape = (height_px, width_px)
        self._image = np.zeros((*shape, 3), np.uint8)
        self._mean = np.zeros((*shape, 3), np.float32)
        self._known = np.zeros(shape, np.uint8)
        self._away = np.full(shape, KNOWN_AFTER_S, np.float32)  # the first image is known at once, except under the arm
        self._still = np.zeros(shape, np.uint8)
        self._change = np.zeros((height_px + 2, width_px + 2), np.int8)
        self.change = self._change.reshape(-1)
        self._still_weight = still_weight
        self.known_fraction = 0.0
        self.weights = np.ones(shape, np.float32)

    def see(self, image: Image) -> None:
        """Compare an image (H, W, 3)."""
        self._image = np.ascontiguousarray(image)
        if self.known_fraction == 0.0:
            return
        gain, noise = self._brightness_and_noise()
        low, high = LOW * DISTANCE_OF_NOISE * noise, HIGH * DISTANCE_OF_NOISE * noise
        changes(self._image, self._mean, self._known, gain, low, high, self._change, self._still)
        size = 2 * BORDER_PX + 1
        still = cv2.erode(self._still, np.ones((size, size), np.uint8))
        self.weights = np.where(still > 0, np.float32(self._still_weight), np.float32(1.0))

    def learn(self, hidden: Image, elapsed_s: float) -> None:
        """Learn from the image of the last `see` where `hidden` (H, W) is 0."""
        learn(self._image, self._mean, self._known, self._away, hidden, self._change, elapsed_s)
        self.known_fraction = float(self._known.mean())

    def _brightness_and_noise(self) -> tuple[float, float]:
        """By how much the image is brighter than the background, and the noise, grey levels; medians."""
        was, now = samples(self._image, self._mean, self._known, SPARSE)
        all_channels = np.ones(3, np.float32)
        sums = was @ all_channels
        bright = sums > 60.0
        gain = float(np.median((now @ all_channels)[bright] / sums[bright])) if bright.any() else 1.0
        gain = min(max(gain, 0.5), 2.0)
        difference = now - np.float32(gain) * was
        distance = np.sqrt(np.einsum("ij,ij->i", difference, difference))
        return gain, max(float(np.median(distance)) / DISTANCE_OF_NOISE, MIN_NOISE)


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
    image: Bytes, background: Floats32, known: Bytes, away: Floats32, hidden: Bytes, change: Signed, elapsed: float
) -> None:
    """Takes an image into the background, where no arm is.

    Args:
        away: how long each pixel has been outside the arm and unknown, s. hidden: 1 where the arm may be, (H, W).
        change: of this image, see `changes`. elapsed: s since the last image.
    """
    height, width = known.shape
    slow = np.float32(min(1.0, elapsed / FOLLOWS_S))
    slower = np.float32(min(1.0, elapsed / FOLLOWS_LARGE_S))
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
            if away[y, x] >= np.float32(KNOWN_AFTER_S):
                known[y, x] = 1
                for c in range(3):
                    background[y, x, c] = np.float32(image[y, x, c])
