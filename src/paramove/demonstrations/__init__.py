"""Demonstrations of movements: the synthetic demonstrator and training sets made with it."""

from paramove.demonstrations.arm import POINT_NAMES, ArmLengths
from paramove.demonstrations.reaching import (
    Demonstrations,
    demonstrations_at,
    grasp_states,
    reaching_cuboid,
    reaching_grid_demonstrations,
    table_targets,
    train_reaching_model,
)
from paramove.demonstrations.synthetic import FRAME, RESTING_SHOULDER, SAMPLE_RATE_HZ, Demonstrator, Timing, Variation

__all__ = [
    "FRAME",
    "POINT_NAMES",
    "RESTING_SHOULDER",
    "SAMPLE_RATE_HZ",
    "ArmLengths",
    "Demonstrations",
    "Demonstrator",
    "Timing",
    "Variation",
    "demonstrations_at",
    "grasp_states",
    "reaching_cuboid",
    "reaching_grid_demonstrations",
    "table_targets",
    "train_reaching_model",
]
