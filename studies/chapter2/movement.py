"""The synthetic parametric movement of thesis 2.3: out along a line of slope p, and back down to the x-axis."""

from collections.abc import Callable
from typing import Literal

import numpy as np

from paramove.documents import Floats

PARAMETER_FRACTIONS = (-1.0, -0.5, 0.0, 0.5, 1.0)
"""Parameters of a training set as fractions of its bound: with 0.25 those of figures 2.6 and 2.7."""
NOISE = 0.005
ParameterSet = Literal["two-sided", "figure 2.7", "uniform", "extremes"]
PARAMETER_SETS: dict[ParameterSet, Callable[[np.random.Generator], Floats]] = {
    "two-sided": lambda rng: np.concatenate([-np.linspace(0.6, 1.0, 5), np.linspace(0.6, 1.0, 5)]),
    "figure 2.7": lambda rng: np.repeat(PARAMETER_FRACTIONS, 2),
    "uniform": lambda rng: _centred(rng.uniform(-1.0, 1.0, 10)),
    "extremes": lambda rng: np.repeat([-1.0, 1.0], 5),
}
"""The ten parameters as fractions of the bound, which 2.3 does not give."""
PROGRESSION = 0.3


def _centred(fractions: Floats) -> Floats:
    """Shares whose mean is 0, so that the x-axis is the mean movement, within [-1, 1]."""
    centred = fractions - fractions.mean()
    return np.asarray(centred / max(1.0, np.abs(centred).max()))


def prototype(p: float, t: Floats) -> Floats:
    """The movement for parameter p at times t in [0, 2]. Shape (len(t), 2), no unit."""
    return np.stack([t, p * np.where(t <= 1.0, t, 2.0 - t)], axis=1)


def demonstration(p: float, frames: int, rng: np.random.Generator, *, progression: float = PROGRESSION) -> Floats:
    """A sampled version with its own progression rate and noise (figure 2.7). Shape (frames, 2).

    T_1 of the frames, drawn from [T/2 (1 - alpha), T/2 (1 + alpha)], show the movement out, the others
    the movement back; noise is uniform in [-0.005, 0.005] per component.
    """
    lowest, highest = frames / 2 * (1.0 - progression), frames / 2 * (1.0 + progression)
    out = int(rng.integers(int(np.ceil(lowest)), int(np.floor(highest)) + 1))
    times = np.concatenate([np.linspace(0.0, 1.0, out), np.linspace(1.0, 2.0, frames - out + 1)[1:]])
    return prototype(p, times) + rng.uniform(-NOISE, NOISE, (frames, 2))


def training_set(
    seed: int, *, bound: float = 0.25, frames: int = 50, parameters: ParameterSet = "two-sided"
) -> list[Floats]:
    """Ten demonstrations with parameters in [-bound, bound] (2.3 does not state which; see `PARAMETER_SETS`)."""
    rng = np.random.default_rng([seed, frames, round(1e4 * bound)])
    return [demonstration(bound * float(p), frames, rng) for p in PARAMETER_SETS[parameters](rng)]
