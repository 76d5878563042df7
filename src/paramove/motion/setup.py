"""A planner put together from a robot's folder, a movement and a working surface."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Literal, Self

from platformdirs import user_cache_path
from pydantic import BaseModel, ConfigDict, model_validator

from paramove.demonstrations import train_reaching_model
from paramove.motion.arm_pose import ArmPoseSolver
from paramove.motion.clear_plans import ClearPlans
from paramove.motion.clearance import ClearanceChecker
from paramove.motion.gripper_arm import GripperArm
from paramove.motion.modelled_movement import robot_movement
from paramove.motion.plans import MotionPlans
from paramove.motion.reaching_file import load_reaching_model
from paramove.motion.recorded_reaching import people_model
from paramove.motion.relocation import RelocationPlanner
from paramove.motion.servo_arm_reaching import ServoArmReaching
from paramove.phmm import ParametricHMM
from paramove.robots import RobotDescription, SurfaceParameters

_log = logging.getLogger(__name__)


class MovementSource(BaseModel):
    """Source of the reaching movement: a `file`, or a `model` that is trained on first use.

    `synthetic`: demonstrations of the synthetic demonstrator with that `seed`. `table_reach`: recorded people that
    reach for positions on a table.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    file: Path | None = None
    model: Literal["synthetic", "table_reach"] = "synthetic"
    seed: int = 0

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if self.file is not None and "model" in self.model_fields_set:
            raise ValueError(f"give either a file or a model, found file {self.file} and model {self.model!r}")
        return self

    def trained(self) -> ParametricHMM:
        """The model, cached in the user's folder once trained. Raises ModelFileError for a bad `file`."""
        if self.file is not None:
            return load_reaching_model(self.file)
        folder = _cache_folder()
        if self.model == "table_reach":
            return people_model(self.model, folder)
        return train_reaching_model(self.seed, cache=None if folder is None else folder / f"reaching_{self.seed}.npz")


def _cache_folder() -> Path | None:
    """The user's folder for trained models; None if it cannot be created."""
    folder = user_cache_path("paramove")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        _log.warning("training the movement; the model cannot be stored in %s: %s", folder, error.strerror)
        return None
    return folder


def plans_for(robot_folder: Path, side: str, movement: MovementSource, surface: SurfaceParameters) -> MotionPlans:
    """The planner of the robot's movements, from files: of its servo arm, or of its arm on this side."""
    robot = RobotDescription.load(robot_folder)
    working_surface = surface.of(robot, side)
    if robot.chain is not None:
        return ServoArmReaching(robot, movement.trained(), working_surface)
    arm = robot.arm(side)
    solver = ArmPoseSolver(robot, arm)
    planner = RelocationPlanner(robot_movement(movement.trained(), solver.length), solver, robot, arm)
    gripper_arm = GripperArm.of(robot, side)
    return ClearPlans(gripper_arm, planner, ClearanceChecker(robot, gripper_arm, working_surface))
