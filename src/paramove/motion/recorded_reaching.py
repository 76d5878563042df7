"""A reaching model from recorded people, for the robot's approach and retreat."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np

from paramove.demonstrations import BODY, RATE_HZ, Recordings, RecordingsError, data_folder, load_recordings
from paramove.phmm import ModelFileError, MovementDescription, PolynomialPHMM, stored_model
from paramove.source_code import code_digest

ACTIONS = ("reach_forward", "reach_across")
"""Of the recorded people, pooled."""
N_STATES = 40
REMEDY = (
    "put the data set next to the clone as ../shared/data/table_reach/data.npz or name its folder in PARAMOVE_DATA; or "
    "give a trained model by the node's parameter movement.file; or leave out its parameter movement to move as the "
    "synthetic demonstrator does"
)


def people_model(name: str, cache_folder: Path | None) -> PolynomialPHMM:
    """The linear model of the data set `name`, trained once and cached in `cache_folder`.

    The cached model is used if the present code trained it from the present recordings, or if there are none.

    Raises:
        ModelFileError: There are neither recordings nor a cached model, or the recordings do not suit; with the remedy.
    """
    cache = None if cache_folder is None else cache_folder / f"reaching_{name}.npz"
    cached, code = stored_model(PolynomialPHMM, cache), f"code {code_digest(__name__)}"
    trained_from = cached.description.source if cached is not None and cached.description is not None else ""
    try:
        source = f"{name}, {', '.join(ACTIONS)}, sha256 {_digest(name)}, {code}"
        if cached is not None and trained_from == source:
            return cached
        model = train_people_model(load_recordings(name))
    except RecordingsError as error:
        if cached is not None and trained_from.endswith(code):
            return cached
        raise ModelFileError(
            f"the movement {name!r} is trained from recorded people: {error}. Remedy: {REMEDY}", missing=True
        ) from error
    except ValueError as error:
        raise ModelFileError(f"no movement follows from the recordings {name!r}: {error}. Remedy: {REMEDY}") from error
    model.description = replace(model.description or MovementDescription(), source=source)
    if cache is not None:
        model.save(cache)
    return model


def _digest(name: str) -> str:
    file = data_folder() / name / "data.npz"
    if not file.is_file():
        raise RecordingsError(f"{file} is missing")
    return hashlib.sha256(file.read_bytes()).hexdigest()[:16]


def train_people_model(recordings: Recordings, n_states: int = N_STATES) -> PolynomialPHMM:
    """A linear model of reaching over the touched position, in the body frame of one person, m.

    The movements end where the hand arrives: arrival is 1, there is no grasp and no retreat.

    Args:
        recordings: Of people that reach for positions, each movement labelled with its target.
        n_states: Each of 2 or 3 of `2.5 * n_states` frames.

    Raises:
        ValueError: An action is not among the recorded ones.
    """
    unknown = sorted(set(ACTIONS) - set(recordings.actions))
    if unknown:
        raise ValueError(f"{recordings.name} has the actions {', '.join(recordings.actions)}; found {unknown}")
    chosen = [one for action in ACTIONS for one in recordings.of(action=action) if np.isfinite(one.target).all()]
    model = PolynomialPHMM(n_states, 2, 3, degree=1, resampled_frames=round(2.5 * n_states), residuals="independent")
    theta = np.stack([one.target for one in chosen])
    groups = np.array([one.subject for one in chosen])
    model.fit([one.movement for one in chosen], theta, groups=groups)
    seconds = float(np.mean([len(one.movement) - 1 for one in chosen])) / RATE_HZ
    model.description = MovementDescription(
        action="reaching",
        point_names=recordings.point_names,
        frame=BODY,
        parameter_names=("target_x", "target_y", "target_z"),
        duration=seconds,
        arrival=1.0,
    )
    return model
