"""Models for tracking, from demonstrations (thesis 6.4.1 with the settings of 4.1.2)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from paramove.action_space.vocabulary import POSE_SIZES, ActionModel, table_target
from paramove.demonstrations import (
    FRAME,
    POINT_NAMES,
    SAMPLE_RATE_HZ,
    Action,
    Demonstrations,
    demonstrations_at,
    table_targets,
)
from paramove.documents import Floats, InputError
from paramove.hmm import TrainingOptions
from paramove.observation import BENT_POSE_POINTS
from paramove.phmm import MovementDescription, PolynomialPHMM, QuadraticPHMM, cached_model

STATES = 80
TRACKED_POINTS = ("shoulder", "elbow", "index")
"""Of the demonstrated body points; the tip of the index finger is the end of the hand."""


def arm_poses(sequence: ArrayLike, point_names: Sequence[str] = POINT_NAMES) -> Floats:
    """Poses (T, 9) of body points (T, 3 n); poses (T, 9) or (T, 12) stay. Raises InputError for missing points."""
    points = np.asarray(sequence, dtype=np.float64)
    if points.ndim == 2 and points.shape[1] in POSE_SIZES:
        return points
    missing = [name for name in TRACKED_POINTS if name not in point_names]
    if missing or points.ndim != 2 or points.shape[1] != 3 * len(point_names):
        raise InputError(
            f"expected poses (T, {POSE_SIZES[0]}) or body points (T, {3 * len(point_names)}) with "
            f"{', '.join(TRACKED_POINTS)}, found shape {points.shape} of {', '.join(point_names)}"
        )
    chosen = [point_names.index(name) for name in TRACKED_POINTS]
    return np.ascontiguousarray(points.reshape(len(points), -1, 3)[:, chosen].reshape(len(points), POSE_SIZES[0]))


def train_action(
    demonstrated: Demonstrations, *, n_states: int = STATES, kind: type[PolynomialPHMM] = QuadraticPHMM
) -> PolynomialPHMM:
    """A polynomial PHMM of arm poses, its states 2 or 3 frames long after resampling, its theta that of `demonstrated`.

    The residuals are "independent": a tracker needs how a frame deviates from its state, not how to estimate theta
    from whole movements.
    """
    sequences = [
        arm_poses(sequence, demonstrated.description.point_names or POINT_NAMES) for sequence in demonstrated.sequences
    ]
    model = kind(n_states, 2, 3, resampled_frames=round(2.5 * n_states), residuals="independent")
    model.options = TrainingOptions(floor_deviation=0.002)
    model.description = replace(demonstrated.description, point_names=BENT_POSE_POINTS[: sequences[0].shape[1] // 3])
    return model.fit(sequences, demonstrated.theta)


def cached_action(
    name: str, source: str, show: Callable[[], Demonstrations], *, n_states: int = STATES,
    kind: type[PolynomialPHMM] = QuadraticPHMM, folder: Path | None = None,
    target: Callable[[Floats], Floats] = table_target,
) -> ActionModel:  # fmt: skip
    """The action of a model that is trained once and stored in a folder, by default the user's cache.

    Args:
        name: of the action. source: where the demonstrations come from; each source has its own file.
        show: makes the demonstrations; called only if there is no model of that source.
        target: see `ActionModel`.
    """

    def train() -> PolynomialPHMM:
        model = train_action(show(), n_states=n_states, kind=kind)
        assert model.description is not None
        model.description = replace(model.description, action=name)
        return model

    settings = f"{source}, {kind.__name__}, {n_states} states"
    function = show.func if isinstance(show, partial) else show
    model = cached_model(PolynomialPHMM, name, settings, train, folder, [function.__module__])
    return ActionModel.from_file_model(model, target)


def table_action_demonstrations(
    action: Action, *, columns: int = 5, rows: int = 3, repetitions: int = 4
) -> Demonstrations:
    """The synthetic demonstrator reaches for or points at a grid on the table, labelled with (u, v)."""
    targets, places = table_targets(columns, rows)
    demonstrated = demonstrations_at(targets, np.random.default_rng(0), action=action, repetitions=repetitions)
    duration = float(np.mean([len(sequence) - 1 for sequence in demonstrated.sequences]) / SAMPLE_RATE_HZ)
    description = MovementDescription(action, POINT_NAMES, "m", FRAME, ("u", "v"), duration, rate_hz=SAMPLE_RATE_HZ)
    return Demonstrations(demonstrated.sequences, np.repeat(places, repetitions, axis=0), description)


def table_action(action: Action) -> ActionModel:
    """Pointing or reaching on the table, trained with the synthetic demonstrator and stored in the user's cache."""
    source = "synthetic demonstrator, seed 0, 5 x 3 places, 4 repetitions"
    return cached_action(action, source, lambda: table_action_demonstrations(action))
