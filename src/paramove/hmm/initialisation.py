"""Initial parameters of plain chains for Baum-Welch: equal parts of each sequence, or drawn ones (thesis 2.2.2)."""

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np

from paramove.documents import Floats, Ints
from paramove.hmm.chain import ChainParameters, Topology
from paramove.hmm.covariances import Covariance
from paramove.hmm.options import TrainingOptions
from paramove.hmm.sequences import interpolate
from paramove.hmm.training import segment_outputs

Initialisation = Literal["segments", "random"]


def check_initialisation(name: str) -> None:
    """Raise ValueError for an initialisation that does not exist."""
    if name not in get_args(Initialisation):
        raise ValueError(f"initialisation is one of {', '.join(get_args(Initialisation))}, found {name!r}")


def initial_chain(
    sequences: Sequence[Floats],
    n_states: int,
    topology: Topology,
    kind: Covariance,
    options: TrainingOptions,
    initialisation: Initialisation,
    seed: int,
) -> ChainParameters:
    """First parameters. "segments" cuts each sequence into N equal parts and lets each state last as long as its part;
    "random" draws the cuts of each sequence and all probabilities that the topology leaves open.
    """  # fmt: skip
    # A sequence with fewer frames than states is stretched, for each state needs a frame to begin with.
    stretched = [_at_least(sequence, n_states) for sequence in sequences]
    mean_length = float(np.mean([len(sequence) for sequence in sequences]))
    starts, exits = topology.starts(n_states).astype(np.float64), topology.exits(n_states).astype(np.float64)
    allowed = topology.transitions(n_states).astype(np.float64)
    if initialisation == "random":
        rng = np.random.default_rng(seed)
        labels = [_drawn_labels(len(sequence), n_states, rng) for sequence in stretched]
        starts, exits, allowed = (rng.exponential(size=one.shape) * one for one in (starts, exits, allowed))
    else:
        labels = [np.arange(len(sequence)) * n_states // len(sequence) for sequence in stretched]
        if topology.self_transitions:
            leaving = allowed.sum(axis=1) - 1.0 + exits
            stay = max(mean_length / n_states - 1.0, 0.5)  # a_ii / (1 - a_ii) of the expected duration
            np.einsum("ii->i", allowed)[:] = np.where(leaving > 0, stay * leaving, 1.0)
    means, covariances = segment_outputs(stretched, labels, n_states, options, kind)
    total = allowed.sum(axis=1) + exits
    total[total == 0] = 1.0
    return ChainParameters(starts / starts.sum(), allowed / total[:, None], exits / total, means, covariances)


def _at_least(sequence: Floats, n_frames: int) -> Floats:
    if len(sequence) >= n_frames:
        return sequence
    return interpolate(sequence, np.linspace(0.0, len(sequence) - 1.0, n_frames))


def _drawn_labels(n_frames: int, n_states: int, rng: np.random.Generator) -> Ints:
    cuts = np.sort(rng.choice(np.arange(1, n_frames), n_states - 1, replace=False))
    return np.searchsorted(cuts, np.arange(n_frames), side="right").astype(np.int64)
