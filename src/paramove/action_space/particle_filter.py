"""The particle filter in its three steps: resample, predict, measure (thesis 6.4.2 and appendix C.3.2, corrected).

The thesis calls resampling selection.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from paramove.action_space.propagation import Particles, Propagation
from paramove.documents import Floats, InputError, Ints

ARRAYS = ("step", "origin", "theta", "tau", "deviation", "poses")
"""Arrays of particles other than their weights."""


@dataclass(frozen=True)
class FilterOptions:
    """How many particles, and when they are resampled.

    Attributes:
        n_particles: 400 in the thesis; `action_tracker` passes its parameter `particles`.
        resample_below: particles are resampled when their effective number is below this fraction of them; otherwise
            they keep their weights, which loses less. 1.0 resamples in every frame, as the thesis does.
        min_effective: if a likelihood leaves fewer effective particles than this fraction, it is flattened until it
            leaves that many: with several views it is sharper than 400 particles are dense. 0 never flattens.
        evidence_rate_hz: frames that follow each other faster are not independent (the same shadow misleads all of
            them): together they count as that many a second. inf counts each frame fully, as the thesis does.
    """

    n_particles: int = 400
    resample_below: float = 0.5
    min_effective: float = 0.1
    evidence_rate_hz: float = 20.0

    def __post_init__(self) -> None:
        """Raises InputError for numbers out of range."""
        if self.n_particles < 2:
            raise InputError(f"n_particles is at least 2, found {self.n_particles}")
        if not (0.0 <= self.resample_below <= 1.0 and 0.0 <= self.min_effective < 1.0):
            raise InputError(
                "resample_below lies between 0 and 1 and min_effective below 1, found "
                f"{self.resample_below}, {self.min_effective}"
            )
        if not self.evidence_rate_hz > 0.0:
            raise InputError(f"evidence_rate_hz is positive, found {self.evidence_rate_hz}")

    @classmethod
    def thesis(cls) -> FilterOptions:
        """Resampling in every frame, likelihoods as they are."""
        return cls(resample_below=1.0, min_effective=0.0, evidence_rate_hz=float("inf"))

    def independence(self, elapsed_s: float) -> float:
        """Exponent of the likelihood of a frame that comes `elapsed_s` after the one before; 1 for the first."""
        return min(1.0, elapsed_s * self.evidence_rate_hz) if elapsed_s > 0.0 else 1.0


@dataclass(frozen=True)
class Measurement:
    """Result of measuring one frame.

    Attributes:
        best: largest log-likelihood of a particle, nats.
        temper: exponent by which the likelihood was flattened; 1 if it was not.
    """

    best: float
    temper: float


class ParticleFilter:
    """Particles of one arm. `resample`, `predict`, `measure` in this order make one frame (C.10)."""

    def __init__(self, propagation: Propagation, options: FilterOptions | None = None, seed: int = 0) -> None:
        self.propagation = propagation
        self.options = options if options is not None else FilterOptions()
        self.rng = np.random.default_rng(seed)
        self.particles = propagation.at_base(self.options.n_particles, self.rng)

    def resample(self) -> None:
        """Draws particles by their weights, if few of them carry the weight."""
        weights = self.particles.weights
        if effective_number(weights) < self.options.resample_below * len(weights) * (1.0 + 1e-9):
            self.particles = self.particles.taken(systematic_resampling(weights, self.rng))

    def predict(self, elapsed_s: float) -> None:
        """Moves the particles by the propagation density."""
        self.particles = self.propagation.predicted(self.particles, elapsed_s, self.rng)

    def measure(self, log_likelihoods: Floats, independence: float = 1.0) -> Measurement:
        """Weights the particles by the likelihood of the pose of each (6.7), to the power `independence`."""
        particles = self.particles
        n_effective = self.options.min_effective * len(particles)
        flattened = independence * log_likelihoods
        temper = tempering(particles.weights, flattened, n_effective)
        with np.errstate(divide="ignore"):
            joint = np.log(particles.weights) + temper * flattened
        weights = np.exp(joint - log_sum(joint))
        self.particles = replace(particles, weights=weights / weights.sum())
        return Measurement(float(log_likelihoods.max()), temper)

    def explore(self, fraction: float) -> None:
        """Moves about this fraction of the particles anywhere; their weights stay."""
        rows = np.flatnonzero(self.rng.random(len(self.particles)) < fraction)
        if len(rows):
            drawn = self.propagation.anywhere(len(rows), self.rng)
            arrays = {name: getattr(self.particles, name).copy() for name in ARRAYS}
            for name in ARRAYS:
                arrays[name][rows] = getattr(drawn, name)
            self.particles = replace(self.particles, **arrays)

    def begin_again(self, fraction_anywhere: float = 0.0, fraction: float = 1.0) -> None:
        """Replaces a fraction of the particles by new ones in the base pose, `fraction_anywhere` of them anywhere."""
        n_new = round(fraction * len(self.particles))
        n_anywhere = round(fraction_anywhere * n_new)
        new = [self.propagation.at_base(n_new - n_anywhere, self.rng)] if n_new > n_anywhere else []
        new += [self.propagation.anywhere(n_anywhere, self.rng)] if n_anywhere else []
        n_old = len(self.particles) - n_new
        old = [self.particles.taken(systematic_resampling(self.particles.weights, self.rng, n_old))] if n_old else []
        self.particles = joined([*old, *new])


def joined(parts: list[Particles]) -> Particles:
    """Several sets of particles as one, all with equal weight."""
    arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in ARRAYS}
    n_particles = len(arrays["tau"])
    return Particles(**arrays, weights=np.full(n_particles, 1.0 / n_particles))


def systematic_resampling(weights: Floats, rng: np.random.Generator, n_drawn: int | None = None) -> Ints:
    """Rows drawn by weights (M,) with one random number: each is drawn floor(N pi) or ceil(N pi) times. Shape (N,).

    The smallest j with c^j >= r (C.3.2, corrected), for N equally spaced r.
    """
    count = len(weights) if n_drawn is None else n_drawn
    positions = (np.arange(count) + rng.random()) / count
    cumulative = np.cumsum(weights)
    rows = np.searchsorted(cumulative / cumulative[-1], positions, side="left")
    return np.asarray(np.minimum(rows, len(weights) - 1), dtype=np.int64)


def effective_number(weights: Floats) -> float:
    """1 / sum of squared normalised weights: M for equal ones, 1 if a single particle has all the weight."""
    return float(weights.sum() ** 2 / np.maximum((weights**2).sum(), 1e-300))


def log_sum(values: Floats) -> float:
    """ln sum exp."""
    maximum = float(values.max())
    return maximum + float(np.log(np.exp(values - maximum).sum()))


def tempering(weights: Floats, log_likelihoods: Floats, n_effective: float) -> float:
    """Largest exponent in (0, 1] that leaves `n_effective` effective particles, or 1e-6."""
    with np.errstate(divide="ignore"):
        logs = np.log(weights)

    def effective(exponent: float) -> float:
        joint = logs + exponent * log_likelihoods
        return effective_number(np.exp(joint - joint.max()))

    if effective(1.0) >= n_effective:
        return 1.0
    low, high = 1e-6, 1.0
    for _ in range(20):
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if effective(middle) >= n_effective else (low, middle)
    return low
