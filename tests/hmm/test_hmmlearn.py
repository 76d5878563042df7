"""hmmlearn as an oracle where it can express the model: d = 1 or 2 as skip-free states, geometric durations."""

import numpy as np
from hmmlearn.hmm import GaussianHMM
from numpy.testing import assert_allclose

from paramove.hmm import LeftRightHMM, Parameters
from tests.hmm.expanded import expanded_transitions


def test_likelihood_and_responsibilities_equal_hmmlearn() -> None:
    rng = np.random.default_rng(8)
    n_states, dim, longest, n_frames = 5, 3, 4, 14
    means, factors = rng.standard_normal((n_states, dim)), rng.standard_normal((n_states, dim, dim))
    covariances = factors @ np.swapaxes(factors, 1, 2) + np.eye(dim)
    durations = np.zeros((n_states, longest))
    durations[:, 1:] = rng.dirichlet(np.ones(longest - 1), n_states)
    sequence = rng.standard_normal((n_frames, dim))
    ours = LeftRightHMM.from_parameters(Parameters(means, covariances, durations, 2))

    # hmmlearn has no finish state: one far-away sample after the end, that only an extra state can explain.
    far = np.full(dim, 1e3)
    transitions = expanded_transitions(durations)
    theirs = GaussianHMM(len(transitions), "full", init_params="", params="")
    theirs.startprob_ = np.eye(len(transitions))[0]
    theirs.transmat_ = transitions
    theirs.means_ = np.vstack([np.repeat(means, longest, axis=0), far])
    theirs.covars_ = np.concatenate([np.repeat(covariances, longest, axis=0), np.eye(dim)[None]])
    score, gamma = theirs.score_samples(np.vstack([sequence, far]))
    last = -0.5 * dim * np.log(2 * np.pi)
    assert_allclose(ours.log_likelihood(sequence), score - last, rtol=1e-10, atol=0.0)
    summed = gamma[:-1, :-1].reshape(n_frames, n_states, longest).sum(axis=2)
    assert_allclose(ours.responsibilities(sequence), summed, rtol=0.0, atol=1e-9)
