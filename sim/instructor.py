"""The instructor: a person who hands over objects, shows the rules and points at objects."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from paramove.documents import Floats
from paramove.msgs.rule_pb2 import Speech
from sim import places, tool_box
from sim.arm import Arm
from sim.hand import Hand, Script, Step
from sim.hand_path import minimum_jerk
from sim.mishaps import Mishaps
from sim.person import Person
from sim.sights import Sights, Table
from sim.small_person import POINTED_ABOVE_PLANE, SmallPerson

BOX_PULLED, BOX_LIFTED = 0.26, 0.13  # m: away from the robot's arm before it is turned
SHOWN_LIFT = 0.025
ASIDE_IN_HAND = 0.004  # from the gripper's centre towards the thumb: between pads and open thumb
AHEAD_IN_HAND = 0.0025  # and towards the fingertips: the upright object must pass the palm of the sloping hand
OVER_THE_ARM = 0.13  # a handed object comes from so high above its place in the robot's hand
POINTING_S = 4.0
SEATED_S = 4.0


class Instructor(Person):
    """See `Person`.

    Args:
        table: The table that the person sees and moves things on.
        rules: Colour -> name of its opening.
        draws: Generators for `places`, `order`, `paths`.
        body: Whose arm moves with the hand, and points as people do; None: a hand alone, which points from nearby.
        pointing: Of how that arm points each time.
        mishaps: What goes wrong; None: nothing.

    Attributes:
        pointed_at: Colour that is being pointed at, or was last.
        arranged: Whether the objects stand where the robot shall find them.
    """

    def __init__(
        self,
        table: Table,
        rules: dict[str, str],
        draws: dict[str, np.random.Generator],
        body: SmallPerson | None = None,
        pointing: np.random.Generator | None = None,
        mishaps: Mishaps | None = None,
    ) -> None:
        openings = {item.name: item for item in tool_box.OPENINGS}
        self._opening = {colour: openings[name] for colour, name in rules.items()}
        self._sees = Sights(table, self._opening)
        self._places, self._order, self._paths = draws["places"], draws["order"], draws["paths"]
        hand = Hand(table, self._sees, self._paths)
        super().__init__(table, hand, Arm(hand, body, pointing) if body is not None and pointing is not None else None)
        self._mishaps = mishaps
        self._to_point: list[str] = []
        self.pointed_at = ""
        self.arranged = False

    @property
    def scripts(self) -> Mapping[int, Callable[[str], Script]]:
        """See `Person.scripts`."""
        return {
            Speech.REQUEST_HAND_ME_AN_OBJECT: self._hand_over,
            Speech.REQUEST_LET_GO: self._let_go,
            Speech.REQUEST_STAND_OBJECT_AT_START: self._stand_at_start,
            Speech.REQUEST_SHOW_RULES: self._show_rules,
            Speech.REQUEST_SHOW_RULE_AGAIN: self._show_again,
            Speech.REQUEST_POINT_AT_OBJECT: self._point,
            Speech.REQUEST_HELP: self._help,
            Speech.REQUEST_THANK_YOU: self.end,
        }

    def begin(self) -> Script:
        """At first a person with an arm sits with it hanging, as whoever wants to be tracked does."""
        if self.arm is None:
            return
        middle = (*np.mean((places.STRIP_X, places.STRIP_Y), axis=1), tool_box.SURFACE_Z + POINTED_ABOVE_PLANE)
        arm, hanging = self.arm, self.arm.hanging_before(middle)
        yield Step(SEATED_S, during=lambda _: arm.take(hanging))
        arm.follow_hand()
        yield from self.withdraw()

    # -- scripts ----------------------------------------------------------------------------------------------------

    def _hand_over(self, name: str) -> Script:
        yield from self._clear_the_box()
        held = self.table.held_by_instructor
        if held is None:
            held = name or self._to_hand_over()
            self.doing = f"fetches {held}"
            yield from self.hand.pick_up(held)
        else:  # requested again: out of the hand and in anew, which also shows the robot that something happens
            yield self.hand.rise()
        self.doing = f"brings {held} to the robot's hand"
        yield self.hand.move(self._into_hand(OVER_THE_ARM), seconds=(1.0, 2.4))
        self.doing = f"holds {held} in the robot's hand"
        yield self.hand.move(self._into_hand(0.0), seconds=(1.0, 1.5), straight=True)

    def _stand_at_start(self, _: str) -> Script:
        yield from self._clear_the_box()
        name = self._to_hand_over()
        self.doing = f"stands {name} at the mark"
        moved = np.zeros(3) if self._mishaps is None else self._mishaps.base_moved
        yield from self.hand.bring(name, np.array(places.START) + moved[:2])
        yield from self.withdraw()

    def _let_go(self, _: str) -> Script:
        if self.table.held_by_instructor is None:
            return
        self.doing = "lets go"
        yield from self.hand.put_down()
        yield from self.withdraw()

    def _show_rules(self, _: str) -> Script:
        yield from self._take_all_away()
        yield from self._turn_box()
        for place in self._order.permutation(len(tool_box.COLOURS)):
            yield from self._show(tool_box.COLOURS[place])

    def _show_again(self, name: str) -> Script:
        yield from self.empty_hand()
        if name not in self._opening:
            return
        if not self.table.openings_up():
            yield from self._turn_box()
        yield from self._show(name)

    def _point(self, requested: str) -> Script:
        yield from self.empty_hand()
        if not self.arranged:
            self.arranged = True
            yield from self._arrange()
        name = self._next_to_point(requested)
        if name is None:
            self.doing = "sees nothing left to do"
            yield Step(1.0)
            return
        if self._mishaps is not None:
            yield from self._mishaps.strike(name, self.hand)
        self.doing, self.pointed_at = f"points at {name}", name
        if self.arm is None:
            yield from self._point_from_nearby(name)
        else:
            x, y, _ = self.table.position(name)
            yield from self.arm.point_at((x, y, tool_box.SURFACE_Z + POINTED_ABOVE_PLANE))
            self.arm.follow_hand()
        if self._mishaps is not None:
            yield Step(self._mishaps.lingers_s)
        yield from self.withdraw()

    def _point_from_nearby(self, name: str) -> Script:
        """The hand goes to a cylinder, stays until the robot has understood, and leaves it a little."""
        fingertip, backward = self._sees.pointing_pose(name, self._paths)
        length = np.linalg.norm(backward)
        yield self.hand.move(fingertip + 0.05 * backward / length, backward, (1.0, 2.0))
        yield self.hand.move(fingertip, backward, (0.5, 0.8), straight=True)
        self.acknowledged = False
        yield Step(POINTING_S, until=lambda: self.acknowledged)
        yield self.hand.move(fingertip + 0.06 * backward / length, backward, (0.4, 0.7), straight=True)

    def _help(self, name: str) -> Script:
        yield from self.empty_hand()
        if name not in self._opening:
            return
        self.doing = f"stands {name} up at another place"
        others = [
            self.table.position(other)[:2] for other in tool_box.COLOURS if other != name and self._sees.stands(other)
        ]
        yield from self.hand.pick_up(name)
        if self._mishaps is not None:
            self._mishaps.fix()
        place, half_height = places.draw_place(self._places, others), self.table.shapes[name].half_height
        yield from self.hand.stand_at(tool_box.standing_centre(place[0], place[1], half_height))
        yield from self.withdraw()

    # -- parts of scripts -------------------------------------------------------------------------------------------

    def _show(self, name: str) -> Script:
        self.doing = f"shows {name} in view"
        if not self._sees.stands(name):
            yield from self.hand.bring(name, places.draw_place(self._places, []))
            yield from self.withdraw()
            yield Step(1.5)
        self.doing = f"puts {name} into its opening"
        opening = self._opening[name]
        yield from self.hand.pick_up(name, lift=SHOWN_LIFT + self._paths.uniform(-0.003, 0.005))
        target = opening.centre + np.array((*self._paths.normal(0.0, 0.001, 2), 0.0))
        half_height = self.table.shapes[name].half_height
        yield self.hand.move(self.hand.over(target, half_height + SHOWN_LIFT), seconds=(1.0, 2.2), rise=False)
        yield self.hand.move(self.hand.over(target, half_height - 0.010), seconds=(0.8, 1.2), straight=True)
        yield from self.hand.put_down()
        yield from self.withdraw()
        yield Step(1.5)

    def _arrange(self) -> Script:
        for colour in tool_box.COLOURS:
            if self._sees.stands(colour):
                yield from self._take_away(colour)
        layout, _ = places.draw_layout(self._places, len(tool_box.COLOURS))
        for place in self._order.permutation(len(tool_box.COLOURS)):
            self.doing = f"stands {tool_box.COLOURS[place]} at a new place"
            yield from self.hand.bring(tool_box.COLOURS[place], layout[place])
        yield from self.withdraw()
        yield Step(1.5)

    def _take_away(self, name: str) -> Script:
        self.doing = f"takes {name} away"
        yield from self.hand.pick_up(name)
        yield from self.hand.park(name)

    def _take_all_away(self) -> Script:
        yield from self.empty_hand()
        for colour in tool_box.COLOURS:
            if not self._sees.is_parked(colour):
                yield from self._take_away(colour)

    def _clear_the_box(self) -> Script:
        """The robot calibrates again."""
        if self.table.openings_up():
            yield from self._take_all_away()
            yield from self._turn_box()
            self.arranged = False

    def _turn_box(self) -> Script:
        self.doing = "turns the box"
        front = np.array((tool_box.X_RANGE[1], tool_box.CENTRE[1], tool_box.CENTRE[2]))  # on the axis of the turn
        yield self.hand.move(front, np.array((0.8, -0.4, 0.4)), (1.2, 1.6))
        up = self.table.openings_up()
        yield Step(3.2, during=lambda time_s: self._carry_box(front, time_s / 3.2, up))
        yield from self.withdraw()

    def _carry_box(self, front: Floats, phase: float, openings_up: bool) -> None:
        away = minimum_jerk(phase / 0.35) - minimum_jerk((phase - 0.65) / 0.35)
        up = minimum_jerk((phase - 0.15) / 0.25) - minimum_jerk((phase - 0.60) / 0.25)
        turned = minimum_jerk((phase - 0.30) / 0.40)
        angle = np.pi * (turned if openings_up else 1 - turned)
        offset = np.array((BOX_PULLED * away, 0.0, BOX_LIFTED * up))
        self.table.move_box(offset, (np.cos(angle / 2), np.sin(angle / 2), 0.0, 0.0))
        self.hand.place(front + offset, self.hand.backward)

    def _into_hand(self, above: float) -> Floats:
        """Fingertip when the held cylinder stands in the robot's open hand, or `above` it."""
        gripper, rotation = self.table.gripper()
        centre = gripper + ASIDE_IN_HAND * rotation[:, 1] + AHEAD_IN_HAND * rotation[:, 0]
        centre[:2] += self._paths.normal(0.0, 0.0007, 2)
        centre[2] = gripper[2] - self._paths.uniform(0.009, 0.011)
        return self.hand.over(centre, above)

    # -- what to take next --------------------------------------------------------------------------------------------

    def _to_hand_over(self) -> str:
        """An object on the box if there is one, else a parked one; one that does not lie, if there is one."""
        on_box = [colour for colour in tool_box.COLOURS if self._sees.stands(colour)]
        candidates = (
            on_box or [colour for colour in tool_box.COLOURS if self._sees.is_parked(colour)] or tool_box.COLOURS
        )
        upright = [colour for colour in candidates if self.table.shapes[colour].kind != "lying"]
        candidates = upright or candidates
        return candidates[int(self._order.integers(len(candidates)))]

    def _next_to_point(self, requested: str) -> str | None:
        left = [colour for colour in tool_box.COLOURS if not self._sees.is_done(colour)]
        self._to_point = [colour for colour in self._to_point if colour in left]
        if not self._to_point:
            self._to_point = [left[place] for place in self._order.permutation(len(left))]
        if requested in left:  # the robot asks for it because it stands in the way of the last one
            self._to_point = [requested, *(colour for colour in left if colour != requested)]
        return self._to_point.pop(0) if self._to_point else None
