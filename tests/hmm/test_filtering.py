"""Filtering frame by frame against the forward variables of whole beginnings."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.hmm import GaussianHMM, LeftRightHMM, OnlineFilter
from tests.hmm.chain_oracle import Chain, forward_backward
from tests.hmm.expanded import expanded_transitions
from tests.hmm.test_gaussian import chain_of, movements


def check_against(chain: Chain, online: OnlineFilter, sequence: np.ndarray, shared: np.ndarray) -> None:
    """A beginning of t frames has as its last gamma, without anything about the end, the filter's posterior."""
    for t in range(1, len(sequence) + 1):
        posterior = online.update(sequence[t - 1])
        value, gamma, _, _ = forward_backward(chain, sequence[:t], finish=False)
        assert_allclose(posterior, gamma[-1] @ np.eye(len(chain.means))[shared], rtol=0.0, atol=1e-9)
        assert_allclose(online.log_likelihood, value, rtol=1e-10, atol=0.0)
    assert online.n_frames == len(sequence)


@pytest.mark.parametrize("topology", ["left_right", "ergodic", "left_right_skips"])
@pytest.mark.parametrize("finish", [True, False])
def test_chain_filter_is_the_forward_variable_of_each_beginning(topology: str, finish: bool) -> None:
    sequences = movements(2, [20, 24, 28])
    model = GaussianHMM(4, topology=topology, finish_state=finish).fit(sequences)  # type: ignore[arg-type]
    check_against(chain_of(model.parameters), model.filter(), sequences[0], np.arange(4))


def test_duration_filter_is_the_forward_variable_of_the_expanded_states() -> None:
    sequences = movements(2, [20, 22, 24])
    model = LeftRightHMM(5, 2, 6).fit(sequences)
    shared = np.repeat(np.arange(5), 6)
    chain = Chain(np.eye(30)[0], expanded_transitions(model.durations_)[:-1], model.means_, model.covariances_, shared)
    online = model.filter()
    check_against(chain, online, sequences[0], shared)
    # Ending now makes the beginning the whole movement.
    whole = online.log_likelihood + np.log(online.finish_probability())
    assert_allclose(model.log_likelihood(sequences[0]), whole, rtol=1e-10, atol=0.0)


def test_the_finish_is_likely_at_the_end_and_not_before() -> None:
    model = LeftRightHMM(8, 2, 4).fit(movements(2, [22, 24, 26]))
    online = model.filter()
    finish = []
    for frame in movements(2, [22, 24, 26])[1]:
        online.update(frame)
        finish.append(online.finish_probability())
    assert max(finish[:15]) == 0.0  # 8 states of at least 2 frames
    assert finish[-1] > 0.2


def test_it_does_not_look_ahead() -> None:
    sequences = movements(2, [20, 24, 28])
    model = GaussianHMM(4).fit(sequences)
    first, second = model.filter(), model.filter()
    beginning = [first.update(frame) for frame in sequences[0][:10]]
    assert_allclose(
        [second.update(frame) for frame in [*sequences[0][:10], *sequences[1]]][:10], beginning, rtol=0, atol=0
    )


def test_bad_frames_leave_the_filter_as_it_was() -> None:
    model = LeftRightHMM(3, 2, 4).fit(movements(2, [9, 10, 11]))
    online = model.filter()
    online.update(np.zeros(2))
    before = online.posterior()
    with pytest.raises(ValueError, match="not finite"):
        online.update(np.array([np.nan, 0.0]))
    with pytest.raises(ValueError, match="describes 2 dimensions per frame, the sequence has 3"):
        online.update(np.zeros(3))
    assert (online.posterior() == before).all()
    assert online.n_frames == 1


def test_a_movement_that_outlasts_the_durations_is_refused() -> None:
    model = LeftRightHMM(3, 2, 4).fit(movements(2, [9, 10, 11]))
    online = model.filter()
    for _ in range(12):
        online.update(np.zeros(2))
    with pytest.raises(ValueError, match=r"no path for frame 13 .* begin a new filter"):
        online.update(np.zeros(2))
