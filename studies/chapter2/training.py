"""Baum-Welch training of one HMM, iteration by iteration, from the starts that thesis 2.3 describes."""

from dataclasses import dataclass, replace

import numpy as np

from paramove.documents import Floats
from paramove.hmm import (
    ChainParameters,
    GaussianHMM,
    Parameters,
    Topology,
    TopologyName,
    TrainingOptions,
    TrainingSummary,
    equal_segments,
    train,
)
from studies.chapter2.figures import LAST, Setting
from studies.chapter2.movement import ParameterSet, training_set

FLOOR = 0.002
"""Minimum standard deviation of an output distribution: below that of the movement's noise, 0.005/√3."""
ONE_ITERATION = replace(TrainingOptions.maximum_likelihood(1), floor_deviation=FLOOR)
TRANSITION_ITERATIONS = 50


@dataclass(frozen=True)
class Snapshot:
    """A model after some iterations of its training.

    Attributes:
        means: shape (N, 2). covariances: shape (N, 2, 2).
        transitions: shape (N, N); with time restrictions 1 from each state to the next.
        model: all parameters.
    """

    means: Floats
    covariances: Floats
    transitions: Floats
    model: ChainParameters | Parameters


@dataclass(frozen=True)
class Trained:
    """A training from its start: `snapshots[k]` and `log_likelihoods[k]` after k iterations."""

    setting: Setting
    sequences: list[Floats]
    snapshots: list[Snapshot]
    log_likelihoods: list[float]

    def distances(self) -> Floats:
        """Maximum distance of a state mean from its position after the last iteration, per iteration."""
        means = np.stack([snapshot.means for snapshot in self.snapshots])
        result: Floats = np.linalg.norm(means - means[-1], axis=2).max(axis=1)
        return result

    def settled(self, within: float = 0.01) -> int:
        """First iteration from which on no mean is further than this from its last position."""
        return int(np.flatnonzero(np.append(np.inf, self.distances()) > within)[-1])


def trained(
    setting: Setting,
    seed: int,
    iterations: int | None = None,
    *,
    parameters: ParameterSet = "two-sided",
    start_seed: int = 0,
    transitions_first: bool = False,
) -> Trained:
    """Train one HMM; the same seed gives the same sequences to all settings of equal bound and length.

    `start_seed` counts random starts. With `transitions_first`, 50 iterations before the first one change the
    transitions alone (thesis 2.3.2, trial 1).
    """
    number = LAST[setting.kind] if iterations is None else iterations
    sequences = training_set(seed, bound=setting.bound, frames=setting.frames, parameters=parameters)
    start = started(setting, sequences, np.random.default_rng([seed, setting.states, start_seed]))
    if setting.kind == "durations":
        return _trained_durations(setting, sequences, start, number)
    return _trained_chain(setting, sequences, start, number, transitions_first)


def started(setting: Setting, sequences: list[Floats], rng: np.random.Generator) -> Parameters:
    """Means, covariances and durations that a training starts from."""
    shortest, longest = max(1, setting.d_min), max(1, setting.d_max)
    begin = equal_segments(sequences, setting.states, shortest, longest, ONE_ITERATION)
    if setting.start == "segments":
        return begin
    if setting.start == "simple":
        means, covariances = np.tile([1.0, 0.0], (setting.states, 1)), np.tile(np.eye(2), (setting.states, 1, 1))
        return replace(begin, means=means, covariances=covariances)
    means = rng.uniform([0.0, -setting.bound], [2.0, setting.bound], (setting.states, 2))
    factors = rng.uniform(0.03, 0.2, (setting.states, 2, 1)) * rng.standard_normal((setting.states, 2, 2))
    return replace(begin, means=means, covariances=factors @ np.swapaxes(factors, 1, 2) + 0.03**2 * np.eye(2))


def _trained_durations(setting: Setting, sequences: list[Floats], start: Parameters, iterations: int) -> Trained:
    chain = np.eye(setting.states, k=1)
    models, log_likelihoods = [start], []
    for _ in range(iterations + 1):
        model, summary = train(models[-1], sequences, ONE_ITERATION)
        models.append(model)
        log_likelihoods.append(_log_likelihood(summary))
    snapshots = [Snapshot(model.means, model.covariances, chain, model) for model in models[: iterations + 1]]
    return Trained(setting, sequences, snapshots, log_likelihoods)


def _trained_chain(
    setting: Setting, sequences: list[Floats], start: Parameters, iterations: int, transitions_first: bool
) -> Trained:
    model = chain_model(setting)
    parameters = _uniform(start, model.topology)
    if transitions_first:
        for _ in range(TRANSITION_ITERATIONS):
            fitted = model.fit(sequences, parameters).parameters
            parameters = replace(fitted, means=parameters.means, covariances=parameters.covariances)
    snapshots, log_likelihoods = [], []
    for _ in range(iterations + 1):
        snapshots.append(Snapshot(parameters.means, parameters.covariances, parameters.transitions, parameters))
        parameters = model.fit(sequences, parameters).parameters
        log_likelihoods.append(_log_likelihood(model.training_))
    return Trained(setting, sequences, snapshots, log_likelihoods)


def chain_model(setting: Setting) -> GaussianHMM:
    """The untrained chain of a setting; a left-right one ends in the finish state (2.3.2)."""
    if setting.kind == "ergodic":
        return GaussianHMM(setting.states, topology="ergodic", options=ONE_ITERATION)
    topology: TopologyName = "left_right_skips" if setting.kind == "skips" else "left_right"
    return GaussianHMM(setting.states, topology=topology, finish_state=True, options=ONE_ITERATION)


def _log_likelihood(summary: TrainingSummary | None) -> float:
    assert summary is not None, "fit was called"
    return summary.log_likelihoods[0]


def _uniform(start: Parameters, topology: Topology) -> ChainParameters:
    """All allowed transitions equally likely: 0.5 each for a left-right chain without skips."""
    n_states = len(start.means)
    allowed = topology.transitions(n_states).astype(np.float64)
    exits = topology.exits(n_states).astype(np.float64)
    total = allowed.sum(axis=1) + exits
    starts = topology.starts(n_states).astype(np.float64)
    return ChainParameters(
        starts / starts.sum(), allowed / total[:, None], exits / total, start.means, start.covariances
    )
