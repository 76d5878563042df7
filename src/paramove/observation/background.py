"""The background of a fixed camera: learned while the arm is tracked, and how an image differs from it."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from paramove.documents import Image
from paramove.observation.background_kernels import changes, learn, samples

KNOWN_AFTER_S, FOLLOWS_S, FOLLOWS_LARGE_S = 0.4, 3.0, 20.0
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
        change: see `changes`, flat with a border of one pixel; 0 everywhere before the background is known.
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
        self._still_weight = still_weight
        self.known_fraction = 0.0
        self.weights = np.ones(shape, np.float32)

    @property
    def change(self) -> NDArray[np.int8]:
        """Flat, (H + 2) (W + 2)."""
        return self._change.reshape(-1)

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
        numbers = (KNOWN_AFTER_S, FOLLOWS_S, FOLLOWS_LARGE_S)
        learn(self._image, self._mean, self._known, self._away, hidden, self._change, elapsed_s, numbers)
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
