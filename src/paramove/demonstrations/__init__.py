"""Demonstrations of movements: the synthetic demonstrator and training sets made with it."""

from paramove.demonstrations.arm import POINT_NAMES, ArmLengths
from paramove.demonstrations.blending import (
    BlendTiming,
    blended,
    corner_pairs,
    nine_pairs,
    redirect_demonstrations,
    redirect_from_model,
    train_pointing_model,
)
from paramove.demonstrations.demonstration_set import DemonstrationSet, Sequences
from paramove.demonstrations.movement import DemonstrationError, Movement
from paramove.demonstrations.reaching import (
    Demonstrations,
    demonstrations_at,
    grasp_states,
    reaching_cuboid,
    reaching_grid_demonstrations,
    table_place,
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
    "BlendTiming",
    "DemonstrationError",
    "DemonstrationSet",
    "Demonstrations",
    "Demonstrator",
    "Movement",
    "Sequences",
    "Timing",
    "Variation",
    "blended",
    "corner_pairs",
    "demonstrations_at",
    "grasp_states",
    "nine_pairs",
    "reaching_cuboid",
    "reaching_grid_demonstrations",
    "redirect_demonstrations",
    "redirect_from_model",
    "table_place",
    "table_targets",
    "train_pointing_model",
    "train_reaching_model",
]
