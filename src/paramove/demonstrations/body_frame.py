"""Movements relative to the person: body frame, left arms mirrored to right ones, lengths scaled to the arm.

The body frame has its origin where the shoulder of the moving arm is at the beginning, x forward, y left, z up.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from paramove.demonstrations.movement import DemonstrationError, Movement, position_in_theta
from paramove.documents import Floats

BODY = "body"
SHOULDER, OTHER_SHOULDER, STERNUM = "shoulder", "other_shoulder", "sternum"
ARM_CHAIN = ("shoulder", "elbow", "wrist")
AT_BEGINNING = 0.25
"""s. The pose of the trunk is the median over this first part of the movement: afterwards the trunk may lean."""
NARROWEST = 0.05
"""m. Shoulder and sternum (or both shoulders) at a smaller horizontal distance give no direction."""


def in_body_frame(movement: Movement) -> Movement:
    """The movement in the body frame, however the person sits or stands; z of its frame must point up.

    y is the horizontal direction between both shoulders (points `shoulder`, of the moving arm, and `other_shoulder`)
    or, where there is only one, between sternum and shoulder; the latter is turned by some degrees, as the sternum lies
    before the shoulders, by nearly the same for everybody. One turn and shift for the whole movement, so that movements
    of the trunk remain. A position in theta is transformed too.

    Raises DemonstrationError if there is no such pair of points or they lie above each other.
    """
    other = OTHER_SHOULDER if OTHER_SHOULDER in movement.point_names else STERNUM
    begins = movement.time <= AT_BEGINNING
    origin: Floats = np.median(movement.point(SHOULDER)[begins], axis=0)
    inward = np.median(movement.point(other)[begins], axis=0) - origin
    leftward = inward if movement.side == "right" else -inward
    leftward[2] = 0.0
    width = float(np.linalg.norm(leftward))
    if width < NARROWEST:
        raise DemonstrationError(
            f"{movement.source}: {SHOULDER} and {other} are {width * 100:.1f} cm apart seen from above; no body frame "
            f"follows from less than {NARROWEST * 100:g} cm. Check units, axes (z must point up) and names of points"
        )
    y = leftward / width
    body_from_frame: Floats = np.array([[y[1], -y[0], 0.0], [y[0], y[1], 0.0], [0.0, 0.0, 1.0]])
    return _mapped(movement, body_from_frame, origin, BODY)


def mirrored(movement: Movement) -> Movement:
    """A movement of the left arm in the body frame as one of the right arm: y changes its sign, in theta too.

    Raises DemonstrationError for a movement in another frame, of which the plane of symmetry is not known.
    """
    if movement.frame != BODY:
        raise DemonstrationError(
            f"{movement.source}: is in the frame '{movement.frame}'; bring it to the body frame before it is mirrored"
        )
    flipped = _mapped(movement, np.diag([1.0, -1.0, 1.0]), np.zeros(3), BODY)
    return replace(flipped, side="right" if movement.side == "left" else "left")


def arm_length(movement: Movement) -> float:
    """Upper arm and forearm together: medians over the movement, m."""
    return chain_length([movement.point(name) for name in ARM_CHAIN])


def chain_length(points: Sequence[Floats]) -> float:
    """Sum of the median distances between successive points, (T, 3) each, such as shoulder, elbow and wrist.

    Movements of persons of different size are alike after a division by the length of the arm.
    """
    return float(sum(np.median(np.linalg.norm(b - a, axis=1)) for a, b in itertools.pairwise(points)))


def scaled(movement: Movement, factor: float) -> Movement:
    """All lengths in the body frame, those of a position in theta too, times `factor`.

    Raises DemonstrationError for another frame, whose origin is not at the shoulder.
    """
    if movement.frame != BODY:
        raise DemonstrationError(
            f"{movement.source}: is in the frame '{movement.frame}'; bring it to the body frame before it is scaled"
        )
    return _mapped(movement, np.eye(3) * factor, np.zeros(3), BODY)


def _mapped(movement: Movement, linear: Floats, origin: Floats, frame: str) -> Movement:
    """Every position p becomes `linear` @ (p - origin)."""
    theta = movement.theta.copy()
    position = position_in_theta(movement.parameter_names)
    if position is not None:
        theta[position] = linear @ (theta[position] - origin)
    return replace(movement, positions=(movement.positions - origin) @ linear.T, theta=theta, frame=frame)
