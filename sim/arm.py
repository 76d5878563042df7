"""A whole arm around a person's hand, which points as people do: from the arm's base pose to the target and back."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats
from sim.hand import Hand, Script, Step
from sim.hand_path import minimum_jerk
from sim.small_person import PointingMovement, SmallPerson

SHOULDER, ELBOW, WRIST, TIP = range(4)
RESTS_BEFORE_S = (1.0, 1.6)
RESTS_AFTER_S = (0.4, 0.7)


class Arm:
    """Shoulder, elbow and wrist of a person whose hand does other things too. Robot's shoulder frame, m.

    Args:
        hand: The hand.
        body: Whose arm it is.
        draw: Of how the person points each time.

    Attributes:
        target: Place that is being pointed at, (3,); None while none is.
        pointings: How many were begun.
        at_target: Whether the fingertip is at the target.
        has_pointed: Whether it has been there since the present request.
    """

    def __init__(self, hand: Hand, body: SmallPerson, draw: np.random.Generator) -> None:
        self.body = body
        self._hand, self._draw = hand, draw
        self.target: Floats | None = None
        self.pointings = 0
        self.at_target = self.has_pointed = False
        self._posture: Floats | None = None
        self._elbow_towards: Floats | None = None

    @property
    def posture(self) -> Floats:
        """Shoulder, elbow, wrist, tip of the index finger, (4, 3)."""
        if self._posture is not None:
            return self._posture
        return self.body.holding(self._hand.fingertip, self._hand.backward, self._elbow_towards)

    def hanging_before(self, target: ArrayLike) -> Floats:
        """Posture (4, 3) from which the person would point at a place (3,)."""
        return np.asarray(self.body.points_at(target, self._draw).postures[0])

    def hang_at_once(self, posture: Floats) -> None:
        """Hangs, and the elbow stays on its side of the arm from now on."""
        self._elbow_towards = _bend(posture)
        self.take(posture)

    def take(self, posture: Floats) -> None:
        """Is in a posture (4, 3) at once, and the hand with it."""
        self._posture = posture
        backward = posture[WRIST] - posture[TIP]
        self._hand.place(posture[TIP], backward / np.linalg.norm(backward))

    def follow_hand(self) -> None:
        """The hand leads again."""
        self._posture = None

    def point_at(self, place: ArrayLike) -> Script:
        """The person sits down with a hanging arm, points at a place (3,), and lets the arm hang."""
        target = np.asarray(place, dtype=np.float64)
        movement = self.body.points_at(target, self._draw)
        yield from self.hang(movement.postures[0])
        self.target, self.pointings = target, self.pointings + 1
        yield Step(movement.duration_s, during=lambda time_s: self._perform(movement, time_s))
        self.target, self.at_target = None, False
        yield Step(float(self._draw.uniform(*RESTS_AFTER_S)))

    def hang(self, posture: Floats) -> Script:
        """The arm goes to a posture (4, 3) and rests there."""
        backward = (posture[WRIST] - posture[TIP]) / np.linalg.norm(posture[WRIST] - posture[TIP])
        bend = _bend(posture)
        before, self._elbow_towards = self._elbow_towards, bend
        reach = self._hand.move(posture[TIP], backward, (1.0, 1.8))

        def during(time_s: float) -> None:
            reach.during(time_s)
            fraction = minimum_jerk(time_s / reach.duration_s)
            held = self.body.holding(self._hand.fingertip, self._hand.backward, before)
            held = self.body.holding(
                self._hand.fingertip, self._hand.backward, (1.0 - fraction) * _bend(held) + fraction * bend
            )
            self._posture = held + fraction**4 * (posture - held)

        yield Step(reach.duration_s, during)
        yield Step(float(self._draw.uniform(*RESTS_BEFORE_S)), during=lambda _: self.take(posture))

    def _perform(self, movement: PointingMovement, time_s: float) -> None:
        self.take(movement.at(time_s))
        self.at_target = movement.arrives_s <= time_s <= movement.leaves_s
        self.has_pointed = time_s >= movement.arrives_s


def _bend(posture: Floats) -> Floats:
    """Where the elbow is from the middle between shoulder and wrist, (3,)."""
    return np.asarray(posture[ELBOW] - 0.5 * (posture[SHOULDER] + posture[WRIST]))
