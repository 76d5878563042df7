"""A reaching model from a file, checked for what a robot needs of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from paramove.demonstrations import BODY, FRAME
from paramove.motion.arm_pose import UnreachablePoseError
from paramove.motion.conversion import RobotMovement
from paramove.motion.modelled_movement import robot_movement
from paramove.motion.reaching_movement import ReachingMovement
from paramove.phmm import InterpolativePHMM, ModelFileError, MovementDescription, ParametricHMM
from paramove.robots import ARM_BASE

REMEDY = (
    "train it again: leave out the node's parameter movement.file to have a model trained from synthetic "
    "demonstrations, or write this file anew with `paramove train SET --out FILE`"
)
ARM_LENGTHS = (0.3, 1.2)
"""m; from shoulder to elbow to knuckles of a child to that of a tall person. Millimetres or degrees lie far outside."""
SERVO_ARM_LENGTHS = (0.15, 1.2)
"""m; the same of an arm that was led by hand."""
MAX_MISSED = 0.05
FAR_OFF = 1e3
"""Arm lengths; no movement has a target so far away."""
FINGER = 0.10
"""m; so far the middle of knuckle, index and thumb may stay behind what the index touches."""
FRAMES = (FRAME, BODY, ARM_BASE)


def load_reaching_model(path: Path) -> ParametricHMM:
    """The model in a file.

    Raises:
        ModelFileError: It is missing, damaged, of another format, or no model of reaching; with the remedy.
    """
    try:
        model = ParametricHMM.load(path)
        check_reaching_model(model)
    except ModelFileError as error:
        raise ModelFileError(f"{error}. Remedy: {REMEDY}", missing=error.missing) from error
    except (ArithmeticError, ValueError) as error:
        raise ModelFileError(f"{path}: {error}. Remedy: {REMEDY}") from error
    return model


def check_reaching_model(model: ParametricHMM) -> None:
    """Raises ValueError unless the model describes a person's arm, in m, that reaches the targets of its parameters."""
    description = model.description or MovementDescription()
    if description.unit != "m":
        raise ValueError(f"expected points in m, found {description.unit!r}")
    if description.frame not in FRAMES:
        raise ValueError(
            f"expected points in the frame {' or '.join(map(repr, FRAMES))} (x forward, y left, z up), "
            f"found {description.frame!r}"
        )
    _check_sizes(model, description)
    movement = robot_movement(model, 1.0)  # checks the points and the times of arrival and grasp
    arm_length = 1.0 / movement.scale
    shortest, longest = SERVO_ARM_LENGTHS if description.frame == ARM_BASE else ARM_LENGTHS
    if not shortest <= arm_length <= longest:
        raise ValueError(f"expected an arm of {shortest} to {longest} m, found {arm_length:.3g} m")
    if isinstance(movement, RobotMovement) and not movement.o_max > movement.o_min:
        raise ValueError("expected a hand that opens and closes, found a constant distance of finger and thumb")
    missed = _missed(movement) * arm_length
    if not missed <= MAX_MISSED:
        raise ValueError(f"expected a movement that reaches its targets, found {missed:.3g} m from the middle one")


def _check_sizes(model: ParametricHMM, description: MovementDescription) -> None:
    bounds = model.parameter_bounds_
    dimension = 0 if bounds is None else bounds.shape[1]
    if dimension != 3:
        targets = "a grid of targets" if isinstance(model, InterpolativePHMM) else "targets"
        raise ValueError(f"expected {targets} with 3 coordinates, found {dimension}")
    expected = 3 * len(description.point_names)
    dimensions = model.state_means(np.zeros(3) if bounds is None else bounds.mean(axis=0)).shape[-1]
    if dimensions != expected:
        raise ValueError(
            f"expected {expected} numbers a frame for {len(description.point_names)} points, found {dimensions}"
        )


def _missed(movement: ReachingMovement) -> float:
    """How far from the middle target the hand arrives, in arm lengths."""
    state, centre = movement.reach_state, movement.centre
    try:
        if not isinstance(movement, RobotMovement):  # a fingertip touches: the hand stays behind it
            reached = movement.poses_of_state(state, centre).gripper
            movement.parameter_for(state, reached + 0.01)
            return max(0.0, float(np.linalg.norm(reached[0] - centre)) - FINGER * movement.scale)
        parameter = movement.parameter_for(state, centre)
        if not np.abs(parameter).max() <= FAR_OFF:  # rounding has made a singular system solvable
            raise np.linalg.LinAlgError("no target has an effect")
    except (np.linalg.LinAlgError, UnreachablePoseError) as error:
        raise ValueError("expected a movement that reaches different targets, found one for all") from error
    return float(np.linalg.norm(movement.poses_of_state(state, parameter).gripper[0] - centre))
