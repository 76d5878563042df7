"""Any parametric HMM over the place that is reached, on the robot's arm."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from paramove.motion.arm_pose import UnreachablePoseError
from paramove.motion.conversion import RobotMovement
from paramove.motion.modelled_movement import ModelledMovement, robot_movement
from paramove.motion.reaching_movement import ReachingMovement
from paramove.motion.relocation import RelocationPlanner
from paramove.phmm import MovementDescription, ParametricHMM, PolynomialPHMM
from paramove.robots import DescriptionError
from tests.motion.reaching import HOAP3, reaching_model, solver
from tests.motion.touching import DESCRIPTION, FAR, NEAR, touching, touching_model


def changed(model: ParametricHMM, **values: Any) -> Any:
    """A copy of a trained model with other attributes."""
    other = type(model)(model.n_states)
    other.__dict__.update({**model.__dict__, **values})
    return other


def places(movement: ReachingMovement, beyond: float) -> np.ndarray:
    """Places of the gripper for targets up to `beyond` of the box's half width from its middle, [40, 3], m."""
    assert isinstance(movement, ModelledMovement)
    half = 0.5 * (FAR - NEAR) * movement.scale
    offsets = np.random.default_rng(1).uniform(-beyond, beyond, (40, 3)) * half
    return movement.poses_of_state(movement.reach_state, movement.centre + offsets).gripper


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("beyond", [1.0, 1.6])
def test_the_gripper_arrives_where_it_is_wanted(degree: int, beyond: float) -> None:
    """Between the demonstrated targets and outside them; a finger touched, so the hand's place is not the target."""
    movement = touching(degree)
    wanted = places(movement, beyond)
    parameters = movement.parameter_for(movement.reach_state, wanted)
    assert np.linalg.norm(parameters - wanted, axis=1).min() > 0.005
    reached = movement.poses_of_state(movement.reach_state, parameters).gripper
    np.testing.assert_allclose(reached, wanted, rtol=0, atol=1e-6)
    poses, opening = movement.approach(wanted[3])
    np.testing.assert_allclose(poses.gripper[-1], wanted[3], rtol=0, atol=1e-6)
    assert len(poses) == len(opening) == touching_model(degree).n_states


def test_the_way_back_is_the_way_there_reversed() -> None:
    movement = touching()
    wanted = places(movement, 1.0)[0]
    there, opening = movement.approach(wanted)
    back, closing = movement.retreat(wanted)
    np.testing.assert_array_equal(back.stacked(), there.stacked()[::-1])
    np.testing.assert_array_equal(closing, opening[::-1])
    assert movement.begins_above_table


def test_the_hand_opens_on_the_way_since_touching_hands_do_not() -> None:
    _, opening = touching().approach(places(touching(), 1.0)[0])
    assert (np.diff(opening) >= 0.0).all()
    assert opening[0] == 0.0
    assert opening[round(0.75 * len(opening)) :].min() == 1.0


def test_lengths_are_those_of_the_robots_arm() -> None:
    poses, _ = touching().approach(places(touching(), 0.5)[0])
    lengths = np.linalg.norm(poses.elbow, axis=1) + np.linalg.norm(poses.gripper - poses.elbow, axis=1)
    assert lengths.max() <= solver().length + 1e-9
    assert lengths.min() > 0.85 * solver().length


def test_places_within_and_outside_the_training() -> None:
    movement = touching()
    state = movement.reach_state
    half = 0.5 * (FAR - NEAR) * movement.scale
    for share, inside in ((0.98, True), (1.02, False)):
        corner = movement.poses_of_state(state, movement.centre + share * half).gripper[0]
        assert movement.within_training(corner) is inside
    assert movement.within_training([9.0, 0.0, 0.0]) is False


def test_a_file_of_an_earlier_release_does_not_know_its_training() -> None:
    movement = ModelledMovement(changed(touching_model(), training_theta_=None), solver().length)
    assert movement.within_training(movement.centre) is None


