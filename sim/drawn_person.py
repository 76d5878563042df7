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
Colour = tuple[float, float, float]
SKIN, HAIR, EYES = (0.87, 0.68, 0.56), (0.25, 0.18, 0.13), (0.08, 0.08, 0.10)
SHIRT, TROUSERS = (0.28, 0.42, 0.60), (0.22, 0.24, 0.29)
_UP = np.array((0.0, 0.0, 1.0))
_FACING = np.cross(ACROSS, _UP)
_TURN = np.column_stack((_FACING, ACROSS, _UP)).ravel()


class DrawnPerson:
    """Adds torso, head and arms to a scene.

    Args:
        origin: Of the frame of the tool box's measures in the world, [3], m.
    """

    def __init__(self, origin: Floats) -> None:
        self._shoulder = origin + SHOULDER

    def draw(self, scene: mujoco.MjvScene, fingertip: Floats, backward: Floats) -> None:
        """Around a hand, of which fingertip and the direction from there to the wrist are given, [3] each, world."""
        shoulder, other = self._shoulder, self._shoulder + SHOULDERS_M * ACROSS
        middle = (shoulder + other) / 2
        hips, head = middle - 0.46 * _UP, middle + 0.21 * _UP
        _capsule(scene, shoulder, other, 0.062, SHIRT)
        _ellipsoid(scene, middle - 0.20 * _UP, (0.115, 0.175, 0.24), SHIRT)
        _capsule(scene, hips - 0.11 * ACROSS, hips + 0.11 * ACROSS, 0.10, TROUSERS)
        _capsule(scene, middle, middle + 0.12 * _UP, 0.046, SKIN)
        _ellipsoid(scene, head, (0.086, 0.074, 0.108), SKIN)
        _ellipsoid(scene, head + 0.030 * _UP - 0.016 * _FACING, (0.088, 0.080, 0.092), HAIR)
        for side in (-0.03, 0.03):
            _ellipsoid(scene, head + 0.076 * _FACING + side * ACROSS + 0.008 * _UP, (0.011,) * 3, EYES)
        resting = other + np.array((-0.24, -0.02, -0.36))
        _arm(scene, shoulder, fingertip + WRIST_M * backward)
        _arm(scene, other, resting)
        _ellipsoid(scene, resting - np.array((0.03, 0.0, 0.0)), (0.05, 0.035, 0.022), SKIN)


def _arm(scene: mujoco.MjvScene, shoulder: Floats, wrist: Floats) -> None:
    elbow = elbow_of(shoulder, wrist)
    cuff = elbow + 0.8 * (wrist - elbow)
    _capsule(scene, shoulder, elbow, 0.046, SHIRT)
    _capsule(scene, elbow, cuff, 0.037, SHIRT)
    _capsule(scene, cuff, wrist, 0.024, SKIN)


def _capsule(scene: mujoco.MjvScene, start: Floats, end: Floats, radius: float, colour: Colour) -> None:
    geom = _geom(scene, mujoco.mjtGeom.mjGEOM_CAPSULE, np.ones(3), np.zeros(3), colour)
    mujoco.mjv_connector(geom, mujoco.mjtGeom.mjGEOM_CAPSULE, radius, start, end)


def _ellipsoid(scene: mujoco.MjvScene, centre: Floats, size: tuple[float, ...], colour: Colour) -> None:
    _geom(scene, mujoco.mjtGeom.mjGEOM_ELLIPSOID, np.array(size), centre, colour)


def _geom(scene: mujoco.MjvScene, kind: mujoco.mjtGeom, size: Floats, centre: Floats, colour: Colour) -> mujoco.MjvGeom:
    """One more geom of a scene."""
    geom = scene.geoms[scene.ngeom]
    mujoco.mjv_initGeom(geom, kind, size, centre, _TURN, np.array((*colour, 1.0), dtype=np.float32))
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
