"""Demonstrations that cannot be learned from are refused by name, with what to do, by both kinds of HMM."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paramove.hmm import GaussianHMM, LeftRightHMM, TrainingOptions

PROPERTY = settings(max_examples=60, deadline=None, derandomize=True)
Model = Callable[[], GaussianHMM | LeftRightHMM]
MODELS = [
    pytest.param(lambda **options: LeftRightHMM(5, 3, 6, **options), id="durations"),
    pytest.param(lambda **options: GaussianHMM(5, **options), id="chain"),
    pytest.param(lambda **options: GaussianHMM(5, topology="ergodic", covariance="diagonal", **options), id="ergodic"),
]


def good(count: int = 4, n_frames: int = 22, dim: int = 3) -> list[np.ndarray]:
    rng = np.random.default_rng(0)
    return [rng.standard_normal((n_frames, dim)).cumsum(axis=0) for _ in range(count)]


def with_third(third: object) -> list[object]:
    sequences: list[object] = [*good()]
    sequences[2] = third
    return sequences


def damaged(row: int, column: int, value: float) -> np.ndarray:
    sequence = good()[2]
    sequence[row, column] = value
    return sequence


BAD = [
    pytest.param(with_third(damaged(7, 1, np.nan)), r"sequence 2: 1 of 22 .* not finite; .* frame 7; fill or cut",
                 id="nan"),
    pytest.param(with_third(damaged(0, 0, np.inf)), r"sequence 2: 1 of 22 .* frame 0; fill or cut", id="infinite"),
    pytest.param(with_third(damaged(3, 2, 1e200)), "sequence 2: values up to 1e[+]200 .* check the unit", id="huge"),
    pytest.param(with_third(np.zeros((0, 3))), "sequence 2: .* at least one frame, found", id="no frames"),
    pytest.param(with_third(np.zeros(22)), "sequence 2: a sequence has shape", id="one axis"),
    pytest.param(with_third([[0.0, 1.0, 2.0], [1.0]]), "sequence 2: .* the same number in each frame", id="ragged"),
    pytest.param(with_third([["a", "b", "c"]] * 22), "sequence 2: a sequence is an array of numbers", id="words"),
    pytest.param(with_third(good(dim=2)[0]), "sequence 2: it has 2 dimensions, sequence 0 has 3; give all the same",
                 id="dimensions"),
    pytest.param(with_third(good()[1]), "sequence 2: it is a copy of sequence 1, .* leave it out", id="copy"),
    pytest.param([], "no sequences were given; at least one is needed", id="empty set"),
    pytest.param([np.column_stack([s, np.full(22, 1.5)]) for s in good()],
                 "dimension 3 has the value 1.5 in all frames .* leave it out, or give TrainingOptions.floor_deviation",
                 id="constant dimension"),
    pytest.param([np.ones((22, 2))], "dimension 0 has the value 1 ", id="nothing moves"),
]  # fmt: skip


@pytest.mark.parametrize("make", MODELS)
@pytest.mark.parametrize(("sequences", "message"), BAD)
def test_bad_demonstrations_are_refused_with_place_and_remedy(
    make: Model, sequences: list[object], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        make().fit(sequences)  # type: ignore[arg-type]


@pytest.mark.parametrize(("make", "message"), [
    (lambda: LeftRightHMM(5, 3, 6), "sequence 2: a sequence of 1 frames does not fit .* allowed are 15 to 30 frames"),
    (lambda: GaussianHMM(5), "sequence 2: it has one frame, which is no movement; give at least 2 frames"),
    (lambda: GaussianHMM(5, finish_state=True), "sequence 2: a sequence of 1 frames has no path .* at least 5 frames"),
])  # fmt: skip
def test_one_frame_is_refused(make: Model, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make().fit(with_third(good()[2][:1]))  # type: ignore[arg-type]


@pytest.mark.parametrize("n_frames", [14, 31])
def test_lengths_that_the_durations_exclude_are_refused_with_the_allowed_ones(n_frames: int) -> None:
    sequences = with_third(good(n_frames=n_frames)[2])
    with pytest.raises(ValueError, match=r"sequence 2: .* allowed are 15 to 30 frames; resample it, best to about 22"):
        LeftRightHMM(5, 3, 6).fit(sequences)  # type: ignore[arg-type]


@pytest.mark.parametrize("make", MODELS)
def test_a_constant_dimension_is_trained_with_a_floor_in_its_unit(make: Callable[..., LeftRightHMM]) -> None:
    sequences = [np.column_stack([s, np.full(22, 1.5)]) for s in good()]
    model = make(options=TrainingOptions(floor_deviation=0.01)).fit(sequences)
    assert np.sqrt(np.linalg.eigvalsh(model.covariances_).min()) >= 0.01 * (1.0 - 1e-9)
    assert np.isfinite(model.log_likelihood(sequences[0]))
    still = make(options=TrainingOptions(floor_deviation=0.01)).fit([np.ones((22, 2))])
    assert np.isfinite(still.log_likelihood(np.ones((22, 2))))


@PROPERTY
@given(
    st.sampled_from([0, 1, 2]), st.integers(0, 2**31), st.integers(1, 4), st.integers(1, 4),
    st.sampled_from([1e-150, 1e-90, 1e-9, 1.0, 1e9, 1e90]), st.sampled_from([0.0, 1.0, 1e6]), st.booleans(),
)  # fmt: skip
def test_whatever_is_given_the_model_is_finite_or_the_error_is_ours(
    which: int, seed: int, count: int, dim: int, scale: float, shift: float, stepped: bool
) -> None:
    rng = np.random.default_rng(seed)
    sequences = [rng.standard_normal((int(rng.integers(15, 31)), dim)) for _ in range(count)]
    if stepped:  # many equal values, as of a coarse sensor
        sequences = [np.round(sequence) for sequence in sequences]
    sequences = [scale * (sequence + shift) for sequence in sequences]
    model = MODELS[which].values[0]()
    try:
        model.fit(sequences)
    except ValueError as error:
        assert any(word in str(error) for word in ("dimension", "copy"))  # noqa: PT017
        return
    assert np.isfinite(model.means_).all()
    assert np.isfinite(model.covariances_).all()
    assert np.isfinite([model.log_likelihood(sequence) for sequence in sequences]).all()
