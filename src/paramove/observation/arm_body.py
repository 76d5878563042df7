"""The body of an arm: its sizes, and valid postures for poses drawn from a density (thesis 6.6.1).

The upper arm is a tapered capsule from shoulder to elbow, the forearm one from elbow to wrist (the convex hulls of two
spheres each), the hand an ellipsoid from the wrist to the tip of the index finger, in line with the forearm unless the
pose includes the wrist.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from paramove.demonstrations import ArmLengths, across
from paramove.documents import Floats, InputError

POSE_POINTS = ("shoulder", "elbow", "hand")
"""The three points of an arm pose, in this order; the hand is the tip of the index finger."""
BENT_POSE_POINTS = (*POSE_POINTS, "wrist")
"""The four points of a pose that includes the wrist. Without it the hand is in line with the forearm."""
HAND = slice(6, 9)
"""The coordinates of the hand in either pose."""

_DEMONSTRATOR = ArmLengths()
_BACK_AND_DOWN = np.array([-1.0, 0.0, -1.0])
_MIN_BEND = 1e-9
"""An elbow nearer than this to the line from shoulder to hand, m, defines no plane."""


@dataclass(frozen=True)
class ArmSizes:
    """Sizes of a person's right arm, m; the defaults are those of the synthetic demonstrator.

    Attributes:
        upper_arm: shoulder to elbow.
        forearm: elbow to wrist.
        hand: wrist to the tip of the index finger, the length of the hand's ellipsoid.
        shoulder_radius, elbow_radius, wrist_radius: of the capsules' ends.
        hand_width: whole axis of the ellipsoid in the plane of the arm's bend.
        hand_thickness: whole axis of the ellipsoid at right angles to that plane.
    """

    upper_arm: float = _DEMONSTRATOR.upper_arm
    forearm: float = _DEMONSTRATOR.forearm
    hand: float = _DEMONSTRATOR.fingertip
    shoulder_radius: float = 0.055
    elbow_radius: float = 0.042
    wrist_radius: float = 0.028
    hand_width: float = 0.080
    hand_thickness: float = 0.040

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (np.isfinite(value) and value > 0.0):
                raise InputError(f"{field.name} of an arm: expected a length above 0 m, found {value}")

    @property
    def lower_arm(self) -> float:
        """Elbow to the tip of the index finger, m."""
        return self.forearm + self.hand

    @property
    def length(self) -> float:
        """Shoulder to the tip of the index finger of the stretched arm, m."""
        return self.upper_arm + self.lower_arm

    def scaled(self, factor: float) -> ArmSizes:
        """The same arm, larger by `factor` in all its sizes."""
        return ArmSizes(*(factor * getattr(self, field.name) for field in fields(self)))


def fitted_poses(poses: ArrayLike, sizes: ArmSizes) -> Floats:
    """The nearest postures that the arm can take (thesis 6.6.1.2). (M, 9) -> (M, 9) or (M, 12) -> (M, 12), m.

    Shoulder and hand stay; the elbow moves in the plane of the three points, on its side of the line from shoulder to
    hand, to where both lengths hold. A hand out of reach leaves the arm stretched towards it; one too near to the
    shoulder moves out along the same line. Where the three points lie on a line, the elbow bends back and down. A
    wrist keeps its angle and its side of the line from elbow to hand. A pose with NaN or infinity becomes NaN. Raises
    InputError for another shape.
    """
    points = np.asarray(poses, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] not in (9, 12):
        raise InputError(
            f"expected poses (M, 9), shoulder, elbow, hand, or (M, 12), also the wrist; found shape {points.shape}"
        )
    points = np.where(np.isfinite(points).all(axis=1, keepdims=True), points, np.nan)
    if points.shape[1] == 9:
        return _elbow_fitted(points, sizes.upper_arm, np.full(len(points), sizes.lower_arm))
    elbow, hand, wrist = points[:, 3:6], points[:, HAND], points[:, 9:12]
    lower = np.linalg.norm(sizes.forearm * _unit(wrist - elbow) + sizes.hand * _unit(hand - wrist), axis=1)
    arm = _elbow_fitted(points[:, :9], sizes.upper_arm, lower)
    line = arm[:, 6:9] - arm[:, 3:6]
    along = (sizes.forearm**2 - sizes.hand**2 + lower**2) / (2.0 * np.maximum(lower, _MIN_BEND))
    away = np.sqrt(np.maximum(sizes.forearm**2 - along**2, 0.0))
    axis = _unit(line)
    off = wrist - elbow
    off = _unit(off - (off * axis).sum(axis=1, keepdims=True) * axis)
    return np.concatenate([arm, arm[:, 3:6] + along[:, None] * axis + away[:, None] * off], axis=1)


def _elbow_fitted(points: Floats, upper: float, lower: Floats) -> Floats:
    """Poses (M, 9) with `upper` from shoulder to elbow and `lower` (M,) from elbow to hand, m."""
    shoulder, elbow, hand = points[:, 0:3], points[:, 3:6], points[:, 6:9]
    line = hand - shoulder
    distance = np.linalg.norm(line, axis=1)
    axis = np.where((distance > _MIN_BEND)[:, None], line / np.maximum(distance, _MIN_BEND)[:, None], [1.0, 0, 0])
    axis = np.where(np.isnan(distance)[:, None], np.nan, axis)
    reached = np.clip(distance, np.maximum(np.abs(upper - lower), _MIN_BEND), upper + lower)
    along = (upper**2 - lower**2 + reached**2) / (2.0 * reached)
    away = np.sqrt(np.maximum(upper**2 - along**2, 0.0))
    bent = shoulder + along[:, None] * axis + away[:, None] * _bend(elbow - shoulder, axis)
    tip = np.where((reached == distance)[:, None], hand, shoulder + reached[:, None] * axis)
    return np.concatenate([shoulder, bent, tip], axis=1)


def _unit(vectors: Floats) -> Floats:
    """Vectors scaled to length 1, (M, 3); zeros stay."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), _MIN_BEND))


def _bend(to_elbow: Floats, axis: Floats) -> Floats:
    """Unit vectors at right angles to `axis` towards the elbow; back and down where the elbow lies on the axis."""
    off = to_elbow - (to_elbow * axis).sum(axis=1, keepdims=True) * axis
    size = np.linalg.norm(off, axis=1, keepdims=True)
    result: Floats = off / np.maximum(size, _MIN_BEND)
    flat = (size < _MIN_BEND)[:, 0]
    if flat.any():
        down = np.broadcast_to(_BACK_AND_DOWN, axis[flat].shape)
        along_it = np.abs((down * axis[flat]).sum(axis=1, keepdims=True)) > 0.999 * np.linalg.norm(_BACK_AND_DOWN)
        result[flat] = across(np.where(along_it, [1.0, 0.0, -1.0], down), axis[flat])
    return result
