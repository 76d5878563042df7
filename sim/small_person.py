"""A person at the robot's scale: the synthetic demonstrator's table scene, smaller, next to the robot's working plane.

The person sits across the corner of the tool box, beyond its far edge and to the robot's right, and has an arm of about
30 cm. Three frames, m:

    human      that of chapter 6's performers: x forward, y left, z up, at the edge of a table of human size
    table      the same axes and origin at the robot's scale; z = 0 is the working plane. Cameras are calibrated in it
    shoulder   that of the robot's right shoulder
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from paramove.action_space import Person, write_person
from paramove.demonstrations import SAMPLE_RATE_HZ
from paramove.documents import Floats
from paramove.observation import ArmSizes
from sim import tool_box
from sim.persons.performances import pointed_once
from sim.persons.performers import ELBOW, INDEX, SHOULDER, WRIST, Performer, draw_performer, in_person

SCALE = 0.42
"""Of the table scene: the 80 x 30 cm where people point become 34 x 13 cm, which hold the strip of the objects."""
TABLE_IN_SHOULDER = (0.147, -0.106, np.deg2rad(140.0))
"""Origin (x, y), m, of the table frame in the shoulder frame, and the angle of its x axis there, rad."""
POINTED_ABOVE_PLANE = 2 * tool_box.CYLINDER_HALF_HEIGHT + 0.02
"""A person points at a target this far above the working plane: 2 cm above the middle of a standing object's top."""
HUMAN_PLANE_Z = 0.07
REACH_SHARE, FOLD_SHARE = 0.96, 0.40
"""Of upper arm and forearm: farthest and nearest wrist without the shoulder moving."""


def shoulder_from_table(points: ArrayLike) -> Floats:
    """Points (..., 3), m, of the table frame in the robot's shoulder frame."""
    x, y, _ = TABLE_IN_SHOULDER
    turned = np.asarray(points, dtype=np.float64) @ turn_of_table().T
    return np.asarray(turned + np.array([x, y, tool_box.SURFACE_Z]))


def table_from_shoulder(points: ArrayLike) -> Floats:
    """Points (..., 3), m, of the robot's shoulder frame in the table frame."""
    x, y, _ = TABLE_IN_SHOULDER
    moved = np.asarray(points, dtype=np.float64) - np.array([x, y, tool_box.SURFACE_Z])
    return np.asarray(moved @ turn_of_table())


def turn_of_table() -> Floats:
    """Rotation (3, 3) from the table frame to the shoulder frame."""
    cos, sin = np.cos(TABLE_IN_SHOULDER[2]), np.sin(TABLE_IN_SHOULDER[2])
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


def _table_from_human(points: Floats) -> Floats:
    return np.asarray(SCALE * points + np.array([0.0, 0.0, POINTED_ABOVE_PLANE - SCALE * HUMAN_PLANE_Z]))


def _human_from_table(points: Floats) -> Floats:
    return np.asarray((points - np.array([0.0, 0.0, POINTED_ABOVE_PLANE - SCALE * HUMAN_PLANE_Z])) / SCALE)


@dataclass(frozen=True)
class PointingMovement:
    """A pointing movement from the base pose and back to it, at 60 Hz.

    Attributes:
        postures: shoulder, elbow, wrist, tip of the index finger, (T, 4, 3), m, in the robot's shoulder frame.
        arrives_s, leaves_s: when the fingertip is at the place.
    """

    postures: Floats
    arrives_s: float
    leaves_s: float

    @property
    def duration_s(self) -> float:
        """Of the whole movement."""
        return (len(self.postures) - 1) / SAMPLE_RATE_HZ

    def at(self, time_s: float) -> Floats:
        """The posture (4, 3) at a time, between the frames by straight lines."""
        position = float(np.clip(time_s * SAMPLE_RATE_HZ, 0.0, len(self.postures) - 1))
        first = min(int(position), len(self.postures) - 2)
        fraction = position - first
        return np.asarray((1.0 - fraction) * self.postures[first] + fraction * self.postures[first + 1])


class SmallPerson:
    """A new person with other sizes, seat, timing and habits.

    Args:
        draw: Of everything about the person.

    Attributes:
        sizes: Of the arm, m.
        seat: The resting right shoulder, (3,), m, in the robot's shoulder frame.
    """

    def __init__(self, draw: np.random.Generator) -> None:
        self._performer: Performer = draw_performer(draw)
        self.sizes: ArmSizes = self._performer.sizes.scaled(SCALE)
        self.seat = shoulder_from_table(_table_from_human(self._performer.shoulder))

    def write_measures(self, path: Path) -> None:
        """Measured sizes of this person, in the table frame: up to 3 % and 2 mm wrong."""
        shoulder = _table_from_human(self._performer.measured_shoulder)
        sizes = {name: SCALE * getattr(self._performer.measured, name) for name in ("upper_arm", "forearm", "hand")}
        write_person(path, Person(shoulder=tuple(shoulder), **sizes), decimals=4)

    def points_at(self, place: ArrayLike, draw: np.random.Generator) -> PointingMovement:
        """The person points at a place (3,), m, in the robot's shoulder frame, and takes the hand back.

        Raises ValueError for a place out of the arm's reach.
        """
        person = self._performer
        target = _human_from_table(table_from_shoulder(place))
        moved = pointed_once(person, person.placement.in_model(target), draw)
        body = in_person(moved.points, person)[:, [SHOULDER, ELBOW, WRIST, INDEX]]
        postures = shoulder_from_table(_table_from_human(body))
        return PointingMovement(postures, float(moved.arrives_s[0]), float(moved.leaves_s[0]))

    def holding(self, fingertip: Floats, backward: Floats, elbow_towards: Floats | None = None) -> Floats:
        """The posture (4, 3) with the fingertip (3,) there and the wrist from it in direction `backward` (3,).

        The shoulder stays at its seat; where the wrist is too far or too near for that, the person leans. The elbow
        hangs back, or to the side of the line from shoulder to wrist on which `elbow_towards` (3,) lies.
        """
        sizes = self.sizes
        wrist = fingertip + sizes.hand * backward / np.linalg.norm(backward)
        away = wrist - self.seat
        distance = max(float(np.linalg.norm(away)), 1e-6)
        axis, both = away / distance, sizes.upper_arm + sizes.forearm
        reach = float(np.clip(distance, FOLD_SHARE * both, REACH_SHARE * both))
        shoulder = wrist - reach * axis
        along = (sizes.upper_arm**2 - sizes.forearm**2 + reach**2) / (2.0 * reach)
        off = float(np.sqrt(max(sizes.upper_arm**2 - along**2, 0.0)))
        hint = turn_of_table() @ np.array([-0.7, -0.3, -0.6]) if elbow_towards is None else elbow_towards
        across = hint - (hint @ axis) * axis
        elbow = shoulder + along * axis + off * across / max(float(np.linalg.norm(across)), 1e-6)
        return np.stack([shoulder, elbow, wrist, fingertip])
