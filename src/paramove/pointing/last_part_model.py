"""Models of the last part of pointing and of reaching, for classifying windows of tracked points (paper 5.4).

"A PHMM is trained for the last part of pointing movements. The recognition of the position is estimated as the most
likely parameter of the PHMM over a recent time window of the elbow and wrist positions, which is recognized as pointing
by simple thresholding." The threshold is on the p-value, the probability that a genuine last part has at least this
outlier score (thesis 2.2.5), and reaching, which looks alike, competes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from paramove.demonstrations import FRAME, FRAMES, Action, last_parts
from paramove.documents import Floats
from paramove.hmm import TrainingOptions
from paramove.phmm import MovementDescription, QuadraticPHMM, cached_model

STATES = 8
PERSONS = 8


@dataclass(frozen=True)
class Judgement:
    """The result of comparing a window of points with the model.

    Attributes:
        theta: coordinates (u, v) on the table of the position that is pointed at, (2,). covariance: of theta, (2, 2).
        outlier_score: how far it is from the last part of a pointing movement.
        p_value: probability that a genuine one has at least this outlier score.
        log_density: of the window as pointing.
    """

    theta: Floats
    covariance: Floats
    outlier_score: float
    p_value: float
    log_density: float


class LastPartModel:
    """The last part of pointing, and of reaching where the two can be distinguished.

    Args:
        pointing: of points over `FRAMES` frames, with correlated residuals.
        reaching: the same for reaching; None where it does not compete.

    Attributes:
        duration_s: mean of the demonstrated last parts of pointing.
    """

    def __init__(self, pointing: QuadraticPHMM, reaching: QuadraticPHMM | None) -> None:
        assert pointing.description is not None
        self._pointing = pointing
        self._reaching = reaching
        self.duration_s = float(pointing.description.duration)

    @classmethod
    def of_points(cls, points: Sequence[str], folder: Path | None = None) -> LastPartModel:
        """Trains with synthetic persons and caches the model in a folder, by default the user's cache.

        Wrist and fingertip together distinguish a pointing hand from a grasping one. Without both, reaching for an
        object looks like pointing a little beyond it, so reaching does not compete.
        """
        pointing = _trained("pointing", points, folder)
        both = {"wrist", "index"} <= set(points)
        return cls(pointing, _trained("reaching", points, folder) if both else None)

    def judged(self, window: Floats) -> Judgement:
        """Judges points over time (FRAMES, 3 n), m, in the models' frame."""
        examined = self._pointing.examine(window)
        estimate = examined.estimate
        return Judgement(
            estimate.theta, estimate.covariance, examined.outlier_score, examined.p_value, examined.log_density
        )

    def lead(self, window: Floats, judged: Judgement) -> float:
        """Logarithm of a window's density as pointing over that as reaching; infinite if reaching does not compete."""
        return np.inf if self._reaching is None else judged.log_density - self._reaching.examine(window).log_density


def _trained(action: Action, points: Sequence[str], folder: Path | None) -> QuadraticPHMM:
    """The model from the folder, or trained and cached there."""

    def train() -> QuadraticPHMM:
        demonstrated = last_parts(action, points, persons=PERSONS)
        model = QuadraticPHMM(STATES, 2, 4, options=TrainingOptions(floor_deviation=0.003))
        model.description = MovementDescription(
            f"last part of {action}", tuple(points), "m", FRAME, ("u", "v"), demonstrated.duration_s,
            rate_hz=(FRAMES - 1) / demonstrated.duration_s,
        )  # fmt: skip
        return model.fit(demonstrated.sequences, demonstrated.theta, demonstrated.groups)

    source = f"last parts of {action} by {PERSONS} synthetic persons, {'+'.join(points)}"
    return cached_model(QuadraticPHMM, f"last_part_{action}", source, train, folder)
