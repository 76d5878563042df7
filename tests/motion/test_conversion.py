"""A person's movement on the robot's arm: the place that is reached stays the place that was asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from paramove.motion.conversion import RobotMovement
from paramove.motion.reaching_movement import ArmPoses
from paramove.phmm import InterpolativePHMM, MovementDescription
from tests.motion.reaching import movement, reaching_model, solver


def described(**changes: object) -> InterpolativePHMM:
    """The trained model with another description."""
    model = reaching_model()
    other = InterpolativePHMM(model.n_states)
    other.__dict__.update(model.__dict__)
    other.description = replace(model.description or MovementDescription(), **changes)
    return other


def points_of(model: InterpolativePHMM, name: str) -> np.ndarray:
    """Means of one point of the body, [G, N, 3], m."""
    assert model.description is not None
    place = model.description.point_names.index(name)
    return np.asarray(model.means_.reshape(*model.means_.shape[:2], -1, 3)[:, :, place])


@pytest.mark.parametrize("state_of", ["reach_state", "release_state"])
def test_the_gripper_is_at_the_target_when_the_movement_says_so(state_of: str) -> None:
    """The effect is preserved also for targets between and outside the demonstrated ones."""
    converted = movement()
    state = getattr(converted, state_of)
    targets = np.random.default_rng(0).uniform([0.12, -0.12, -0.12], [0.20, 0.09, -0.03], (50, 3))
    parameters = converted.parameter_for(state, targets)
    reached = converted.poses_of_state(state, parameters).gripper
    np.testing.assert_allclose(reached, targets, rtol=0, atol=1e-6)
    whole = converted.poses(parameters[7])
    np.testing.assert_allclose(whole.gripper[state], targets[7], rtol=0, atol=1e-6)
    assert len(whole) == converted.means.shape[1]


def test_the_demonstrations_nearly_meet_their_targets_already() -> None:
    """What `parameter_for` corrects is small: parameters are places, scaled with the arm."""
    converted = movement()
    corners = converted.grid.points()
    corrected = converted.parameter_for(converted.reach_state, corners)
    assert np.linalg.norm(corrected - corners, axis=1).max() < 0.02


def test_everything_is_scaled_by_the_length_of_the_arm() -> None:
    converted, model = movement(), reaching_model()
    shoulder = points_of(model, "shoulder").mean(axis=(0, 1))
    elbow = points_of(model, "elbow") - shoulder
    gripper = sum(points_of(model, name) for name in ("knuckle", "index", "thumb")) / 3 - shoulder
    person = (np.linalg.norm(elbow, axis=-1) + np.linalg.norm(gripper - elbow, axis=-1)).max()
    np.testing.assert_allclose(converted.scale, solver().length / person, rtol=1e-12)
    np.testing.assert_allclose(converted.means[..., :3], converted.scale * elbow, rtol=0, atol=1e-12)
    np.testing.assert_allclose(converted.means[..., 3:6], converted.scale * gripper, rtol=0, atol=1e-12)
    np.testing.assert_allclose(
        converted.grid.points(), converted.scale * (model.grid_.points() - shoulder), rtol=0, atol=1e-12
    )
    lengths = np.linalg.norm(converted.means[..., :3], axis=-1)
    lengths += np.linalg.norm(converted.means[..., 3:6] - converted.means[..., :3], axis=-1)
    assert lengths.max() <= solver().length + 1e-12


def test_a_longer_arm_makes_the_same_movement_larger() -> None:
    double = RobotMovement(reaching_model(), 2 * solver().length)
    np.testing.assert_allclose(double.means, 2 * movement().means, rtol=1e-12, atol=0)
    assert double.reach_state == movement().reach_state


def test_states_of_arrival_and_grasp_are_about_those_of_the_thesis() -> None:
    """States 37 and 45 of 80, counted from 1."""
    assert movement().means.shape[1] == 80
    assert abs(movement().reach_state + 1 - 37) <= 3
    assert abs(movement().release_state + 1 - 45) <= 3
    assert movement().reach_state < movement().release_state


def test_elbows_between_the_demonstrated_ones_belong_to_an_arm() -> None:
    """With elbows interpolated as points the upper arm shrinks in between."""
    converted, as_points = movement(), RobotMovement(reaching_model(), solver().length, "linear")
    corners = converted.grid.points()
    np.testing.assert_allclose(
        converted.poses(corners[5]).stacked(), as_points.poses(corners[5]).stacked(), rtol=0, atol=1e-9
    )
    centre = corners.mean(axis=0)
    state = converted.reach_state
    demonstrated = np.linalg.norm(converted.means[:, state, :3], axis=1)
    length = np.linalg.norm(converted.poses(centre).elbow[state])
    assert demonstrated.min() <= length <= demonstrated.max()
    assert np.linalg.norm(as_points.poses(centre).elbow[state]) < 0.95 * demonstrated.min()
    np.testing.assert_array_equal(converted.poses(centre).gripper, as_points.poses(centre).gripper)


def test_other_poses_of_the_person_are_converted_alike() -> None:
    converted, model = movement(), reaching_model()
    assert model.description is not None
    poses = converted.converted(model.means_[3], model.description.point_names)
    np.testing.assert_allclose(poses.stacked(), converted.means[3], rtol=0, atol=1e-12)


def with_fingers(finger_to_thumb: np.ndarray) -> ArmPoses:
    """Arm poses of which only the hand matters."""
    return ArmPoses(np.zeros_like(finger_to_thumb), np.zeros_like(finger_to_thumb), finger_to_thumb)


def test_opening_goes_from_one_to_nought() -> None:
    converted = movement()
    sizes = np.linspace(0.5 * converted.o_min, 1.5 * converted.o_max, 40)
    opening = converted.openings(with_fingers(sizes[:, None] * [0.6, 0.0, 0.8]))
    assert (np.diff(opening) >= 0).all()
    np.testing.assert_allclose(opening[[0, -1]], [0.0, 1.0], rtol=0, atol=0)
    middle = converted.openings(with_fingers(np.array([[0.5 * (converted.o_min + converted.o_max), 0.0, 0.0]])))
    np.testing.assert_allclose(middle, 0.5, rtol=0, atol=1e-12)
    between = converted.poses(converted.grid.points().mean(axis=0))
    course = converted.openings(between)
    grasping = course[converted.reach_state : converted.release_state + 1]
    assert grasping[0] == grasping.max()
    assert grasping[0] - grasping.min() > 0.5


def test_poses_stack_join_and_slice() -> None:
    poses = movement().poses(movement().grid.points()[0])
    np.testing.assert_array_equal(ArmPoses.from_stacked(poses.stacked()).gripper, poses.gripper)
    parts = np.concatenate([poses[:30].stacked(), poses[30:].stacked()])
    np.testing.assert_array_equal(parts, poses.stacked())


@pytest.mark.parametrize("lost", ["elbow", "thumb", "shoulder"])
def test_a_model_without_a_needed_point_is_refused_by_name(lost: str) -> None:
    description = reaching_model().description
    assert description is not None
    names = tuple("other" if name == lost else name for name in description.point_names)
    with pytest.raises(ValueError, match=f"needed also: {lost}"):
        RobotMovement(described(point_names=names), 0.243)


def test_a_model_without_a_description_is_refused() -> None:
    model = described()
    model.description = None
    with pytest.raises(ValueError, match="the model has the points none; needed also: shoulder, elbow"):
        RobotMovement(model, 0.243)


@pytest.mark.parametrize(("arrival", "grasp"), [(0.0, 0.0), (0.6, 0.5), (0.4, 1.0)])
def test_a_model_that_does_not_say_when_the_target_is_reached_is_refused(arrival: float, grasp: float) -> None:
    with pytest.raises(ValueError, match="a reaching action has 0 < arrival < grasp < 1"):
        RobotMovement(described(arrival=arrival, grasp=grasp), 0.243)
