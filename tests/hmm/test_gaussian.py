"""The plain chain against hmmlearn and a numpy reference, and what must hold for any data."""

import itertools
import warnings

import numpy as np
import pytest
from hmmlearn.hmm import GaussianHMM as PeerHMM
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from paramove.hmm import ChainParameters, GaussianHMM, LeftRightHMM, SequenceLengthError, TrainingOptions
from paramove.hmm.chain import Topology
from paramove.hmm.gaussian import initial_chain
from paramove.hmm.training import equal_segments
from tests.hmm.chain_oracle import Chain, forward_backward, trained
from tests.hmm.expanded import expanded_transitions

PROPERTY = settings(max_examples=25, deadline=None, derandomize=True)
TOPOLOGIES = ("left_right", "left_right_skips", "ergodic")
KINDS = ("full", "diagonal", "tied")
EXACT = TrainingOptions.maximum_likelihood(6)


def movements(dim: int, lengths: list[int], seed: int = 0) -> list[np.ndarray]:
    """Smooth noisy curves of unequal lengths."""
    rng = np.random.default_rng(seed)
    shape = rng.standard_normal((5, dim))
    result = []
    for n_frames in lengths:
        progress = np.linspace(0.0, 1.0, n_frames)[:, None] ** rng.uniform(0.9, 1.1)
        bumps = np.exp(-0.5 * ((progress - np.linspace(0.0, 1.0, 5)) / 0.2) ** 2)
        result.append(
            bumps @ (shape + 0.2 * rng.standard_normal(shape.shape)) + 0.1 * rng.standard_normal((n_frames, dim))
        )
    return result


def unequal(dim: int) -> list[np.ndarray]:
    rng = np.random.default_rng(dim)
    return movements(dim, rng.integers(30, 60, size=max(6, 2 * dim)).tolist(), seed=dim)


def chain_of(parameters: ChainParameters) -> Chain:
    return Chain(
        parameters.start,
        np.column_stack([parameters.transitions, parameters.exits]),
        parameters.means,
        parameters.covariances,
        np.arange(len(parameters.means)),
    )


@pytest.mark.parametrize("dim", [2, 6, 21])
@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_likelihood_and_whole_training_equal_hmmlearn(topology: str, dim: int) -> None:
    sequences, n_states = unequal(dim), 4
    ours = GaussianHMM(n_states, topology=topology, options=EXACT)  # type: ignore[arg-type]
    start = initial_chain(sequences, n_states, ours.topology, "full", TrainingOptions(), "segments", 0)
    ours.fit(sequences, initial=start)
    theirs = PeerHMM(n_states, "full", init_params="", params="stmc", n_iter=6, tol=-np.inf,
                     min_covar=0.0, covars_prior=0.0, covars_weight=0.0)  # fmt: skip
    theirs.startprob_, theirs.transmat_ = start.start, start.transitions
    theirs.means_, theirs.covars_ = start.means, start.covariances
    theirs.fit(np.concatenate(sequences), [len(sequence) for sequence in sequences])

    assert ours.training_ is not None
    assert_allclose(ours.training_.log_likelihoods, list(theirs.monitor_.history), rtol=1e-10, atol=0.0)
    assert_allclose(ours.transitions_, theirs.transmat_, rtol=0.0, atol=1e-9)
    assert_allclose(ours.means_, theirs.means_, rtol=0.0, atol=1e-9)
    assert_allclose(ours.covariances_, theirs.covars_, rtol=0.0, atol=1e-9)
    for sequence in sequences[:3]:
        assert_allclose(ours.log_likelihood(sequence), theirs.score(sequence), rtol=1e-10, atol=0.0)
        assert_allclose(ours.responsibilities(sequence), theirs.predict_proba(sequence), rtol=0.0, atol=1e-9)
        assert (ours.decode(sequence) == theirs.predict(sequence)).all()


@pytest.mark.parametrize(("kind", "theirs_kind"), [("diagonal", "diag"), ("tied", "tied")])
def test_other_covariances_equal_hmmlearn(kind: str, theirs_kind: str) -> None:
    sequences = unequal(3)
    ours = GaussianHMM(4, topology="ergodic", covariance=kind, options=EXACT)  # type: ignore[arg-type]
    start = initial_chain(sequences, 4, ours.topology, ours.covariance, TrainingOptions(), "segments", 0)
    ours.fit(sequences, initial=start)
    theirs = PeerHMM(4, theirs_kind, init_params="", params="stmc", n_iter=6, tol=-np.inf,
                     min_covar=0.0, covars_prior=0.0, covars_weight=0.0)  # fmt: skip
    theirs.startprob_, theirs.transmat_, theirs.means_ = start.start, start.transitions, start.means
    theirs.covars_ = start.covariances[0] if kind == "tied" else np.diagonal(start.covariances, axis1=1, axis2=2)
    theirs.fit(np.concatenate(sequences), [len(sequence) for sequence in sequences])
    assert ours.training_ is not None
    assert_allclose(ours.training_.log_likelihoods, list(theirs.monitor_.history), rtol=1e-10, atol=0.0)


