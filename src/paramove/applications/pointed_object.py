"""Which object a person points at, from the place that the person's arm points at."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from paramove.applications.stage import Place, cm

NEAR = 0.035
"""An object farther from the place is not meant, m; the objects stand at least 5 cm apart."""
CLEARER_BY = 0.015
"""The second nearest object must be so much farther away, m."""


@dataclass(frozen=True)
class PointedObject:
    """Either the name of the object or the doubt why it cannot be told, a sentence; the other is empty."""

    name: str = ""
    doubt: str = ""


def object_at(place: Place, standing: Mapping[str, Place]) -> PointedObject:
    """The object that is meant with a place, m, of those that stand at places on the same plane."""
    ordered = sorted(standing, key=lambda name: (math.dist(standing[name], place), name))
    distances = [math.dist(standing[name], place) for name in ordered]
    if not ordered or not distances[0] <= NEAR:  # NaN is not near either
        return PointedObject(doubt=f"You point at {cm(place)}, but I see nothing that stands near there.")
    if len(ordered) > 1 and distances[1] - distances[0] < CLEARER_BY:
        return PointedObject(doubt=f"You point at {cm(place)}: that can be {ordered[0]} or {ordered[1]}.")
    return PointedObject(name=ordered[0])
