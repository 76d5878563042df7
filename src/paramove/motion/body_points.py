"""The points of a person's body that a robot's arm follows."""

from __future__ import annotations

import numpy as np

from paramove.documents.array_types import Floats

POINTS = ("shoulder", "elbow", "knuckle", "index", "thumb")


def points_of(means: Floats, point_names: tuple[str, ...]) -> dict[str, Floats]:
    """The needed points [..., 3] by name, of means [..., 3 · points]; raises ValueError if one is missing."""
    missing = [name for name in POINTS if name not in point_names]
    if missing:
        raise ValueError(
            f"the model has the points {', '.join(point_names) or 'none'}; needed also: {', '.join(missing)}"
        )
    points = means.reshape(*means.shape[:-1], -1, 3)
    return {name: points[..., point_names.index(name), :] for name in POINTS}


def arm_of(person: dict[str, Floats], shoulder: Floats) -> tuple[Floats, Floats, Floats]:
    """Elbow q̃, gripper r̃ seen from a shoulder, and finger to thumb õ; [..., 3] each (5.2.3)."""
    gripper = np.mean([person["knuckle"], person["index"], person["thumb"]], axis=0)
    return person["elbow"] - shoulder, gripper - shoulder, person["thumb"] - person["index"]
