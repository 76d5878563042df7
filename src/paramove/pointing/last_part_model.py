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
from paramove.phmm import Examination, MovementDescription, QuadraticPHMM, cached_model

STATES = 8
PERSONS = 8


@dataclass(frozen=True)
class LastPartModel:
    """The last part of pointing, and of reaching where the two can be distinguished.

    Attributes:
        pointing: of points over `FRAMES` frames (FRAMES, 3 n), m, in the demonstrator's frame, with correlated
            residuals; theta are the coordinates (u, v) on the table of the position that is pointed at.
        reaching: the same for reaching; None where it does not compete.
    """

    pointing: QuadraticPHMM
    reaching: QuadraticPHMM | None

    @classmethod
    def of_points(cls, points: Sequence[str], folder: Path | None = None) -> LastPartModel:
        """Trains with synthetic persons and caches the model in a folder, by default the user's cache.

        Wrist and fingertip together distinguish a pointing hand from a grasping one. Without both, reaching for an
        object looks like pointing a little beyond it, so reaching does not compete.
        """
        pointing = _trained("pointing", points, folder)
        both = {"wrist", "index"} <= set(points)
        return cls(pointing, _trained("reaching", points, folder) if both else None)

    @property
    def duration_s(self) -> float:
        """Mean of the demonstrated last parts of pointing."""
        assert self.pointing.description is not None
        return float(self.pointing.description.duration)

    def lead(self, window: Floats, examined: Examination) -> float:
        """Logarithm of a window's density as pointing over that as reaching; infinite if reaching does not compete."""
        return np.inf if self.reaching is None else examined.log_density - self.reaching.examine(window).log_density


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
