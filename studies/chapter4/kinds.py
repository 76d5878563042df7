"""The models of thesis chapter 4: which are compared, on which training, with which numbers of states."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from paramove.phmm import CubicPHMM, InterpolativePHMM, LinearPHMM, NeuralPHMM, ParametricHMM, QuadraticPHMM

FRAMES = 100
RESTRICTIONS = {20: (4, 6), 40: (2, 3), 10: (8, 12)}
"""Minimum and maximum frames per state for 100 frames (4.2.2)."""


@dataclass(frozen=True)
class Kind:
    """A kind of model.

    Attributes:
        name: in reports.
        make: its class.
        corners: trained on the four corners only: the thesis's "2 x 2".
        residuals: "independent" is the thesis, "correlated" is ours; None for a model that has no choice.
        thesis: its name in the thesis, if it is there.
    """

    name: str
    make: type[ParametricHMM]
    corners: bool = False
    residuals: str | None = None
    thesis: str | None = None

    def untrained(self, states: int) -> ParametricHMM:
        """A model with so many states."""
        options: dict[str, Any] = {} if self.residuals is None else {"residuals": self.residuals}
        return self.make(states, *RESTRICTIONS[states], resampled_frames=FRAMES, **options)


IPHMM_2, IPHMM_3 = "IPHMM 2×2", "IPHMM 3×3"
LPHMM_2, LPHMM_3 = "LPHMM 2×2", "LPHMM 3×3"
QPHMM_3, CPHMM_3, NPHMM_3 = "QPHMM 3×3", "CPHMM 3×3", "NPHMM 3×3"
OURS = ", correlated"

KINDS = (
    Kind(IPHMM_2, InterpolativePHMM, corners=True, residuals="independent", thesis=IPHMM_2),
    Kind(IPHMM_3, InterpolativePHMM, residuals="independent", thesis=IPHMM_3),
    Kind(LPHMM_2, LinearPHMM, corners=True, residuals="independent", thesis=LPHMM_2),
    Kind(LPHMM_3, LinearPHMM, residuals="independent", thesis=LPHMM_3),
    Kind(QPHMM_3, QuadraticPHMM, residuals="independent", thesis="QPHMM"),
    Kind(CPHMM_3, CubicPHMM, residuals="independent"),
    Kind(IPHMM_3 + OURS, InterpolativePHMM, residuals="correlated"),
    Kind(LPHMM_2 + OURS, LinearPHMM, corners=True, residuals="correlated"),
    Kind(LPHMM_3 + OURS, LinearPHMM, residuals="correlated"),
    Kind(QPHMM_3 + OURS, QuadraticPHMM, residuals="correlated"),
    Kind(CPHMM_3 + OURS, CubicPHMM, residuals="correlated"),
    Kind(NPHMM_3, NeuralPHMM),
)
BY_NAME = {kind.name: kind for kind in KINDS}
LINEAR_FIT = (Kind("LPHMM", LinearPHMM, residuals="independent"), 40)
QUADRATIC_FIT = (Kind("QPHMM", QuadraticPHMM, residuals="independent"), 40)
"""The models of figure 4.11, which are trained on the 35 averages that they are compared with."""
