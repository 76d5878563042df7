"""A reaching model from a file, checked for what a robot needs of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from paramove.demonstrations.synthetic import FRAME
from paramove.imitation.conversion import RobotMovement
from paramove.phmm import InterpolativePHMM, ModelFileError, MovementDescription

REMEDY = (
    "train it again: leave out synthesizer.movement.file to have a model trained from synthetic demonstrations, or "
    "write this file anew with the model's save()"
)
ARM_LENGTHS = (0.3, 1.2)
"""m; from shoulder to elbow to knuckles of a child to that of a tall person. Millimetres or degrees lie far outside."""
MOST_MISSED = 0.05


def load_reaching_model(path: Path) -> InterpolativePHMM:
    """The model in a file.

    Raises:
        ModelFileError: It is missing, damaged, of another format, or no model of reaching; with the remedy.
    """
    try:
        model = InterpolativePHMM.load(path)
        check_reaching_model(model)
    except ModelFileError as error:
        raise ModelFileError(f"{error}. Remedy: {REMEDY}", missing=error.missing) from error
    except (ArithmeticError, ValueError) as error:
        raise ModelFileError(f"{path}: {error}. Remedy: {REMEDY}") from error
    return model


def check_reaching_model(model: InterpolativePHMM) -> None:
    """Raises ValueError unless the model tells of a person's arm, in m, that reaches the targets of its grid."""
    description = model.description or MovementDescription()
    if description.unit != "m":
        raise ValueError(f"expected points in m, found {description.unit!r}")
    if description.frame != FRAME:
        raise ValueError(
            f"expected points in the frame {FRAME!r} (x forward, y left, z up), found {description.frame!r}"
        )
    if model.grid_.dimension != 3:
        raise ValueError(f"expected a grid of targets with 3 coordinates, found {model.grid_.dimension}")
    expected = 3 * len(description.point_names)
    if model.means_.shape[-1] != expected:
        raise ValueError(
            f"expected {expected} numbers a frame for {len(description.point_names)} points, "
            f"found {model.means_.shape[-1]}"
        )
    movement = RobotMovement.from_model(model, 1.0)  # checks the points and the moments of arrival and grasp
    arm_length = 1.0 / movement.scale
    if not ARM_LENGTHS[0] <= arm_length <= ARM_LENGTHS[1]:
        raise ValueError(f"expected an arm of {ARM_LENGTHS[0]} to {ARM_LENGTHS[1]} m, found {arm_length:.3g} m")
    if not movement.o_max > movement.o_min:
        raise ValueError("expected a hand that opens and closes, found a constant distance of finger and thumb")
    centre = movement.grid.points().mean(axis=0)
    try:
        parameter = movement.parameter_for(movement.reach_state, centre)
    except np.linalg.LinAlgError as error:
        raise ValueError("expected a movement that reaches different targets, found one for all") from error
    reached = movement.poses_of_state(movement.reach_state, parameter).gripper[0]
    missed = float(np.linalg.norm(reached - centre)) * arm_length
    if not missed <= MOST_MISSED:
        raise ValueError(f"expected a movement that reaches its targets, found {missed:.3g} m beside the middle one")
