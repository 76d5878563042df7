"""What a relocation goal asks for, checked before anything is planned."""

from __future__ import annotations

import numpy as np

from paramove.documents.array_types import Floats
from paramove.motion.reaching_movement import ReachingMovement
from paramove.msgs.relocation_pb2 import Position, RelocationGoal, RelocationStatus

FRAME = "right_shoulder"
FARTHEST = 2.0
"""m; beyond it not even the way to an answer of the inverse kinematics can be computed."""
LARGEST = 1e6


class GoalRefusedError(ValueError):
    """A goal cannot be done; the message says why and what would work."""


def point_of(goal: RelocationGoal, name: str) -> Floats:
    """Position `name` ("from" or "to") of a goal, [3], m; raises GoalRefusedError if it lacks or is not finite."""
    if not goal.HasField(name):
        raise GoalRefusedError(f"the goal lacks its position {name!r}")
    position: Position = getattr(goal, name)
    point = np.array([position.x, position.y, position.z])
    if not np.isfinite(point).all():
        raise GoalRefusedError(f"position {name!r} is {point.tolist()}; finite numbers in m are needed")
    if np.abs(point).max() > FARTHEST:
        raise GoalRefusedError(
            f"position {name!r} is {point.tolist()} m; an arm reaches no farther than {FARTHEST:g} m"
        )
    return point


def hull_of(goal: RelocationGoal, name: str, movement: ReachingMovement) -> RelocationStatus.Hull:
    """Whether position `name` of a goal lies within the training of the movement; unspecified where it lacks."""
    try:
        within = movement.within_training(point_of(goal, name))
    except (ArithmeticError, ValueError):  # the goal is refused for it elsewhere; LinAlgError is a ValueError
        return RelocationStatus.HULL_UNSPECIFIED
    if within is None:
        return RelocationStatus.HULL_UNSPECIFIED
    return RelocationStatus.HULL_INSIDE if within else RelocationStatus.HULL_OUTSIDE


def standing_of(goal: RelocationGoal) -> Floats:
    """Places of the objects to keep clear of, [M, 2], m; raises GoalRefusedError if one is not finite."""
    places = np.array([[place.x, place.y, place.z] for place in goal.avoid]).reshape(-1, 3)
    if not np.isfinite(places).all() or np.abs(places).max(initial=0.0) > LARGEST:
        raise GoalRefusedError(f"the places to avoid are {places.tolist()}; finite numbers in m are needed")
    return places[:, :2]


def centimetres(point: Floats) -> str:
    """A place in words, in cm."""
    return f"({point[0] * 100:.1f}, {point[1] * 100:.1f})"
