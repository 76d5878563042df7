"""How often the believed progress jumps: the way out and the way back of an arm look alike."""

from __future__ import annotations

import numpy as np

from paramove.documents.array_types import Floats

LEAST_CONCENTRATION = 0.8
"""Length of the mean of the progress as a direction, 0 (spread over all of the action) to 1."""
JUMP = 0.25
"""Of the progress, beyond what the time between two frames explains."""


class ProgressJumps:
    """Counts them.

    Attributes:
        count: jumps so far, between frames with one action and a progress of which the filter was sure.
    """

    def __init__(self) -> None:
        self.count = 0
        self._last: tuple[str, float] | None = None

    def update(self, action: str, tau: Floats, weights: Floats, advance: float) -> None:
        """Takes progress (K,) and weights (K,) of the particles of the most probable action.

        `advance`: what the progress gains on average in the time since the frame before. The end of an action is next
        to its beginning.
        """
        mean = weights @ np.exp(2j * np.pi * tau) / max(float(weights.sum()), 1e-300)
        if abs(mean) < LEAST_CONCENTRATION:
            return
        now = float(np.angle(mean)) / (2.0 * np.pi)
        if self._last is not None and self._last[0] == action:
            gained = (now - self._last[1] - advance + 0.5) % 1.0 - 0.5
            self.count += abs(gained) > JUMP
        self._last = action, now
