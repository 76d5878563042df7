"""What holds for parametric HMMs of every class: refusals, files, scikit-learn."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path

import joblib
import numpy as np
import pytest
from numpy.testing import assert_allclose
from sklearn.base import clone, is_regressor
from sklearn.exceptions import NotFittedError
from sklearn.metrics import r2_score
from sklearn.model_selection import GridSearchCV, KFold, cross_val_predict, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer
from sklearn.utils.validation import check_is_fitted

from paramove.hmm import NotFittedError as OurNotFittedError
from paramove.hmm import SequenceLengthError, resample
from paramove.phmm import (
    InterpolativePHMM,
    LinearPHMM,
    ModelFileError,
    MovementClassifier,
    ParametricHMM,
    QuadraticPHMM,
    has_p_values,
)
from tests.phmm.movements import CLASSES, shown, trained, untrained, wave

every_class = pytest.mark.parametrize("kind", CLASSES, ids=lambda kind: kind.__name__)
UNSEEN = wave(np.array([0.3, 0.7]), np.random.default_rng(77))


@pytest.fixture(scope="module")
def models() -> dict[type[ParametricHMM], ParametricHMM]:
    return {kind: trained(kind) for kind in CLASSES}


BAD = {
    "NaN": (lambda x: np.where(np.arange(40)[:, None] == 3, np.nan, x), "sequence 5: 1 of 40 frames.*fill or cut"),
    "one frame": (lambda x: x[:1], "sequence 5: it has one frame.*give at least 2"),
    "too long": (
        lambda x: np.repeat(x, 2, axis=0),
        "sequence 5: .*80 frames does not fit 8 states of 4 to 6.*resample",
    ),
    "too short": (lambda x: x[:20], "sequence 5: .*20 frames does not fit 8 states of 4 to 6.*resample"),
    "other dimension": (lambda x: x[:, :2], "sequence 5: it has 2 dimensions, sequence 0 has 3; give all the same"),
    "not a table": (lambda x: x[:, 0], "sequence 5: a sequence has shape"),
}


@every_class
@pytest.mark.parametrize("fault", BAD)
def test_a_bad_demonstration_is_named_with_the_remedy(kind: type[ParametricHMM], fault: str) -> None:
    sequences, theta = shown(0)
    spoil, message = BAD[fault]
    sequences[5] = spoil(sequences[5])
    with pytest.raises(ValueError, match=message):
        untrained(kind).fit(sequences, theta)


@every_class
def test_a_constant_dimension_is_named_with_the_remedy(kind: type[ParametricHMM]) -> None:
    sequences, theta = shown(0)
    with pytest.raises(ValueError, match=r"dimension 3 has the value 0\.5 .*leave it out, or give .*floor_deviation"):
        untrained(kind).fit([np.column_stack([one, np.full(len(one), 0.5)]) for one in sequences], theta)


@every_class
def test_one_theta_alone_is_refused(kind: type[ParametricHMM]) -> None:
    sequences, _ = shown(0, lines=1, repetitions=10)
    theta = np.tile([0.4, 0.6], (len(sequences), 1))
    with pytest.raises(ValueError, match=r"theta is \[0\.4, 0\.6\] for every sequence.*give sequences with different"):
        untrained(kind).fit(sequences, theta)


@every_class
def test_no_demonstrations_are_refused(kind: type[ParametricHMM]) -> None:
    with pytest.raises(ValueError, match="no sequences were given; at least one is needed"):
        untrained(kind).fit([], np.zeros((0, 2)))


@every_class
@pytest.mark.parametrize("labels", [np.zeros((3, 2)), np.zeros((36, 2, 2)), np.zeros((36, 0))])
def test_labels_that_do_not_fit_are_refused(kind: type[ParametricHMM], labels: np.ndarray) -> None:
    with pytest.raises(ValueError, match=r"theta has one row per sequence: expected shape \(36, P\)"):
        untrained(kind).fit(shown(0)[0], labels)


def test_a_theta_that_is_not_finite_is_named() -> None:
    sequences, theta = shown(0)
    theta[[7, 9], 1] = np.nan
    with pytest.raises(ValueError, match=r"found \[.*nan\] for sequence 7, 2 in all"):
        LinearPHMM().fit(sequences, theta)


@every_class
def test_what_cannot_be_estimated_is_refused(
    models: dict[type[ParametricHMM], ParametricHMM], kind: type[ParametricHMM]
) -> None:
    model = models[kind]
    with pytest.raises(SequenceLengthError, match="allowed are 32 to 48 frames"):
        model.estimate(np.zeros((90, 3)))
    with pytest.raises(ValueError, match="the model describes 3 dimensions per frame, the sequence has 2"):
        model.estimate(np.zeros((40, 2)))
    with pytest.raises(ValueError, match="theta has 2 finite components"):
        model.at([0.1, np.nan])


@every_class
def test_beginnings_and_p_values_are_everybodys(
    models: dict[type[ParametricHMM], ParametricHMM], kind: type[ParametricHMM]
) -> None:
    model = models[kind]
    assert has_p_values(model)
    assert_allclose(model.estimate(UNSEEN[:30], finished=False).theta, [0.3, 0.7], rtol=0.0, atol=0.2)
    stopped = np.concatenate([UNSEEN[:20], np.repeat(UNSEEN[20:21], 20, axis=0)])
    assert model.examine(UNSEEN).p_value > 0.05
    assert model.examine(stopped).p_value < 0.001


@every_class
def test_an_estimate_is_no_worse_than_the_truth_and_near_it(
    models: dict[type[ParametricHMM], ParametricHMM], kind: type[ParametricHMM]
) -> None:
    found = models[kind].estimate(UNSEEN)
    assert_allclose(found.theta, [0.3, 0.7], rtol=0.0, atol=0.08)
    assert np.linalg.eigvalsh(found.covariance).min() > 0.0
    assert_allclose(found.log_likelihood, models[kind].log_likelihood(UNSEEN, found.theta), rtol=1e-9, atol=1e-6)


@every_class
def test_a_file_gives_the_same_model_to_the_last_bit(
    models: dict[type[ParametricHMM], ParametricHMM], kind: type[ParametricHMM], tmp_path: Path
) -> None:
    model, file = models[kind], tmp_path / "model.npz"
    model.save(file)
    again = ParametricHMM.load(file)
    assert type(again) is kind
    assert again.get_params() == model.get_params()
    assert again.training_ == model.training_
    stored, kept = again._arrays(), model._arrays()
    assert stored.keys() == kept.keys()
    assert all(np.array_equal(stored[name], kept[name]) for name in kept)
    for one, other in zip(again.estimate(UNSEEN), model.estimate(UNSEEN), strict=True):
        assert np.array_equal(one, other)
    assert np.array_equal(again.synthesize([0.2, 0.9], 70), model.synthesize([0.2, 0.9], 70))


@every_class
def test_files_that_do_not_fit_are_refused(
    models: dict[type[ParametricHMM], ParametricHMM], kind: type[ParametricHMM], tmp_path: Path
) -> None:
    file = tmp_path / "model.npz"
    models[kind].save(file)
    content = file.read_bytes()
    with np.load(file, allow_pickle=False) as stored:
        arrays = {name: stored[name] for name in stored.files}
    broken = tmp_path / "broken.npz"

    def rejected(message: str) -> None:
        with pytest.raises(ModelFileError, match=message):
            ParametricHMM.load(broken)

    broken.write_bytes(content[: len(content) // 2])
    rejected("cut off or damaged")
    np.savez(broken, **{**arrays, "format_version": np.array(99)})
    rejected("expected format version 3, found 99")
    np.savez(broken, **{**arrays, "learned_durations": np.full_like(arrays["learned_durations"], np.nan)})
    rejected("expected finite numbers in 'durations', found NaN")
    np.savez(broken, **{name: value for name, value in arrays.items() if name != "learned_covariances"})
    rejected("expected an array 'covariances'")
    np.savez(broken, **{**arrays, "learned_covariances": arrays["learned_covariances"][..., :2]})
    rejected("expected covariances of shape")
    other = InterpolativePHMM if kind is not InterpolativePHMM else LinearPHMM
    with pytest.raises(ModelFileError, match=f"found a {kind.__name__}"):
        other.load(file)


@every_class
def test_scikit_learn_selects_models(kind: type[ParametricHMM]) -> None:
    sequences, theta = shown(3, lines=2, repetitions=4)
    folds = KFold(2, shuffle=True, random_state=2)
    scores = cross_val_score(untrained(kind), sequences, theta, cv=folds, error_score="raise")
    assert np.isfinite(scores).all()
    search = GridSearchCV(untrained(kind), {"n_states": [7, 8]}, cv=folds, error_score="raise").fit(sequences, theta)
    assert search.best_params_["n_states"] in (7, 8)
    best = search.best_estimator_
    found, covariances = best.predict(sequences, return_cov=True)
    assert covariances.shape == (len(sequences), 2, 2)
    assert_allclose(best.score(sequences, theta), r2_score(theta, found), rtol=1e-12, atol=0.0)
    assert best.score(sequences, theta) > 0.9


@every_class
def test_the_script_of_a_scikit_learn_user_runs(kind: type[ParametricHMM], tmp_path: Path) -> None:
    sequences, theta = shown(3, lines=2, repetitions=4)
    folds = KFold(2, shuffle=True, random_state=2)
    search = GridSearchCV(kind(), {"n_states": np.array([5, 10])}, cv=folds, error_score="raise")
    search.fit(sequences, theta)  # states last as long as 100 frames allow
    assert is_regressor(kind())
    pipeline = make_pipeline(FunctionTransformer(lambda X: [2.0 * x for x in X]), kind(10))
    predicted = cross_val_predict(pipeline, sequences, theta, cv=folds)
    assert np.abs(predicted - theta).mean() < 0.1
    model = search.best_estimator_
    model.save(tmp_path / "model.npz")  # a number of numpy's becomes a plain one
    joblib.dump(model, tmp_path / "model.joblib")
    for again in (joblib.load(tmp_path / "model.joblib"), ParametricHMM.load(tmp_path / "model.npz"), deepcopy(model)):
        assert np.array_equal(again.predict(sequences), model.predict(sequences))
    flat = kind().fit(sequences, theta[:, 0])
    flat.save(tmp_path / "flat.npz")
    assert flat.predict(sequences).shape == ParametricHMM.load(tmp_path / "flat.npz").predict(sequences).shape == (16,)
    assert flat.score(sequences, theta[:, 0]) > 0.8
    assert kind().fit(sequences, theta[:, :1]).predict(sequences).shape == (16, 1)


def test_durations_of_states_follow_from_the_frames() -> None:
    assert (LinearPHMM().d_min_, LinearPHMM().d_max_, LinearPHMM().resampled_frames_) == (4, 6, 100)
    assert (LinearPHMM(7).d_min_, LinearPHMM(7).d_max_) == (11, 18)
    assert LinearPHMM(300).d_min_ == 1
    assert LinearPHMM(8, 4, 6).resampled_frames_ is None
    assert LinearPHMM(8, resampled_frames=40).d_max_ == 6
    assert (LinearPHMM(d_max=9).d_min_, LinearPHMM(d_max=9).resampled_frames_, LinearPHMM(8, 4).d_max_) == (1, None, 8)
    with pytest.raises(ValueError, match="at least one state, found 0"):
        LinearPHMM(0).fit(*shown(0))


@every_class
def test_far_movements_take_their_natural_duration(kind: type[ParametricHMM], tmp_path: Path) -> None:
    sequences, theta = shown(3, lines=3, repetitions=4)
    sequences = [resample(x, round(60 * (1.0 + u))) for x, (u, _) in zip(sequences, theta, strict=True)]
    model = kind(8).fit(sequences, theta)
    model.save(tmp_path / "model.npz")
    again = ParametricHMM.load(tmp_path / "model.npz")
    assert_allclose(again.natural_frames([[0.0, 0.5], [1.0, 0.2], [9.0, 0.2]]), [61, 121, 121], atol=4)
    assert model.synthesize([1.0, 0.0], model.natural_frames([1.0, 0.0])).shape == (again.natural_frames([1, 0]), 3)
    with np.load(tmp_path / "model.npz", allow_pickle=False) as stored:
        arrays = {name: stored[name] for name in stored.files} | {"learned_log_frames": np.zeros(2)}
    np.savez(tmp_path / "broken.npz", **arrays)
    with pytest.raises(ModelFileError, match="log_frames"):
        ParametricHMM.load(tmp_path / "broken.npz")
    with pytest.raises(NotFittedError):
        kind().natural_frames([0.0, 0.0])


def test_durations_that_do_not_depend_on_theta_stay_so() -> None:
    rng = np.random.default_rng(5)
    sequences, theta = shown(3, lines=3, repetitions=4)
    sequences = [resample(x, int(rng.integers(80, 121))) for x in sequences]
    found = LinearPHMM().fit(sequences, theta).natural_frames(theta)
    assert np.ptp(found) < 12
    equal = LinearPHMM().fit([resample(x, 90) for x in sequences], theta)
    assert (equal.natural_frames(theta) == 90).all()


def test_an_untrained_model_is_reported_as_scikit_learn_does() -> None:
    model = LinearPHMM()
    with pytest.raises(NotFittedError) as caught:
        model.predict([UNSEEN])
    assert isinstance(caught.value, OurNotFittedError)
    assert isinstance(deepcopy(caught.value), NotFittedError)  # as joblib sends it
    for ask in (model.estimate, lambda x: model.score([x], [[0.0]]), lambda x: MovementClassifier().classify(x)):
        with pytest.raises(NotFittedError):
            ask(UNSEEN)
    with pytest.raises(NotFittedError):
        check_is_fitted(model)
    with pytest.raises(ValueError, match="at least 2"):
        model.fit([np.zeros((1, 3))] * 4, [[0.0], [1.0], [2.0], [3.0]])
    with pytest.raises(NotFittedError):
        model.estimate(UNSEEN)
    check_is_fitted(LinearPHMM().fit(*shown(0)))


def test_texts_and_clones_have_what_was_given() -> None:
    assert repr(QuadraticPHMM(7, residuals="independent")) == "QuadraticPHMM(n_states=7, residuals='independent')"
    assert repr(LinearPHMM()) == "LinearPHMM()"
    classifier = clone(MovementClassifier(QuadraticPHMM(7)))
    assert classifier.get_params()["model__n_states"] == 7
    classifier.set_params(model__n_states=9)
    assert classifier.model.n_states == 9
    with pytest.raises(ValueError, match="found 'states'"):
        classifier.set_params(states=3)


@every_class
def test_clones_are_untrained_and_parameters_have_names(kind: type[ParametricHMM]) -> None:
    copy = clone(untrained(kind))
    assert copy.get_params()["n_states"] == 8
    assert copy.parameter_bounds_ is None
    with pytest.raises(ValueError, match="found 'n_stats'"):
        copy.set_params(n_stats=3)
    with pytest.raises(RuntimeError, match="call fit"):
        copy.save("nowhere.npz")


@every_class
@pytest.mark.parametrize(("dimension", "lines"), [(1, 5), (3, 2), (4, 2)])
def test_any_number_of_parameters(kind: type[ParametricHMM], dimension: int, lines: int) -> None:
    if dimension == 4 and kind.__name__ == "CubicPHMM":
        lines = 3
    sequences, theta = shown(1, lines, dimension, 81 // lines**dimension if dimension == 1 else 3 if lines == 2 else 1)
    model = untrained(kind).fit(sequences, theta)
    truth = np.linspace(0.25, 0.6, dimension)
    found = model.estimate(wave(truth, np.random.default_rng(5)))
    assert found.theta.shape == (dimension,)
    assert found.covariance.shape == (dimension, dimension)
    # Three dimensions of the wave do not tell four parameters apart, but those that move them are found.
    assert_allclose(found.theta[0], truth[0], rtol=0.0, atol=0.1)
