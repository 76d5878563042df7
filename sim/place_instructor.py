"""An instructor who points at free positions of the robot's working area, one after the other, as the robot asks."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from paramove.demonstrations import table_place
from paramove.documents import Floats
from paramove.msgs.rule_pb2 import Speech
from sim import tool_box
from sim.arm import Arm
from sim.hand import Hand, Script, Step
from sim.person import Person
from sim.places import START
from sim.sights import Sights, Table
from sim.small_person import POINTED_ABOVE_PLANE, SCALE, SmallPerson, table_from_shoulder

OBJECT = "yellow"
AREA_X, AREA_Y = (0.130, 0.186), (-0.100, 0.065)
"""Targets are this far inside the robot's working area, m, shoulder frame."""
FREE_OF_ROBOT = 0.07
"""Horizontal distance between the fingertip and the robot's gripper, m."""
ANOTHER_PLACE = 0.04
"""Distance of the next target from the object's last position, m."""
SAME_PLACE_AT_MOST = 2
WITHIN_SHARE = 0.04
"""No target lies on the outermost part of the 80 x 30 cm of the table where people demonstrate pointing."""


class PlaceInstructor(Person):
    """See `Person`. After a failed recognition points at the same target again, then at another one.

    Args:
        table: The table that the person sees and moves the object on.
        draws: Generators for `places`, `paths`.
        body: Whose arm it is.
        pointing: Of how the arm points each time.
    """

    arm: Arm

    def __init__(
        self, table: Table, draws: dict[str, np.random.Generator], body: SmallPerson, pointing: np.random.Generator
    ) -> None:
        hand = Hand(table, Sights(table, {}), draws["paths"])
        super().__init__(table, hand, Arm(hand, body, pointing))
        self._places = draws["places"]
        self._place: Floats | None = None
        self._shown = 0
        self._stood = np.array(START)

    @property
    def scripts(self) -> Mapping[int, Callable[[str], Script]]:
        """See `Person.scripts`."""
        return {
            Speech.REQUEST_POINT_AT_PLACE: self._point_at_free_place,
            Speech.REQUEST_POINT_AT_OBJECT: self._point_at_object,
            Speech.REQUEST_HELP: self._help,
            Speech.REQUEST_THANK_YOU: self.end,
        }

    def begin(self) -> Script:
        """The person sits with a hanging arm, and so it stays between two pointings."""
        self.arm.hang_at_once(self.arm.hanging_before((*START, tool_box.SURFACE_Z + POINTED_ABOVE_PLANE)))
        self._hanging = self.arm.posture
        yield Step(0.1)

    def withdraw(self) -> Script:
        """The arm hangs again as after the last pointing."""
        yield from self.arm.hang(self._hanging)

    def handle(self, request: int, name: str = "") -> None:
        """See `Person.handle`. What is acknowledged is understood: the object will stand there."""
        if request == Speech.REQUEST_UNSPECIFIED and self.arm.has_pointed and self._place is not None:
            self._stood, self._place = self._place, None
        super().handle(request, name)

    def _point_at_object(self, _: str) -> Script:
        self.doing = f"points at {OBJECT}"
        yield from self._point_above(self.table.position(OBJECT)[:2])

    def _point_at_free_place(self, _: str) -> Script:
        if self._place is None or self._shown >= SAME_PLACE_AT_MOST:
            self._place, self._shown = self._free_place(), 0
        self._shown += 1
        self.doing = "points at ({:.1f}, {:.1f}) cm".format(*(100 * self._place))
        yield from self._point_above(self._place)

    def _point_above(self, place: Floats) -> Script:
        """Point at a place (2,) and let the arm hang again."""
        yield from self.arm.point_at((*place, tool_box.SURFACE_Z + POINTED_ABOVE_PLANE))
        self._hanging = self.arm.posture

    def _help(self, _: str) -> Script:
        self.arm.follow_hand()
        self.doing = f"stands {OBJECT} at its start"
        self._stood, self._place = np.array(START), None
        yield from self.hand.bring(OBJECT, self._stood)
        yield from self.withdraw()

    def _free_place(self) -> Floats:
        """Another target in the working area, which the person can point at and away from the robot's hand."""
        gripper = self.table.gripper()[0][:2]
        for _ in range(10_000):
            place = np.array([self._places.uniform(*AREA_X), self._places.uniform(*AREA_Y)])
            free = np.linalg.norm(place - gripper) >= FREE_OF_ROBOT
            another = np.linalg.norm(place - self._stood) >= ANOTHER_PLACE
            if free and another and where_people_point(place):
                return place
        raise RuntimeError(f"no free place in {AREA_X} x {AREA_Y} m with the robot's hand at {gripper}")


def where_people_point(place: Floats) -> bool:
    """Whether a position (2,), m, shoulder frame, lies on the part of the table where people demonstrate pointing."""
    x, y, _ = table_from_shoulder([*place, tool_box.SURFACE_Z]) / SCALE
    (low_x, high_y, _), (high_x, low_y, _) = table_place([[0.0, 0.0], [1.0, 1.0]])
    inside = WITHIN_SHARE * (high_x - low_x), WITHIN_SHARE * (high_y - low_y)
    return bool(low_x + inside[0] <= x <= high_x - inside[0] and low_y + inside[1] <= y <= high_y - inside[1])
