"""Methods A to D and expected durations (2.2.4): what is drawn has the model's moments, durations and order."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.hmm import ChainParameters, GaussianHMM, LeftRightHMM, Parameters, TrainingOptions, resample
from tests.hmm.test_gaussian import movements

MEANS = np.array([[0.0, 0.0], [4.0, 1.0], [8.0, -1.0]])
COVARIANCES = np.array([[[0.3, 0.1], [0.1, 0.2]], [[0.2, 0.0], [0.0, 0.5]], [[0.4, -0.2], [-0.2, 0.3]]])
STAY = np.array([0.8, 0.5, 0.75])


def chain() -> GaussianHMM:
    transitions = np.diag(STAY) + np.diag(1.0 - STAY[:-1], k=1)
    exits = np.array([0.0, 0.0, 1.0 - STAY[-1]])
    parameters = ChainParameters(np.eye(3)[0], transitions, exits, MEANS, COVARIANCES)
    return GaussianHMM(3, finish_state=True).with_parameters(parameters)


def lasting() -> LeftRightHMM:
    durations = np.array([[0.0, 0.5, 0.3, 0.2], [0.0, 0.1, 0.1, 0.8], [0.0, 0.9, 0.1, 0.0]])
    return LeftRightHMM.from_parameters(Parameters(MEANS, COVARIANCES, durations, 2))


@pytest.mark.parametrize("model", [chain(), lasting()], ids=["chain", "durations"])
def test_drawn_sequences_have_the_moments_and_durations_of_the_model(model: GaussianHMM | LeftRightHMM) -> None:
    rng = np.random.default_rng(0)
    drawn = [model.sample(rng) for _ in range(3000)]
    states = np.concatenate([model.decode(sequence) for sequence in drawn])  # the means are far apart
    frames = np.concatenate(drawn)
    for i in range(3):
        own = frames[states == i]
        assert_allclose(own.mean(axis=0), MEANS[i], rtol=0.0, atol=0.05)
        assert_allclose(np.cov(own.T), COVARIANCES[i], rtol=0.0, atol=0.03)
        assert_allclose(len(own) / len(drawn), model.expected_durations()[i], rtol=0.03, atol=0.0)


def test_training_on_drawn_sequences_gives_the_model_back() -> None:
    rng = np.random.default_rng(1)
    model = chain()
    drawn = [sequence for sequence in (model.sample(rng) for _ in range(800)) if len(sequence) > 2]
    trained = GaussianHMM(3, finish_state=True, options=TrainingOptions(shrinkage_frames=0.0)).fit(drawn)
    assert_allclose(trained.means_, MEANS, rtol=0.0, atol=0.06)
    assert_allclose(trained.covariances_, COVARIANCES, rtol=0.0, atol=0.05)
    assert_allclose(trained.expected_durations(), 1.0 / (1.0 - STAY), rtol=0.08, atol=0.0)


def test_expected_durations_are_those_of_a_geometric_distribution() -> None:
    assert_allclose(chain().expected_durations(), [5.0, 2.0, 4.0], rtol=1e-12, atol=0.0)
    endless = GaussianHMM(3).fit(movements(2, [30, 33, 36]))
    assert np.isinf(endless.expected_durations()[-1])
    assert np.isfinite(endless.expected_durations()[:-1]).all()


def test_method_d_passes_the_means_in_order_at_their_expected_times() -> None:
    prototype = chain().synthesize(1101, timing="expected")
    centres = np.array([2.5, 6.0, 9.0])
    places = np.round(1100 * (centres - 2.5) / 6.5).astype(int)
    assert_allclose(prototype[places], MEANS, rtol=0.0, atol=0.01)
    assert_allclose(chain().synthesize(5)[::2], MEANS, rtol=0.0, atol=1e-12)
    assert len(chain().synthesize()) == 11  # as many as frames are expected


def test_method_b_comes_near_the_prototype_and_is_smoother_than_method_a() -> None:
    rng = np.random.default_rng(2)
    model = LeftRightHMM(10, 2, 4).fit(movements(2, [28, 30, 32, 30]))
    average, one = model.sample_average(rng, 400), model.sample(rng)
    roughness = [np.abs(np.diff(path, n=2, axis=0)).mean() for path in (average, one)]
    assert roughness[0] < 0.3 * roughness[1]
    assert np.abs(resample(average, 40) - model.synthesize(40)).mean() < 0.15


def test_method_c_passes_near_the_means_and_is_as_long_as_its_path() -> None:
    rng = np.random.default_rng(3)
    lengths = [len(chain().sample_spline(rng)) for _ in range(300)]
    assert_allclose(np.mean(lengths), 11.0, rtol=0.1, atol=0.0)
    path = lasting().sample_spline(rng)
    assert np.linalg.norm(path[0] - MEANS[0]) < 3.0
    assert np.linalg.norm(path[-1] - MEANS[-1]) < 3.0


def test_what_has_no_end_or_order_is_refused() -> None:
    sequences = movements(2, [30, 33, 36])
    rng = np.random.default_rng(0)
    endless = GaussianHMM(3).fit(sequences)
    with pytest.raises(ValueError, match="give n_frames"):
        endless.sample(rng)
    assert endless.sample(rng, 17).shape == (17, 2)
    with pytest.raises(ValueError, match="needs the states in order"):
        GaussianHMM(3, topology="ergodic").fit(sequences).synthesize()