def test_nothing_lies_between_targets_of_one_plane() -> None:
    theta = np.array([[0.4, y, -0.2] for y in (-0.1, 0.0, 0.1)])
    movement = ModelledMovement(changed(touching_model(), training_theta_=theta), solver().length)
    assert movement.within_training(movement.poses_of_state(movement.reach_state, movement.centre).gripper[0]) is False


def test_what_no_parameter_brings_about_is_refused_in_a_sentence() -> None:
    model = touching_model()
    still = np.zeros_like(model.coefficients_)
    still[..., 0] = model.coefficients_[..., 0]
    movement = ModelledMovement(changed(model, coefficients_=still), solver().length)
    with pytest.raises(
        UnreachablePoseError, match=r"no movement of the model 'touching' brings the gripper to \(20.0, "
    ):
        movement.parameter_for(movement.reach_state, [[0.2, 0.0, -0.05]])


def test_where_a_quadratic_model_turns_back_is_refused() -> None:
    """The gripper's x has a maximum over the target's: what lies beyond it has no parameter."""
    model = touching_model(2)
    bent = model.coefficients_.copy()
    forward = [3 * point for point in (2, 3, 4)]
    square = int(np.flatnonzero((model.monomials_.exponents == [2, 0, 0]).all(axis=1))[0])
    bent[:, forward, square] -= 0.06
    movement = ModelledMovement(changed(model, coefficients_=bent), solver().length)
    with pytest.raises(UnreachablePoseError, match="cm away; its training reached no such position"):
        movement.parameter_for(movement.reach_state, [[0.5, 0.0, -0.08]])


def test_a_model_of_a_grid_is_interpolated_and_serves_as_any_model_too() -> None:
    assert isinstance(robot_movement(reaching_model(), solver().length), RobotMovement)
    movement, interpolated = (
        ModelledMovement(reaching_model(), solver().length),
        robot_movement(reaching_model(), 0.243),
    )
    assert (movement.reach_state, movement.release_state) == (interpolated.reach_state, interpolated.release_state)
    assert not movement.begins_above_table
    target = np.array([0.17, 0.02, -0.07])
    there, opening = movement.approach(target)
    np.testing.assert_allclose(there.gripper[-1], target, rtol=0, atol=1e-6)
    assert opening[-1] > 0.7  # means of differently directed hands are smaller hands
    back, _ = movement.retreat(target)
    np.testing.assert_allclose(back.gripper[0], target, rtol=0, atol=1e-6)


def test_a_model_that_names_no_arrival_ends_at_its_target() -> None:
    description = replace(DESCRIPTION, arrival=-1.0)
    movement = robot_movement(changed(touching_model(), description=description), solver().length)
    assert isinstance(movement, ModelledMovement)
    assert movement.reach_state == touching_model().n_states - 1


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"description": None}, "the model has the points none"),
        ({"description": replace(DESCRIPTION, arrival=0.7)}, "arrival 0.7 and grasp -1.0; a reaching action has"),
        ({"description": MovementDescription(point_names=("shoulder",) * 5)}, "needed also: elbow, knuckle"),
        ({"training_theta_": np.zeros((4, 2))}, "expected a model of 3 parameters, .* found 2"),
        ({"training_theta_": None, "parameter_bounds_": None}, "call fit first"),
    ],
)
def test_a_model_that_does_not_suit_is_refused(values: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        ModelledMovement(changed(touching_model(), **values), solver().length)


def test_the_training_is_kept_in_the_file(tmp_path: Any) -> None:
    touching_model().save(tmp_path / "touching.npz")
    loaded = PolynomialPHMM.load(tmp_path / "touching.npz")
    np.testing.assert_array_equal(loaded.training_theta_, touching_model().training_theta_)
    assert loaded.training_theta_ is not None
    assert len(loaded.training_theta_) == 18


def test_an_arm_of_which_nobody_knows_how_it_comes_above_a_table_is_named() -> None:
    left = HOAP3.arm("left")
    with pytest.raises(DescriptionError, match=r"left_shoulder_pitch.*above_table"):
        RelocationPlanner(touching(2), solver(), HOAP3, left)
