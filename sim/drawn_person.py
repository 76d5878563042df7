"""The rest of the person, drawn for people around the hand that is simulated: no camera of the robot sees it."""

from __future__ import annotations

import mujoco
import numpy as np

from paramove.documents import Floats

SHOULDER = np.array((0.70, -0.34, 0.17))
"""Of the arm that moves, frame of the tool box's measures, m; the person sits across the table."""
ACROSS = np.array((0.27, -0.96, 0.0))
"""From that shoulder to the other one, unit vector."""
SHOULDERS_M, UPPER_ARM_M, FOREARM_M = 0.36, 0.29, 0.27
WRIST_M = 0.135  # from the fingertip, where the simulated hand ends
SKIN, SHIRT, TROUSERS, HAIR = (0.87, 0.68, 0.56), (0.28, 0.42, 0.60), (0.22, 0.24, 0.29), (0.25, 0.18, 0.13)
_UP = np.array((0.0, 0.0, 1.0))


class DrawnPerson:
    """Adds torso, head and arms to a scene.

    Args:
        origin: Of the frame of the tool box's measures in the world, [3], m.
    """

    def __init__(self, origin: Floats) -> None:
        self._shoulder = origin + SHOULDER
        self._scene: mujoco.MjvScene | None = None

    def draw(self, scene: mujoco.MjvScene, fingertip: Floats, backward: Floats) -> None:
        """Around a hand, of which fingertip and the direction from there to the wrist are given, [3] each, world."""
        self._scene = scene
        shoulder, other = self._shoulder, self._shoulder + SHOULDERS_M * ACROSS
        middle = (shoulder + other) / 2
        self._capsule(shoulder, other, 0.062, SHIRT)
        self._ellipsoid(middle - 0.20 * _UP, (0.115, 0.175, 0.24), SHIRT)
        hips = middle - 0.46 * _UP
        self._capsule(hips - 0.11 * ACROSS, hips + 0.11 * ACROSS, 0.10, TROUSERS)
        self._capsule(middle, middle + 0.12 * _UP, 0.046, SKIN)
        head = middle + 0.21 * _UP
        facing = np.cross(ACROSS, _UP)
        self._ellipsoid(head, (0.086, 0.074, 0.108), SKIN)
        self._ellipsoid(head + 0.030 * _UP - 0.016 * facing, (0.088, 0.080, 0.092), HAIR)
        for side in (-0.03, 0.03):
            self._ellipsoid(
                head + 0.076 * facing + side * ACROSS + 0.008 * _UP, (0.011, 0.011, 0.011), (0.08, 0.08, 0.1)
            )
        wrist = fingertip + WRIST_M * backward
        elbow = elbow_of(shoulder, wrist)
        self._arm(shoulder, elbow, wrist)
        resting = other + np.array((-0.24, -0.02, -0.36))
        self._arm(other, elbow_of(other, resting), resting)
        self._ellipsoid(resting - np.array((0.03, 0.0, 0.0)), (0.05, 0.035, 0.022), SKIN)

    def _arm(self, shoulder: Floats, elbow: Floats, wrist: Floats) -> None:
        cuff = elbow + 0.8 * (wrist - elbow)
        self._capsule(shoulder, elbow, 0.046, SHIRT)
        self._capsule(elbow, cuff, 0.037, SHIRT)
        self._capsule(cuff, wrist, 0.024, SKIN)

    def _capsule(self, start: Floats, end: Floats, radius: float, colour: tuple[float, float, float]) -> None:
        geom = self._next(mujoco.mjtGeom.mjGEOM_CAPSULE, np.zeros(3), colour)
        mujoco.mjv_connector(geom, mujoco.mjtGeom.mjGEOM_CAPSULE, radius, np.asarray(start), np.asarray(end))

    def _ellipsoid(self, centre: Floats, size: tuple[float, float, float], colour: tuple[float, float, float]) -> None:
        geom = self._next(mujoco.mjtGeom.mjGEOM_ELLIPSOID, np.asarray(centre), colour)
        geom.size[:] = size

    def _next(self, kind: mujoco.mjtGeom, centre: Floats, colour: tuple[float, float, float]) -> mujoco.MjvGeom:
        scene = self._scene
        assert scene is not None
        geom = scene.geoms[scene.ngeom]
        facing = np.cross(ACROSS, _UP)
        turned = np.column_stack((facing, ACROSS, _UP))
        mujoco.mjv_initGeom(geom, kind, np.ones(3), centre, turned.ravel(), np.array((*colour, 1.0), dtype=np.float32))
        scene.ngeom += 1
        return geom


def elbow_of(shoulder: Floats, wrist: Floats) -> Floats:
    """Elbow [3] of an arm that hangs as low as it can; a wrist that is too far stretches it."""
    way = wrist - shoulder
    distance = float(np.linalg.norm(way))
    ahead = way / distance
    along = (UPPER_ARM_M**2 - FOREARM_M**2 + distance**2) / (2 * distance)
    aside = np.sqrt(max(0.0, UPPER_ARM_M**2 - along**2))
    down = -_UP + (ahead @ _UP) * ahead
    return np.asarray(shoulder + min(along, distance) * ahead + aside * down / max(float(np.linalg.norm(down)), 1e-9))
