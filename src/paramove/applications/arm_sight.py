"""What the application needs to know of a person's tracked arm: whether it is seen, and whether the hand is away."""

from __future__ import annotations

import math

from paramove.msgs.action_estimate_pb2 import ActionEstimate

SILENT_S = 1.0


class ArmSight:
    """Follows the tracker's estimates.

    Args:
        frame: In which places are asked for.
    """

    def __init__(self, frame: str) -> None:
        self._frame = frame
        self._heard_s = float("-inf")
        self._trouble = ""
        self._hand: tuple[float, float] | None = None
        self._near_s: dict[tuple[float, float], float] = {}

    def on_estimate(self, estimate: ActionEstimate, now_s: float) -> None:
        """Take in what is believed now; a hand told in another frame is nowhere."""
        self._heard_s = now_s
        if estimate.lost or estimate.degraded:
            self._trouble = "the tracker has lost the arm" if estimate.lost else "no camera sees the arm"
            self._hand = None
        else:
            self._trouble = ""
            self._hand = (estimate.hand.x, estimate.hand.y) if estimate.frame == self._frame else None

    def trouble(self, now_s: float) -> str:
        """Why it is not known where the person points; empty while it is."""
        if now_s - self._heard_s > SILENT_S:
            return "the tracker is silent"
        return self._trouble

    def away_for(self, place: tuple[float, float], distance: float, now_s: float) -> float:
        """How long the hand has been farther from a place than `distance`, m, as far as it was asked; s."""
        away = (
            not self.trouble(now_s)
            and self._hand is not None
            and math.dist(self._hand, place) > distance  # False for NaN
        )
        if not away or place not in self._near_s:
            self._near_s = {place: now_s}
        return now_s - self._near_s[place]
