"""The interface of planners: motions of an arm with a gripper, from rest to rest and clear of their surroundings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Floats
from paramove.motion.gripper_arm import GripperArm

FARTHEST_M = 2.0
"""Maximum of each coordinate of a requested position; beyond it the inverse kinematics are numerically unusable."""
MAX_STANDING = 8
"""Number of objects that can be kept clear of at once."""
HEIGHT_ERROR_M = 0.015
"""Of a height that was measured in an image."""


class NoPlanError(ValueError):
    """A motion cannot be planned; the message gives the reason and, where there is one, the nearest possible.

    Attributes:
        in_the_way: Numbers of the standing objects that every plan would come too close to.
    """

    def __init__(self, message: str, in_the_way: frozenset[int] = frozenset()) -> None:
        super().__init__(message)
        self.in_the_way = in_the_way


class MisfitError(NoPlanError):
    """No object of this size can be handled."""


def check_number(standing: Floats) -> None:
    """Raises NoPlanError for more standing objects [M, 2] than can be kept clear of."""
    if len(standing) > MAX_STANDING:
        raise NoPlanError(f"{len(standing)} objects to keep clear of; at most {MAX_STANDING} at once are possible")


@dataclass(frozen=True)
class Held:
    """An object in the gripper.

    Attributes:
        pitch: Of the hand when it grasped it, rad.
        width: Of the object, m.
        z: Where it was grasped, frame of the arm's base, m.
        lowered: How far below the goal that was, m.
    """

    pitch: float
    width: float
    z: float
    lowered: float


@dataclass(frozen=True)
class RestPose:
    """Where an arm rests between motions.

    Attributes:
        angles: Arm joints and gripper, [J + 1], rad.
        gripper: Position of the end effector, [3], m, frame of the arm's base.
        measured: Whether the angles were measured; otherwise they are the end of a planned motion.
        held: How it holds an object; None: not known, or nothing.
    """

    angles: Floats
    gripper: Floats
    measured: bool = False
    held: Held | None = None


@dataclass(frozen=True)
class PlannedMotion:
    """A motion from rest to rest, ready for the driver.

    Attributes:
        times: [K], s, from 0.
        angles: Arm joints and gripper, [K, J + 1], rad.
        gripper: Where the end effector shall be, [K, 3], m, frame of the arm's base.
        holding: Whether an object is held, [K].
        phases: Name and start of each phase.
        elbow_turn: Largest turn of the elbow for a joint limit, rad.
        held: See `RestPose`.
    """

    times: Floats
    angles: Floats
    gripper: Floats
    holding: NDArray[np.bool_]
    phases: tuple[tuple[str, float], ...]
    elbow_turn: float
    held: Held | None = None

    @property
    def end(self) -> RestPose:
        """Where it ends."""
        return RestPose(self.angles[-1], self.gripper[-1], held=self.held)


@dataclass(frozen=True)
class Grasp:
    """What is known of a grasp beforehand.

    Attributes:
        target: Where the object is to be delivered, [3], m; None: not known yet.
        attempt: From 1; every second one is made in another way.
        width, height: Of the object, m; None: as objects usually are.
        turn: From x to one of the sides of its square foot, or to its length, rad; None: it is round, or that is not
            known.
        length: Of an object that lies, m; None: it stands.
    """

    target: Floats | None = None
    attempt: int = 1
    width: float | None = None
    height: float | None = None
    turn: float | None = None
    length: float | None = None

    def check_height(self, usual: float) -> None:
        """Raises MisfitError for an object that is taller than those, m, that motions are planned for."""
        if self.height is not None and self.height > usual + HEIGHT_ERROR_M:
            raise MisfitError(
                f"the object looks {1000 * self.height:.0f} mm high; the arm moves objects of {1000 * usual:.0f} mm"
            )


USUAL = Grasp()


class MotionPlans(Protocol):
    """Plans motions of one arm. Positions are of the end effector, [3], m, in the frame of the arm's base.

    `start` and `here` are where the arm rests, None for its base pose; `standing` are positions of other objects,
    [M, 2]; openings ξ are 0 for a closed gripper to 1. Every method that plans raises NoPlanError or OutOfReachError.
    """

    @property
    def arm(self) -> GripperArm:
        """Its joints and gripper."""

    @property
    def offer_opening(self) -> float:
        """ξ while the gripper waits for an object from somebody's hand."""

    @property
    def closed_opening(self) -> float:
        """ξ of the gripper that closes on an object, which stops it earlier."""

    def fetch(
        self, source: Floats, standing: Floats, start: RestPose | None = None, grasp: Grasp = USUAL
    ) -> PlannedMotion:
        """Grasp the object at `source` and lift it."""

    def deliver(self, start: RestPose, target: Floats, standing: Floats) -> PlannedMotion:
        """Carry the held object to `target`, release it, go back to the base pose."""

    def hold(self, start: RestPose, position: Floats, standing: Floats) -> PlannedMotion:
        """Carry the held object to `position` and stay there."""

    def reach(self, position: Floats, standing: Floats, start: RestPose | None = None) -> PlannedMotion:
        """Go to `position` with an open gripper and stay there."""

    def fingers(self, here: RestPose, opening: float, end: float, standing: Floats) -> PlannedMotion:
        """Open or close the gripper where it is."""

    def leave(self, here: RestPose, opening: float, standing: Floats) -> PlannedMotion:
        """Open the gripper where it is and go back to the base pose."""

    def home(self, here: RestPose, opening: float, holding: bool, standing: Floats) -> PlannedMotion:
        """Back to the base pose from wherever the arm rests; a held object is put down first."""

    def within_training(self, position: Floats) -> bool | None:
        """Whether the movement model was trained around this position; None if that is not known."""


def centimetres(point: Floats) -> str:
    """A position as text, in cm."""
    return f"({', '.join(f'{value * 100:.1f}' for value in point)}) cm"


def metres(point: Floats) -> str:
    """A position as text, in m."""
    return f"({', '.join(f'{value:.3f}' for value in point)}) m"
