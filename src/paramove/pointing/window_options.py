"""What of tracked arm poses is a pointing."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from paramove.documents.input_error import InputError


@dataclass(frozen=True)
class PointingWindowOptions:
    """What is looked at, and when it is a pointing.

    Attributes:
        points: of the arm, as `ArmPose` names them. ("elbow", "wrist") are the paper's; they do not tell pointing from
            reaching, which ("elbow", "wrist", "index") do.
        level: a window of which a genuine pointing is stranger with less probability than this is none.
        least_lead: logarithm of how much denser the window is as pointing than as reaching, at least.
        settled_s: no window has been more like pointing for so long: it is over.
        most_gap_s: without samples, or without one of the points, nothing is known of what happened meanwhile.
        margin: how far beside the demonstrated places, as a share of their extent, a place may lie.
        apart_m: the hand must have been so far away from where it was before it points again.
    """

    points: tuple[str, ...] = ("elbow", "wrist", "index")
    level: float = 0.01
    least_lead: float = 7.0
    settled_s: float = 0.12
    most_gap_s: float = 0.25
    margin: float = 0.15
    apart_m: float = 0.12

    def __post_init__(self) -> None:
        """Raises InputError for points and numbers that cannot be used."""
        if not 2 <= len(self.points) == len(set(self.points)):
            raise InputError(f"points: at least two different points of the arm expected, found {self.points}")
        for name in ("level", "settled_s", "most_gap_s", "apart_m"):
            if not 0.0 < getattr(self, name) < inf:
                raise InputError(f"{name} is positive and finite, found {getattr(self, name)}")