@pytest.mark.parametrize(
    ("topology", "loops"),
    [("left_right", True), ("left_right_skips", True), ("ergodic", True), ("left_right_skips", False)],
)
def test_finish_state_equals_the_model_with_one_more_state(topology: str, loops: bool) -> None:
    n_states = 4 if loops else 30
    sequences = movements(3, [19, 22, 25, 28], seed=4)
    ours = GaussianHMM(n_states, topology=topology, self_transitions=loops, finish_state=True, options=EXACT)  # type: ignore[arg-type]
    if not loops:
        ours.options = TrainingOptions(max_iterations=4, annealing_iterations=0, tolerance=0.0)
    start = initial_chain(sequences, n_states, ours.topology, "full", TrainingOptions(), "random", 1)
    for sequence in sequences:
        expected, gamma, _, _ = forward_backward(chain_of(start), sequence, finish=True)
        begin = GaussianHMM(n_states, topology=topology, self_transitions=loops, finish_state=True)  # type: ignore[arg-type]
        begin.with_parameters(start)
        assert_allclose(begin.log_likelihood(sequence), expected, rtol=1e-10, atol=0.0)
        assert_allclose(begin.responsibilities(sequence), gamma, rtol=0.0, atol=1e-9)
    ours.fit(sequences, initial=start)
    if not loops:
        return
    reference, history = trained(chain_of(start), sequences, 6, finish=True)
    assert ours.training_ is not None
    assert_allclose(ours.training_.log_likelihoods, history, rtol=1e-10, atol=0.0)
    assert_allclose(ours.transitions_, reference.transitions[:, :-1], rtol=0.0, atol=1e-9)
    assert_allclose(ours.exits_, reference.transitions[:, -1], rtol=0.0, atol=1e-9)


def test_durations_and_expanded_states_train_alike() -> None:
    sequences, n_states, d_min, d_max = movements(2, [17, 20, 22, 24, 19], seed=2), 5, 3, 5
    ours = LeftRightHMM(n_states, d_min, d_max, options=EXACT)
    start = equal_segments(sequences, n_states, d_min, d_max, TrainingOptions())
    ours.fit(sequences, initial=start)
    expanded = Chain(
        np.eye(n_states * d_max)[0],
        expanded_transitions(start.durations)[:-1],
        start.means,
        start.covariances,
        np.repeat(np.arange(n_states), d_max),
    )
    reference, history = trained(expanded, sequences, 6, finish=True)
    assert ours.training_ is not None
    assert_allclose(ours.training_.log_likelihoods, history, rtol=1e-10, atol=0.0)
    assert_allclose(ours.means_, reference.means, rtol=0.0, atol=1e-9)
    # Leaving sub-state d - 1 has the probability p(d) / p(at least d).
    leaving = reference.transitions[np.arange(n_states * d_max), np.repeat(np.arange(1, n_states + 1) * d_max, d_max)]
    staying = np.cumprod(np.column_stack([np.ones(n_states), 1.0 - leaving.reshape(n_states, d_max)]), axis=1)
    assert_allclose(ours.durations_, staying[:, :-1] * leaving.reshape(n_states, d_max), rtol=0.0, atol=1e-9)


