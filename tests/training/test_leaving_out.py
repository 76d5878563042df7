"""What is left out together, what is inside the trained thetas, and how errors are told."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paramove.demonstrations import DemonstrationError, DemonstrationSet
from paramove.phmm import InterpolativePHMM, LinearPHMM
from paramove.training.examples import examples_of
from paramove.training.leaving_out import _folds, covers, is_outside, leave_out
from tests.demonstrations.movements import a_set, movement


@pytest.fixture
def examples():
    return examples_of(a_set(subjects=("P1", "P2", "P3"), repetitions=2))


def shaken(examples):
    """The same with trembling: exact copies are refused by training."""
    rng = np.random.default_rng(0)
    return replace(examples, sequences=[x + rng.normal(0.0, 0.003, x.shape) for x in examples.sequences])


@pytest.mark.parametrize(("by", "count"), [("theta", 3), ("subject", 3), ("repetition", 6)])
def test_every_movement_is_left_out_once(examples, by, count):
    folds = _folds(examples, by)
    assert len(folds) == count
    assert sorted(number for fold in folds for number in fold) == list(range(len(examples)))
    for fold in folds:
        thetas = {tuple(examples.theta[number]) for number in fold}
        subjects = {examples.subjects[number] for number in fold}
        assert len({"theta": thetas, "subject": subjects, "repetition": [1]}[by]) == 1


def test_many_groups_share_folds(examples):
    many = a_set(subjects=tuple(f"P{number}" for number in range(13)), repetitions=1)
    folds = _folds(examples_of(many), "subject")
    assert len(folds) == 10
    assert sorted(map(len, folds)) == [3] * 7 + [6] * 3


def test_models_see_movements_of_others_only():
    three = a_set(subjects=("P1", "P2", "P3"))
    examples = shaken(examples_of(three, parameters=["target_x", "target_y"]))
    asked = []
    result = leave_out(
        examples, lambda: LinearPHMM(5, 3, 7, resampled_frames=25), "subject", lambda *counts: asked.append(counts)
    )
    assert asked == [(1, 3), (2, 3), (3, 3)]
    assert [one.number for one in result.movements] == list(range(len(examples)))
    told = result.summary()
    assert told["outside_the_training"] == 0
    assert told["theta_p95_m"] < 0.15
    assert told["synthesis_p95_m"] < 0.05


def test_interpolation_needs_every_theta():
    corners = [(x, y, -0.1) for x in (0.3, 0.4) for y in (-0.1, 0.1)]
    shown = DemonstrationSet(tuple(movement(place, repetition=number) for place in corners for number in range(2)))
    examples = examples_of(shown)
    assert examples.parameter_names == ("target_x", "target_y")
    model = InterpolativePHMM(5, 3, 7, resampled_frames=25)
    result = leave_out(shaken(examples), lambda: model, "theta")
    assert (result.by, result.folds) == ("repetition", 2)


def test_the_edge_of_a_grid_is_inside_but_not_beyond_it():
    grid = np.array([[x, y] for x in (0.0, 1.0, 2.0) for y in (0.0, 1.0, 2.0)])
    corner = np.array([0.0, 0.0])
    rest = grid[1:]
    assert is_outside(corner, rest)
    assert not is_outside(np.array([1.0, 1.0]), rest)
    assert not is_outside(np.array([1.0, 0.0]), rest)
    assert is_outside(np.array([1.0, -0.1]), grid)
    line = np.array([[0.0, 0.0], [1.0, 1.0]])  # no area: only bounds count
    assert not is_outside(np.array([0.5, 0.5]), line)
    assert is_outside(np.array([2.5]), grid[:, :1])


@settings(deadline=None, max_examples=30, derandomize=True)
@given(st.integers(0, 1000))
def test_regions_hold_what_they_promise(seed):
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((2, 2)) + 2.0 * np.eye(2)
    drawn = rng.standard_normal((400, 2)) @ root.T
    share = np.mean([covers(np.zeros(2), root @ root.T, one) for one in drawn])
    assert 0.90 < share < 0.99


def test_parameters_that_hardly_vary_are_left_out_and_told():
    thetas = [(0.3, -0.1, -0.1), (0.5, 0.2, -0.101), (0.4, 0.0, -0.099)]
    shown = DemonstrationSet(tuple(movement(theta) for theta in thetas))
    found = examples_of(shown)
    assert found.parameter_names == ("target_x", "target_y")
    assert "target_z varies by only 0.002 m" in found.remarks[0]
    assert examples_of(shown, parameters=["target_z"]).theta.shape == (3, 1)
    with pytest.raises(DemonstrationError, match="the same parameters"):
        examples_of(DemonstrationSet(tuple(movement(thetas[0]) for _ in range(3))))


def test_persons_are_groups_where_there_are_several(examples):
    assert examples.groups == examples.subjects
    assert examples_of(a_set(subjects=("P1", "P2"))).groups is None
    assert examples.description("reaching").rate_hz == 50.0


def test_two_thetas_are_too_few_to_leave_one_out():
    thetas = [(0.3, -0.1, -0.1), (0.5, 0.2, -0.1)]
    shown = DemonstrationSet(tuple(movement(theta) for theta in thetas))
    with pytest.raises(ValueError, match=r"without one theta all others have the theta .*--leave-out none"):
        leave_out(shaken(examples_of(shown)), lambda: LinearPHMM(5, 3, 7, resampled_frames=25))
