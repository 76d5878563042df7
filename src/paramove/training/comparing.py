"""Comparison of models: distances between their movements, and which explains a set better."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from paramove.demonstrations import DemonstrationError, DemonstrationSet
from paramove.documents import InputError
from paramove.phmm import MovementClassifier, ParametricHMM
from paramove.training.drawing import bounds, dimension, grid, parameter_names, point_names
from paramove.training.examining import Examiner
from paramove.training.leaving_out import covers, synthesis_error

FRAMES = 100


def distance_between(first: ParametricHMM, second: ParametricHMM) -> dict[str, float]:
    """Distances between the movements of two models, over a grid of the theta that both were trained for.

    Root mean square over body points, frames and theta, and the largest distance of a body point, m.

    Raises InputError if their points or parameters differ, or they have no theta in common.
    """
    if point_names(first) != point_names(second) or parameter_names(first) != parameter_names(second):
        raise InputError(
            "the models differ in points or parameters and cannot be compared: "
            f"{', '.join(point_names(first))} ({', '.join(parameter_names(first))}) and "
            f"{', '.join(point_names(second))} ({', '.join(parameter_names(second))})"
        )
    shared = np.stack([
        np.maximum(bounds(first)[0], bounds(second)[0]), np.minimum(bounds(first)[1], bounds(second)[1])
    ])  # fmt: skip
    if (shared[0] > shared[1]).any():
        raise InputError("the models were trained for different parameters: their bounds do not overlap")
    distances = []
    for theta in grid(shared):
        difference = first.synthesize(theta, FRAMES) - second.synthesize(theta, FRAMES)
        distances.append(np.linalg.norm(difference.reshape(FRAMES, -1, 3), axis=2))
    values = np.array(distances)
    return {"rms_m": float(np.sqrt((values**2).mean())), "greatest_m": float(values.max())}


def on_set(model: ParametricHMM, demonstrations: DemonstrationSet) -> dict[str, Any]:
    """How well a model explains the movements of its action in a set.

    Raises DemonstrationError if the set has no movement of the action, or other parameters.
    """
    action = model.description.action if model.description else demonstrations.actions[0]
    examiner = Examiner(MovementClassifier.from_models({action: model}))
    names = parameter_names(model)
    errors, inside, likelihoods, synthesis = [], [], [], []
    for movement in demonstrations.select(action):
        recognition = examiner.examine(movement)
        if recognition.labelled is None:
            raise DemonstrationError(
                f"{movement.source}: the model has the parameters {', '.join(names)}, the set has "
                f"{', '.join(demonstrations.parameter_names) or 'none'}"
            )
        frames = recognition.movement.frames
        errors.append(recognition.estimate.theta - recognition.labelled)
        inside.append(covers(recognition.estimate.theta, recognition.estimate.covariance, recognition.labelled))
        count = model.resampled_frames_ or len(frames)
        likelihoods.append(model.log_likelihood(frames, recognition.labelled) / count)
        synthesis.append(synthesis_error(model, recognition.labelled, frames, dimension(model) // 3))
    rms = np.sqrt((np.array(errors) ** 2).mean(axis=0))
    return {
        "movements": len(errors),
        "log_likelihood_per_frame": float(np.mean(likelihoods)),
        "theta_rms": dict(zip(names, rms.tolist(), strict=True)),
        "theta_covered": float(np.mean(inside)),
        "synthesis_median_m": float(np.median(synthesis)),
    }


def table_of_distances(models: Sequence[ParametricHMM]) -> list[list[dict[str, float]]]:
    """Distances of every model from every other. Raises InputError as `distance_between` does."""
    return [[distance_between(one, other) for other in models] for one in models]