@PROPERTY
@given(
    st.sampled_from(TOPOLOGIES), st.sampled_from(KINDS), st.booleans(), st.sampled_from(("segments", "random")),
    st.integers(0, 2**31), st.integers(1, 6), st.integers(1, 4),
)  # fmt: skip
def test_objective_never_falls(
    topology: str, kind: str, finish: bool, initialisation: str, seed: int, n_states: int, dim: int
) -> None:
    rng = np.random.default_rng(seed)
    sequences = [rng.standard_normal((int(rng.integers(8, 30)), dim)).cumsum(axis=0) for _ in range(3)]
    options = TrainingOptions(max_iterations=15, tolerance=0.0, annealing_iterations=int(rng.integers(0, 4)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # the monitor warns where the objective falls
        model = GaussianHMM(
            n_states, topology=topology, covariance=kind, finish_state=finish, initialisation=initialisation,  # type: ignore[arg-type]
            seed=seed, options=options,
        ).fit(sequences)  # fmt: skip
    assert np.isfinite(model.means_).all()
    assert np.isfinite(model.covariances_).all()
    assert_allclose(model.transitions_.sum(axis=1) + model.exits_, 1.0, rtol=0.0, atol=1e-12)
    for sequence in sequences:
        assert_allclose(model.responsibilities(sequence).sum(axis=1), 1.0, rtol=0.0, atol=1e-9)


@PROPERTY
@given(st.sampled_from(KINDS), st.integers(0, 2**31), st.integers(1, 5))
def test_objective_of_durations_never_falls(kind: str, seed: int, dim: int) -> None:
    rng = np.random.default_rng(seed)
    sequences = [rng.standard_normal((int(rng.integers(12, 30)), dim)).cumsum(axis=0) for _ in range(3)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model = LeftRightHMM(6, 1, 6, covariance=kind, options=TrainingOptions(max_iterations=15, tolerance=0.0))  # type: ignore[arg-type]
        model.fit(sequences)
    assert np.isfinite(model.covariances_).all()


@pytest.mark.parametrize("kind", KINDS)
def test_covariances_have_the_form_that_was_asked_for(kind: str) -> None:
    sequences = movements(3, [40, 44, 48])
    for model in (
        GaussianHMM(3, covariance=kind).fit(sequences),  # type: ignore[arg-type]
        LeftRightHMM(3, 10, 20, covariance=kind).fit(sequences),  # type: ignore[arg-type]
    ):
        outside = model.covariances_ * (1.0 - np.eye(3))
        assert (outside == 0.0).all() == (kind == "diagonal")
        assert np.ptp(model.covariances_, axis=0).max() == 0.0 or kind != "tied"


def test_transitions_that_do_not_exist_stay_impossible() -> None:
    model = GaussianHMM(6, topology="left_right_skips", max_skip=2, initialisation="random", seed=3)
    model.fit(movements(2, [40, 50, 45]))
    allowed = Topology("left_right_skips", 2).transitions(6)
    assert (model.transitions_[~allowed] == 0.0).all()
    assert_allclose(model.start_, np.eye(6)[0], rtol=0.0, atol=0.0)


def test_best_path_is_the_best_of_all() -> None:
    sequences = movements(2, [7, 6])
    model = GaussianHMM(3, topology="ergodic", finish_state=True).fit(sequences)
    ready = model._ready()
    outputs = np.array([ready.log_outputs(model._stacked(sequences[0]))])[0]
    values = {
        path: ready.log_start[path[0]] + ready.log_exits[path[-1]] + sum(outputs[i, t] for t, i in enumerate(path))
        + sum(ready.log_transitions[i, j] for i, j in itertools.pairwise(path))
        for path in itertools.product(range(3), repeat=7)
    }  # fmt: skip
    assert tuple(model.decode(sequences[0])) == max(values, key=lambda path: values[path])


@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_outputs_that_underflow_in_every_frame_still_have_a_likelihood(topology: str) -> None:
    rng = np.random.default_rng(2)
    model = GaussianHMM(12, topology=topology)  # type: ignore[arg-type]
    start = initial_chain(movements(21, [60, 60]), 12, model.topology, "full", TrainingOptions(), "segments", 0)
    narrow = ChainParameters(
        start.start, start.transitions, start.exits, start.means, np.tile(np.eye(21) * 1e-6, (12, 1, 1))
    )
    model.with_parameters(narrow)
    sequence = rng.standard_normal((100, 21)) * 10.0
    value, gamma, _, _ = forward_backward(chain_of(narrow), sequence, finish=False)
    assert value < -1e8
    assert_allclose(model.log_likelihood(sequence), value, rtol=1e-10, atol=0.0)
    ours = model.responsibilities(sequence)
    assert_allclose(ours, gamma, rtol=0.0, atol=1e-3)  # alpha beta / p loses digits to the size of the logarithms
    assert_allclose(ours.sum(axis=1), 1.0, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("likelier_by", [600.0, 699.5, 1250.0])
def test_the_only_predecessor_may_have_underflowed(likelier_by: float) -> None:
    """State 1 precedes state 2 alone, and is so unlikely in its frame that its share of alpha, or its product, is 0."""
    means = np.array([[0.0], [np.sqrt(2.0 * likelier_by)], [100.0]])
    transitions = np.array([[1.0, 0.0, 0.0], [0.0, 1.0 - 1e-6, 1e-6], [0.0, 0.0, 1.0]])
    parameters = ChainParameters(
        np.array([0.5, 0.5, 0.0]), transitions, np.zeros(3), means, np.tile(np.eye(1), (3, 1, 1))
    )
    model = GaussianHMM(3, topology="ergodic").with_parameters(parameters)
    sequence = np.array([[0.0], [100.0], [100.0]])
    value, gamma, xi, _ = forward_backward(chain_of(parameters), sequence, finish=False)
    np.testing.assert_array_equal(gamma.argmax(axis=1), [1, 2, 2])
    assert_allclose(model.log_likelihood(sequence), value, rtol=1e-12, atol=0.0)
    assert_allclose(model.responsibilities(sequence), gamma, rtol=0.0, atol=1e-9)
    _, _, found = model._ready().expectation(model._stacked(sequence))
    assert_allclose(found.transitions, xi, rtol=0.0, atol=1e-9)


def test_random_initialisation_is_repeated_by_its_seed() -> None:
    sequences = movements(2, [40, 44, 48])
    first, again, other = (
        GaussianHMM(5, initialisation="random", seed=seed, options=TrainingOptions(max_iterations=2)).fit(sequences)
        for seed in (1, 1, 2)
    )
    assert (first.means_ == again.means_).all()
    assert not (first.means_ == other.means_).all()


def test_lengths_without_a_path_are_refused_with_the_allowed_ones() -> None:
    with pytest.raises(SequenceLengthError, match=r"sequence 1: a sequence of 5 frames .* at least 6 frames"):
        GaussianHMM(6, finish_state=True).fit(movements(2, [20, 5]))
    with pytest.raises(SequenceLengthError, match="allowed are 1 to 6 frames"):
        GaussianHMM(6, topology="left_right_skips", self_transitions=False).fit(movements(2, [20, 5]))


def test_parameters_that_contradict_the_topology_are_refused() -> None:
    eye = np.tile(np.eye(2), (2, 1, 1))
    start, means = np.array([1.0, 0.0]), np.zeros((2, 2))
    back = ChainParameters(start, np.array([[0.5, 0.5], [0.5, 0.5]]), np.zeros(2), means, eye)
    with pytest.raises(ValueError, match="transitions has a probability where topology 'left_right'"):
        GaussianHMM(2).with_parameters(back)
    short = ChainParameters(start, np.array([[0.5, 0.4], [0.0, 1.0]]), np.zeros(2), means, eye)
    with pytest.raises(ValueError, match="sum to 1"):
        GaussianHMM(2).with_parameters(short)
    endless = ChainParameters(start, np.array([[0.5, 0.5], [0.0, 1.0]]), np.zeros(2), means, eye)
    with pytest.raises(ValueError, match="no state has a transition into the finish state"):
        GaussianHMM(2, finish_state=True).with_parameters(endless)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"topology": "ring"}, "topology is one of ergodic, left_right, left_right_skips, found 'ring'"),
        ({"covariance": "round"}, "covariance is one of full, diagonal, tied, found 'round'"),
        ({"initialisation": "best"}, "initialisation is one of segments, random, found 'best'"),
        ({"max_skip": 0}, "max_skip is at least 1"),
        ({"topology": "ergodic", "self_transitions": False}, "an ergodic chain has self-transitions"),
    ],
)
def test_unknown_choices_are_refused_with_those_there_are(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        GaussianHMM(3, **arguments)  # type: ignore[arg-type]


def test_a_covariance_that_maximum_likelihood_makes_singular_is_named() -> None:
    rng = np.random.default_rng(0)
    sequences = [rng.standard_normal((8, 6)) for _ in range(2)]
    with pytest.raises(ValueError, match=r"the covariance of state \d+ is not positive definite .* train with a floor"):
        GaussianHMM(6, options=TrainingOptions.maximum_likelihood(10)).fit(sequences)


def test_untrained_models_say_so() -> None:
    with pytest.raises(RuntimeError, match="call fit or with_parameters"):
        GaussianHMM(3).log_likelihood(np.zeros((5, 2)))


def test_an_ergodic_chain_finds_states_that_come_again() -> None:
    """Three poses, visited in any order: equal parts of the sequences would mix them."""
    rng = np.random.default_rng(0)
    places = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    visits = [np.repeat(rng.permutation(np.repeat(np.arange(3), 4)), 10) for _ in range(6)]
    sequences = [places[one] + rng.normal(0.0, 0.05, (len(one), 2)) for one in visits]
    model = GaussianHMM(3, topology="ergodic").fit(sequences)
    distances = np.linalg.norm(model.means_[:, None] - places[None], axis=2)
    assert (distances.min(axis=1) < 0.05).all()
    assert sorted(distances.argmin(axis=1).tolist()) == [0, 1, 2]
