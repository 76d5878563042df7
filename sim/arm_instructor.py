"""An instructor with a whole arm, who points as people do: from the arm's base pose to the target and back."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats
from paramove.msgs.rule_pb2 import Speech
from sim import places, tool_box
from sim.hand_path import minimum_jerk
from sim.instructor import Instructor, Script, Step
from sim.sights import Table
from sim.small_person import POINTED_ABOVE_PLANE, PointingMovement, SmallPerson

SHOULDER, ELBOW, WRIST, TIP = range(4)
SEATED_S = 4.0
RESTS_BEFORE_S = (1.0, 1.6)
RESTS_AFTER_S = (0.4, 0.7)


class ArmInstructor(Instructor):
    """An `Instructor` whose shoulder, elbow and wrist are known too.

    Args:
        table, rules, draws: See `Instructor`.
        person: Who it is.
        draw: Of how the person points each time.

    Attributes:
        target: Place that is being pointed at, (3,), m, in the robot's shoulder frame; None while none is.
        pointings: How many were begun.
        at_target: Whether the fingertip is at the target.
    """

    def __init__(
        self,
        table: Table,
        rules: dict[str, str],
        draws: dict[str, np.random.Generator],
        person: SmallPerson,
        draw: np.random.Generator,
    ) -> None:
        self.person = person
        self._draw = draw
        self.target: Floats | None = None
        self.pointings = 0
        self.at_target = False
        self._has_pointed = False
        self._posture: Floats | None = None
        self._elbow_towards: Floats | None = None
        super().__init__(table, rules, draws)
        self._script = self._begin_seated()

    @property
    def posture(self) -> Floats:
        """Shoulder, elbow, wrist, tip of the index finger, (4, 3), m, in the robot's shoulder frame."""
        if self._posture is not None:
            return self._posture
        return self.person.holding(self._fingertip, self._backward, self._elbow_towards)

    def handle(self, request: int, name: str = "") -> None:
        """See `Instructor.handle`. A request that comes while the arm withdraws is answered by pointing again."""
        again = (request, name)
        if self._has_pointed and request == Speech.REQUEST_POINT_AT_OBJECT and again not in self._waiting:
            self._waiting.append(again)
        super().handle(request, name)

    def _point(self, requested: str) -> Script:
        self._has_pointed = False
        yield from super()._point(requested)
        self._has_pointed = False

    def point_at_place(self, place: ArrayLike) -> Script:
        """The person sits down with a hanging arm, points at a place (3,), m, shoulder frame, and lets the arm hang."""
        target = np.asarray(place, dtype=np.float64)
        movement = self.person.points_at(target, self._draw)
        yield from self._hang(movement.postures[0])
        self.target, self.pointings = target, self.pointings + 1
        self._acknowledged = False
        yield Step(movement.duration_s, during=lambda time_s: self._perform(movement, time_s))
        self.target, self.at_target = None, False
        yield Step(float(self._draw.uniform(*RESTS_AFTER_S)))
        self._posture = None

    def _begin_seated(self) -> Script:
        """At first the person sits with a hanging arm, as whoever wants to be tracked does."""
        middle = (*np.mean((places.STRIP_X, places.STRIP_Y), axis=1), tool_box.SURFACE_Z + POINTED_ABOVE_PLANE)
        hanging = self.person.points_at(middle, self._draw).postures[0]
        yield Step(SEATED_S, during=lambda _: self._take(hanging))
        self._posture = None
        yield from self._withdraw()

    def _point_at(self, name: str) -> Script:
        x, y, _ = self._table.position(name)
        yield from self.point_at_place((x, y, tool_box.SURFACE_Z + POINTED_ABOVE_PLANE))

    def _hang(self, posture: Floats) -> Script:
        """The arm goes to a posture (4, 3) and rests there."""
        backward = (posture[WRIST] - posture[TIP]) / np.linalg.norm(posture[WRIST] - posture[TIP])
        bend = posture[ELBOW] - 0.5 * (posture[SHOULDER] + posture[WRIST])
        before, self._elbow_towards = self._elbow_towards, bend
        reach = self._move(posture[TIP], backward, (1.0, 1.8))

        def during(time_s: float) -> None:
            reach.during(time_s)
            fraction = minimum_jerk(time_s / reach.duration_s)
            held = self.person.holding(self._fingertip, self._backward, before)
            usual = held[ELBOW] - 0.5 * (held[SHOULDER] + held[WRIST])
            towards = (1.0 - fraction) * usual + fraction * bend
            held = self.person.holding(self._fingertip, self._backward, towards)
            self._posture = held + fraction**4 * (posture - held)

        yield Step(reach.duration_s, during)
        yield Step(float(self._draw.uniform(*RESTS_BEFORE_S)), during=lambda _: self._take(posture))

    def _perform(self, movement: PointingMovement, time_s: float) -> None:
        self._take(movement.at(time_s))
        self.at_target = movement.arrives_s <= time_s <= movement.leaves_s
        self._has_pointed = time_s >= movement.arrives_s

    def _take(self, posture: Floats) -> None:
        self._posture = posture
        backward = posture[WRIST] - posture[TIP]
        self._fingertip, self._backward = posture[TIP], backward / np.linalg.norm(backward)
        self._table.move_hand(self._fingertip, self._backward)
