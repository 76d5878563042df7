"""The interpolative parametric HMM."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from sklearn.base import clone

from paramove.hmm import SequenceLengthError, TrainingOptions
from paramove.phmm import InterpolativePHMM, ModelFileError, MovementDescription, ParameterGrid, ParametricHMM

PROPERTY = settings(max_examples=30, deadline=None, derandomize=True)
GRID = ParameterGrid.from_lines([-0.4, 0.0, 0.4], [0.1, 0.4])


def movement(theta: np.ndarray, rng: np.random.Generator, n_frames: int = 60) -> np.ndarray:
    """Out to theta along an arc and back, with a progression rate of its own."""
    progress = np.linspace(0.0, 1.0, n_frames) ** rng.uniform(0.95, 1.05)
    out = np.sin(np.pi * progress) ** 2
    x, y = out * theta[0], out * theta[1]
    points = np.column_stack([x, y, 0.3 * np.sin(2 * np.pi * progress), progress])
    return points + 0.003 * rng.standard_normal(points.shape) + 0.004 * rng.standard_normal(4)


@pytest.fixture(scope="module")
def model() -> InterpolativePHMM:
    rng = np.random.default_rng(0)
    theta = np.repeat(GRID.points(), 6, axis=0)
    description = MovementDescription("wave", ("hand",), "m", "table", ("x", "y"))
    shown = [movement(one, rng) for one in theta]
    return InterpolativePHMM(20, 2, 4, description=description, residuals="independent").fit(shown, theta)


def test_local_models_are_those_of_the_grid(model: InterpolativePHMM) -> None:
    assert model.grid_.shape == (3, 2)
    for number, theta in enumerate(GRID.points()):
        local = model.at(theta)
        assert_allclose(local.means_, model.means_[number], rtol=0.0, atol=1e-12)
        assert_allclose(local.covariances_, model.covariances_[number], rtol=0.0, atol=1e-12)
        assert_allclose(local.durations_, model.durations_[number], rtol=0.0, atol=1e-12)


@PROPERTY
@given(st.floats(-0.4, 0.4), st.floats(0.1, 0.4))
def test_interpolated_models_are_proper(model: InterpolativePHMM, x: float, y: float) -> None:
    hmm = model.at([x, y])
    assert_allclose(hmm.durations_.sum(axis=1), 1.0, rtol=0.0, atol=1e-12)
    assert np.linalg.eigvalsh(hmm.covariances_).min() > 0
    peak = hmm.means_[np.argmax(np.abs(hmm.means_[:, 0]))] if abs(x) > 0.1 else hmm.means_[np.argmax(hmm.means_[:, 1])]
    assert_allclose(peak[:2], [x, y], rtol=0.0, atol=0.02)


def test_outside_means_extrapolate_and_covariances_stay(model: InterpolativePHMM) -> None:
    inside, border, outside = (model.at([x, 0.2]) for x in (0.2, 0.4, 0.6))
    assert_allclose(outside.means_, 2.0 * border.means_ - inside.means_, rtol=0.0, atol=1e-12)
    assert_allclose(outside.covariances_, border.covariances_, rtol=0.0, atol=1e-12)
    assert_allclose(outside.durations_, border.durations_, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("theta", [(0.2, 0.2), (-0.3, 0.35), (0.05, 0.12), (-0.4, 0.4)])
def test_parameter_of_a_new_movement_is_found(model: InterpolativePHMM, theta: tuple[float, float]) -> None:
    found = model.estimate(movement(np.array(theta), np.random.default_rng(9)))
    assert_allclose(found.theta, theta, rtol=0.0, atol=0.02)
    assert np.linalg.eigvalsh(found.covariance).min() > 0
    assert found.log_likelihood >= model.log_likelihood(movement(np.array(theta), np.random.default_rng(9)), theta)


def test_estimate_is_the_maximum_of_a_dense_raster(model: InterpolativePHMM) -> None:
    sequence = movement(np.array([0.02, 0.25]), np.random.default_rng(2))  # beside the border of two cells
    raster = [(x, y) for x in np.linspace(-0.05, 0.08, 27) for y in np.linspace(0.2, 0.3, 21)]
    assert model.estimate(sequence).log_likelihood >= max(model.log_likelihood(sequence, one) for one in raster) - 1e-3


def test_poses_and_covariances_at_a_progress_lie_between_those_of_the_states(model: InterpolativePHMM) -> None:
    rng = np.random.default_rng(4)
    theta, tau = rng.uniform(-0.5, 0.5, (30, 2)), rng.uniform(0.0, 1.0, 30)
    tau[:2] = 0.0, 1.0
    for number in range(30):
        hmm, position = model.at(theta[number]), tau[number] * 19
        low, high, share = int(np.floor(position)), int(np.ceil(position)), position - np.floor(position)
        spread = (1 - share) * hmm.covariances_[low] + share * hmm.covariances_[high]
        pose = (1 - share) * hmm.means_[low] + share * hmm.means_[high]
        assert_allclose(model.progress_mean(theta[number], tau)[number], pose, rtol=0.0, atol=1e-12)
        covariance = model.progress_covariance(theta[number], tau[number])
        assert_allclose(covariance, spread, rtol=0.0, atol=1e-12)
        assert_allclose(model.progress_covariance(theta[number], tau)[number], spread, rtol=0.0, atol=1e-12)
        assert covariance.shape == (4, 4)


def test_file_gives_the_same_model(model: InterpolativePHMM, tmp_path: Path) -> None:
    file = tmp_path / "wave.npz"
    model.save(file)
    again = ParametricHMM.load(file)
    assert isinstance(again, InterpolativePHMM)
    assert again.get_params() == model.get_params()
    assert again.training_ == model.training_
    sequence = movement(np.array([0.1, 0.2]), np.random.default_rng(1))
    assert again.log_likelihood(sequence, [0.1, 0.2]) == model.log_likelihood(sequence, [0.1, 0.2])
    with np.load(file, allow_pickle=False) as stored:
        assert all(stored[name].dtype.kind in "fiU" for name in stored.files)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("format_version", np.array(7), "expected format version 3, found 7"),
        ("learned_means", np.full((6, 20, 4), np.nan), "expected finite numbers in 'means', found NaN"),
        ("learned_means", np.zeros((6, 19, 4)), r"expected means of shape \(6, 20, 4\), found \(6, 19, 4\)"),
        ("header", np.array('{"class": "Other", "parameters": {}, "training": null}'), "found a Other"),
        ("header", np.array("no header"), "the header cannot be read"),
    ],
)
def test_files_that_do_not_fit_are_refused(
    model: InterpolativePHMM, tmp_path: Path, name: str, value: np.ndarray, message: str
) -> None:
    file = tmp_path / "wave.npz"
    model.save(file)
    with np.load(file, allow_pickle=False) as stored:
        content = {key: stored[key] for key in stored.files}
    np.savez(file, **{**content, name: value})
    with pytest.raises(ModelFileError, match=message):
        ParametricHMM.load(file)


def test_something_else_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "model.npz"
    file.write_bytes(b"not a model")
    with pytest.raises(ModelFileError, match="expected a model file"):
        ParametricHMM.load(file)


def test_missing_grid_points_are_named() -> None:
    rng = np.random.default_rng(0)
    theta = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 0.0]])
    with pytest.raises(ValueError, match=r"no training sequences at 1 of 4 points of the grid: \[\[1.0, 1.0\]\]"):
        InterpolativePHMM(20, 2, 4).fit([movement(one, rng) for one in theta], theta)


def test_directions_form_no_grid_and_the_message_says_what_does() -> None:
    rng = np.random.default_rng(0)
    angles = rng.uniform(-0.4, 0.4, (20, 2))
    theta = np.column_stack([np.cos(angles[:, 0]), np.sin(angles[:, 0]), np.sin(angles[:, 1])])
    with pytest.raises(ValueError, match=r"20 x 20 x 20 points .* the 20 sequences; .*QuadraticPHMM"):
        InterpolativePHMM(20, 2, 4).fit([movement(one, rng) for one in angles], theta)


def test_labels_off_a_given_grid_are_named() -> None:
    rng = np.random.default_rng(0)
    theta = np.array([[0.0], [1.0], [0.6]])
    model = InterpolativePHMM(20, 2, 4, corners=((0.0,), (1.0,)), shape=(2,))
    with pytest.raises(ValueError, match=r"sequence 2 has theta \[0.6\], its nearest point is \[1.0\]"):
        model.fit([movement(np.array([one[0], 0.1]), rng) for one in theta], theta)


def test_impossible_length_and_wrong_theta_are_refused(model: InterpolativePHMM) -> None:
    with pytest.raises(SequenceLengthError, match="allowed are 40 to 80 frames"):
        model.estimate(np.zeros((100, 4)))
    with pytest.raises(ValueError, match="theta has 2 finite components"):
        model.at([0.1, 0.2, 0.3])
    with pytest.raises(RuntimeError, match="not trained yet"):
        InterpolativePHMM().at([0.0])


def test_behaves_as_a_scikit_learn_estimator(model: InterpolativePHMM) -> None:
    copy = clone(model.set_params(local_iterations=4))
    assert copy.get_params()["n_states"] == 20
    assert not hasattr(copy, "means_")
    with pytest.raises(ValueError, match="found 'n_stats'"):
        copy.set_params(n_stats=3)


def test_resampled_frames_make_any_length_fit() -> None:
    rng = np.random.default_rng(3)
    theta = np.repeat([[-0.4, 0.2], [0.4, 0.2], [-0.4, 0.3], [0.4, 0.3]], 3, axis=0)
    shown = [movement(one, rng, int(rng.integers(90, 140))) for one in theta]
    model = InterpolativePHMM(20, 2, 4, resampled_frames=60, options=TrainingOptions(max_iterations=10))
    assert np.isfinite(model.fit(shown, theta).log_likelihood(shown[0], theta[0]))
    assert len(model.synthesize([0.0, 0.25], duration=2.0)) == 121
    assert len(model.synthesize([0.0, 0.25], 200, timing="expected")) == 200
