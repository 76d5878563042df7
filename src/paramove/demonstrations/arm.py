"""The right arm of the synthetic demonstrator: lengths, hand shapes, and the pose for a position of the hand.

The seven body points are those of thesis 4.2.1. All positions are in metres, x forward, y left, z up.
"""

from dataclasses import dataclass

import numpy as np

from paramove.documents import Floats

POINT_NAMES = ("sternum", "shoulder", "elbow", "wrist", "knuckle", "index", "thumb")
UPWARD = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class ArmLengths:
    """Segment lengths in m, chosen so that a trained model has a', b', l' of thesis 5.2.3.

    Attributes:
        upper_arm: shoulder to elbow.
        forearm: elbow to wrist.
        grasp: wrist to the middle of knuckle, index finger and thumb.
        fingertip: wrist to the tip of the stretched index finger.
    """

    upper_arm: float = 0.2600
    forearm: float = 0.2600
    grasp: float = 0.1482
    fingertip: float = 0.1850


@dataclass(frozen=True)
class ArmPath:
    """What determines the arm in T frames; the points follow from it.

    Attributes:
        sternum, shoulder: shape (T, 3).
        effector: point on the forearm's axis that follows the path, shape (T, 3).
        reach: distance of the effector from the wrist, shape (T,).
        swivel: angle of the elbow about the line shoulder - effector, 0 down and back, positive outward, rad, (T,).
        aperture: distance between index finger and thumb, shape (T,).
        pointing: 0 for a grasping hand to 1 for a pointing hand, shape (T,).
        facing: 0 with the thumb forward (hanging arm) to 1 with the thumb to the left (hand at the table), (T,).
    """

    sternum: Floats
    shoulder: Floats
    effector: Floats
    reach: Floats
    swivel: Floats
    aperture: Floats
    pointing: Floats
    facing: Floats


def unit(vectors: Floats) -> Floats:
    """Vectors scaled to length one along the last axis."""
    result: Floats = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return result


def across(vectors: Floats, axis: Floats) -> Floats:
    """Unit vectors of the parts of `vectors` at right angles to the unit vectors `axis`."""
    along = (vectors * axis).sum(axis=-1, keepdims=True)
    return unit(vectors - along * axis)


def elbow_positions(shoulder: Floats, effector: Floats, upper_arm: float, lower: Floats, swivel: Floats) -> Floats:
    """Elbow of a two-segment arm. Shapes (T, 3), (T, 3), (), (T,), (T,) -> (T, 3).

    Zero swivel turns the elbow down and back, so that one angle serves the hanging and the reaching arm.
    Raises ValueError where the effector is out of reach.
    """
    line = effector - shoulder
    distance = np.linalg.norm(line, axis=1)
    if (distance >= upper_arm + lower).any() or (distance <= np.abs(upper_arm - lower)).any():
        worst = int((distance / (upper_arm + lower)).argmax())
        raise ValueError(
            f"frame {worst}: the hand is {distance[worst]:.3f} m from the shoulder, the arm reaches "
            f"{abs(upper_arm - lower[worst]):.3f} to {upper_arm + lower[worst]:.3f} m"
        )
    axis = line / distance[:, None]
    along = (upper_arm**2 - lower**2 + distance**2) / (2.0 * distance)
    radius = np.sqrt(upper_arm**2 - along**2)
    back_and_down, outward = elbow_directions(axis)
    direction = np.cos(swivel)[:, None] * back_and_down + np.sin(swivel)[:, None] * outward
    result: Floats = shoulder + along[:, None] * axis + radius[:, None] * direction
    return result


def elbow_directions(axis: Floats) -> tuple[Floats, Floats]:
    """Directions of zero swivel and of a quarter turn outward, both at right angles to unit vectors `axis` (T, 3)."""
    back_and_down = across(np.broadcast_to(np.array([-1.0, 0.0, -1.0]), axis.shape), axis)
    return back_and_down, np.cross(back_and_down, axis)


def swivel_towards(position: Floats, shoulder: Floats, effector: Floats) -> float:
    """Swivel angle that brings the elbow nearest to `position`; all shapes (3,), m. In rad."""
    axis = unit((effector - shoulder)[None])
    back_and_down, outward = elbow_directions(axis)
    offset = position - shoulder
    return float(np.arctan2(offset @ outward[0], offset @ back_and_down[0]))


def body_points(path: ArmPath, lengths: ArmLengths) -> Floats:
    """The seven points of every frame, stacked. Shape (T, 21)."""
    lower = lengths.forearm + path.reach
    elbow = elbow_positions(path.shoulder, path.effector, lengths.upper_arm, lower, path.swivel)
    forearm = unit(path.effector - elbow)
    wrist = elbow + lengths.forearm * forearm
    forward = across(np.broadcast_to(np.array([1.0, 0.0, 0.0]), forearm.shape), forearm)
    leftward = np.cross(UPWARD, forearm)
    opening = across((1.0 - path.facing)[:, None] * forward + path.facing[:, None] * leftward, forearm)
    along, sideways = hand_shape(path.aperture, path.pointing, lengths)
    hand = wrist[None] + along[:, :, None] * forearm[None] + sideways[:, :, None] * opening[None]
    return np.concatenate([path.sternum, path.shoulder, elbow, wrist, *hand], axis=1)


def hand_shape(aperture: Floats, pointing: Floats, lengths: ArmLengths) -> tuple[Floats, Floats]:
    """Knuckle, index finger and thumb in the hand: along the forearm and along the opening. Shapes (3, T) each.

    A grasping hand has the mean of the three on the forearm's axis at `lengths.grasp`; a pointing hand has the
    stretched index finger there at `lengths.fingertip`.
    """
    one = np.ones_like(aperture)
    half = 0.5 * aperture
    grasp_along = np.stack(
        [(lengths.grasp - 0.055) * one, (lengths.grasp + 0.032) * one, (lengths.grasp + 0.023) * one]
    )
    grasp_sideways = np.stack([-0.024 * one, 0.012 - half, 0.012 + half])
    point_along = np.stack([0.092 * one, lengths.fingertip * one, 0.105 * one])
    point_sideways = np.stack([-0.008 * one, 0.0 * one, 0.038 * one])
    along: Floats = (1.0 - pointing) * grasp_along + pointing * point_along
    sideways: Floats = (1.0 - pointing) * grasp_sideways + pointing * point_sideways
    return along, sideways
