"""Forward kinematics of HOAP-3's arm in closed form.

Thesis 5.2.1, corrected (errata 18): q = (R_j1 ∘ R_j2 ∘ R_j3 ∘ R_j4 ∘ R_j5)(p), the wrist applied first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats

X, Y, Z = 0, 1, 2


@dataclass(frozen=True)
class ArmPoints:
    """Points of the arm in the frame of the shoulder (axes parallel to the torso), each [..., 3], m.

    `shoulder_from_hand` [..., 3, 3] turns directions of the hand (x along the forearm; in the zero pose parallel to the
    torso's axes) into the shoulder's frame.
    """

    elbow: Floats
    gripper: Floats
    fingertip: Floats
    shoulder_from_hand: Floats


@dataclass(frozen=True)
class ArmKinematics:
    """An arm of five joints: pitch about y, roll about z, torsion about x, elbow about y, wrist about x.

    Attributes:
        upper_arm: Shoulder to elbow, m.
        gripper_from_elbow: Centre of a held 20 mm cylinder, from the elbow, zero pose, [3], m.
        fingertip_from_elbow: Fingertip, likewise.
    """

    upper_arm: float
    gripper_from_elbow: tuple[float, float, float]
    fingertip_from_elbow: tuple[float, float, float]

    def forward(self, angles: ArrayLike) -> ArmPoints:
        """Where the arm's points are.

        Args:
            angles: Shape [..., 5], rad: shoulder pitch, roll, torsion, elbow, wrist.

        Raises:
            ValueError: The last axis does not hold five angles.
        """
        q = np.asarray(angles, dtype=np.float64)
        if q.ndim == 0 or q.shape[-1] != 5:
            raise ValueError(f"angles have shape {q.shape}; the last axis must hold the arm's 5 joints")
        shoulder_from_upper_arm = _rotation(Y, q[..., 0]) @ _rotation(Z, q[..., 1]) @ _rotation(X, q[..., 2])
        shoulder_from_hand = shoulder_from_upper_arm @ _rotation(Y, q[..., 3]) @ _rotation(X, q[..., 4])
        elbow = self.upper_arm * shoulder_from_upper_arm[..., :, 0]
        return ArmPoints(
            elbow=elbow,
            gripper=elbow + shoulder_from_hand @ np.asarray(self.gripper_from_elbow),
            fingertip=elbow + shoulder_from_hand @ np.asarray(self.fingertip_from_elbow),
            shoulder_from_hand=shoulder_from_hand,
        )


def _rotation(axis: int, angle: Floats) -> Floats:
    """Rotation matrices about an axis, [..., 3, 3], for angles [...] in rad."""
    first, second = (axis + 1) % 3, (axis + 2) % 3  # it turns the first towards the second
    matrix = np.zeros((*angle.shape, 3, 3))
    matrix[...] = np.eye(3)
    cosine, sine = np.cos(angle), np.sin(angle)
    matrix[..., first, first] = cosine
    matrix[..., second, second] = cosine
    matrix[..., second, first] = sine
    matrix[..., first, second] = -sine
    return matrix
