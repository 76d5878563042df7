"""The instructor: a person who hands over objects, shows the rules and points, as the robot asks.

A request is answered by a script: a list of moves, grasps and pauses, made one after the other as the person sees the
table at that time. The person sees the true world, never the robot's estimates.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from paramove.documents import Floats
from paramove.msgs.rule_pb2 import Speech
from sim import places, tool_box
from sim.hand_path import HandPath, minimum_jerk, natural_bulge
from sim.sights import Sights, Table

FROM_ABOVE = np.array((0.20, -0.50, 0.84))  # backward direction of the hand that holds something by its top
AT_REST = np.array((0.20, -0.80, 0.55))
BOX_PULLED, BOX_LIFTED = 0.26, 0.13  # m: away from the robot's arm before it is turned
ABOVE = 0.07  # the fingertip waits so far above a top
TRAVEL_Z = tool_box.SURFACE_Z + 0.085  # centre of a carried cylinder: over standing ones
SHOWN_LIFT = 0.025
ASIDE_IN_HAND = 0.004  # from the gripper's centre towards the thumb: between pads and open thumb
AHEAD_IN_HAND = 0.0025  # and towards the fingertips: the upright object must pass the palm of the sloping hand
OVER_THE_ARM = 0.13  # a handed object comes from so high above its place in the robot's hand
POINTING_S = 4.0


@dataclass
class Step:
    """A part of a script.

    Attributes:
        duration_s: How long it takes.
        during: Called with the time since its start, s, up to and including `duration_s`.
        until: Ends it early.
    """

    duration_s: float
    during: Callable[[float], None] = lambda _: None
    until: Callable[[], bool] = lambda: False


Script = Iterator[Step]


class Instructor:
    """One person with one hand.

    Args:
        table: The table that the person sees and moves things on.
        rules: Colour -> name of its opening.
        draws: Generators for `places`, `order`, `paths`.

    Attributes:
        doing: The person's action as text.
        finished: Whether the robot has said thank you.
        pointed_at: Colour that is being pointed at, or was last.
    """

    def __init__(self, table: Table, rules: dict[str, str], draws: dict[str, np.random.Generator]) -> None:
        self._table = table
        openings = {item.name: item for item in tool_box.OPENINGS}
        self._opening = {colour: openings[name] for colour, name in rules.items()}
        self._sees = Sights(table, self._opening)
        self._places, self._order, self._paths = draws["places"], draws["order"], draws["paths"]
        self._fingertip = places.IDLE_FINGERTIP.copy()
        self._backward = AT_REST
        self._waiting: deque[tuple[int, str]] = deque()
        self._script: Script = iter(())
        self._step: Step | None = None
        self._step_s = 0.0
        self._request: tuple[int, str] | None = None
        self._acknowledged = False
        self._arranged = False
        self._to_point: list[str] = []
        self.doing = "waits"
        self.finished = False
        self.pointed_at = ""
        table.move_hand(self._fingertip, self._backward)

    @property
    def busy(self) -> bool:
        """Whether a request is being answered or waits."""
        return self._step is not None or bool(self._waiting)

    def handle(self, request: int, name: str = "") -> None:
        """Handle a request of the robot. One that is being answered or already waits is ignored.

        Args:
            request: Of `Speech.Request`; any other value acknowledges what the hand points at.
            name: Colour, or "".
        """
        self._acknowledged = True
        if request not in self._scripts() or (request, name) in self._waiting:
            return
        if self._step is not None and self._request == (request, name):
            return
        self._waiting.append((request, name))

    def advance(self, duration_s: float) -> None:
        """Let time pass: a millisecond, or any other time."""
        left_s = duration_s
        while left_s > 1e-12:
            if self._step is None and not self._next_step():
                return
            assert self._step is not None
            passed_s = min(left_s, self._step.duration_s - self._step_s)
            self._step_s += passed_s
            left_s -= passed_s
            self._step.during(self._step_s)
            if self._step_s >= self._step.duration_s - 1e-12 or self._step.until():
                self._next_step()

    # -- scripts ----------------------------------------------------------------------------------------------------

    def _scripts(self) -> dict[int, Callable[[str], Script]]:
        return {
            Speech.REQUEST_HAND_ME_AN_OBJECT: self._hand_over,
            Speech.REQUEST_LET_GO: self._let_go,
            Speech.REQUEST_SHOW_RULES: self._show_rules,
            Speech.REQUEST_SHOW_RULE_AGAIN: self._show_again,
            Speech.REQUEST_POINT_AT_OBJECT: self._point,
            Speech.REQUEST_HELP: self._help,
            Speech.REQUEST_THANK_YOU: self._end,
        }

    def _next_step(self) -> bool:
        self._step_s = 0.0
        self._step = next(self._script, None)
        while self._step is None and self._waiting:
            self._request = self._waiting.popleft()
            self._script = self._scripts()[self._request[0]](self._request[1])
            self._step = next(self._script, None)
        if self._step is None and self._table.held_by_instructor is None:
            self.doing = "waits"
        return self._step is not None

    def _hand_over(self, name: str) -> Script:
        held = self._table.held_by_instructor
        if held is None:
            held = name or self._to_hand_over()
            self.doing = f"fetches {held}"
            yield from self._pick_up(held)
        else:  # requested again: out of the hand and in anew, which also shows the robot that something happens
            yield self._move(_raised(self._fingertip, ABOVE), seconds=(0.6, 0.9), straight=True)
        self.doing = f"brings {held} to the robot's hand"
        yield self._move(self._into_hand(OVER_THE_ARM), seconds=(1.0, 2.4))
        self.doing = f"holds {held} in the robot's hand"
        yield self._move(self._into_hand(0.0), seconds=(1.0, 1.5), straight=True)

    def _let_go(self, _: str) -> Script:
        if self._table.held_by_instructor is None:
            return
        self.doing = "lets go"
        yield from self._put_down()
        yield from self._withdraw()

    def _show_rules(self, _: str) -> Script:
        yield from self._empty_hand()
        for colour in tool_box.COLOURS:
            if not self._sees.is_parked(colour):
                yield from self._take_away(colour)
        yield from self._turn_box()
        for place in self._order.permutation(len(tool_box.COLOURS)):
            yield from self._show(tool_box.COLOURS[place])

    def _show_again(self, name: str) -> Script:
        yield from self._empty_hand()
        if name not in self._opening:
            return
        yield from self._turn_box()
        yield from self._show(name)

    def _point(self, requested: str) -> Script:
        yield from self._empty_hand()
        if not self._arranged:
            self._arranged = True
            yield from self._arrange()
        name = self._next_to_point(requested)
        if name is None:
            self.doing = "sees nothing left to do"
            yield Step(1.0)
            return
        self.doing, self.pointed_at = f"points at {name}", name
        yield from self._point_at(name)
        yield from self._withdraw()

    def _point_at(self, name: str) -> Script:
        """The hand goes to a cylinder, stays until the robot has understood, and leaves it a little."""
        fingertip, backward = self._sees.pointing_pose(name, self._paths)
        yield self._move(fingertip + 0.05 * backward / np.linalg.norm(backward), backward, (1.0, 2.0))
        yield self._move(fingertip, backward, (0.5, 0.8), straight=True)
        self._acknowledged = False
        yield Step(POINTING_S, until=lambda: self._acknowledged)
        yield self._move(fingertip + 0.06 * backward / np.linalg.norm(backward), backward, (0.4, 0.7), straight=True)

    def _help(self, name: str) -> Script:
        yield from self._empty_hand()
        if name not in self._opening:
            return
        self.doing = f"stands {name} up at another place"
        others = [
            self._table.position(other)[:2] for other in tool_box.COLOURS if other != name and self._sees.stands(other)
        ]
        yield from self._bring(name, places.draw_place(self._places, others))
        yield from self._withdraw()

    def _end(self, _: str) -> Script:
        self.finished = True
        yield from self._empty_hand()
        yield from self._withdraw()
        self.doing = "has finished"

    # -- parts of scripts -------------------------------------------------------------------------------------------

    def _show(self, name: str) -> Script:
        self.doing = f"shows {name} in view"
        if not self._sees.stands(name):
            yield from self._bring(name, places.draw_place(self._places, []))
            yield from self._withdraw()
            yield Step(1.5)
        self.doing = f"puts {name} into its opening"
        opening = self._opening[name]
        yield from self._pick_up(name, lift=SHOWN_LIFT + self._paths.uniform(-0.003, 0.005))
        target = opening.centre + np.array((*self._paths.normal(0.0, 0.001, 2), 0.0))
        height = tool_box.CYLINDER_HALF_HEIGHT + SHOWN_LIFT
        yield self._move(self._tip_over(target, height), seconds=(1.0, 2.2), rise=False)
        yield self._move(
            self._tip_over(target, tool_box.CYLINDER_HALF_HEIGHT - 0.010), seconds=(0.8, 1.2), straight=True
        )
        yield from self._put_down()
        yield from self._withdraw()
        yield Step(1.5)

    def _arrange(self) -> Script:
        for colour in tool_box.COLOURS:
            if self._sees.stands(colour):
                yield from self._take_away(colour)
        layout, _ = places.draw_layout(self._places, len(tool_box.COLOURS))
        for place in self._order.permutation(len(tool_box.COLOURS)):
            self.doing = f"stands {tool_box.COLOURS[place]} at a new place"
            yield from self._bring(tool_box.COLOURS[place], layout[place])
        yield from self._withdraw()
        yield Step(1.5)

    def _bring(self, name: str, place: Floats) -> Script:
        """Fetch a cylinder from wherever it is and stand it at `place` [2] on the working plane."""
        yield from self._pick_up(name)
        centre = tool_box.standing_centre(*place)
        yield self._move(self._tip_over(centre, TRAVEL_Z - centre[2]), seconds=(1.2, 2.6))
        yield self._move(self._tip_over(centre, 0.0005), seconds=(0.7, 1.0), straight=True)
        yield Step(0.3)
        yield from self._put_down()

    def _take_away(self, name: str) -> Script:
        self.doing = f"takes {name} away"
        yield from self._pick_up(name)
        yield from self._park(name)

    def _park(self, name: str) -> Script:
        """Carry what is held to its place out of sight."""
        place = places.PARKED[tool_box.COLOURS.index(name)]
        yield self._move(self._tip_over(place, TRAVEL_Z - place[2]), seconds=(1.2, 2.6))
        yield self._move(self._tip_over(place, 0.0005), seconds=(0.7, 1.0), straight=True)
        yield Step(0.3)
        yield from self._put_down()

    def _pick_up(self, name: str, lift: float | None = None) -> Script:
        """Grasp a cylinder by its top and lift it by `lift`, or to the height of travel; it hangs upright then."""
        top = self._sees.top_of(name)
        yield self._move(_raised(top, ABOVE), FROM_ABOVE, (1.0, 2.0))
        yield self._move(self._sees.top_of(name), FROM_ABOVE, (0.6, 0.9), straight=True)
        self._table.grasp(name)
        yield Step(0.1)
        rise = TRAVEL_Z - self._table.position(name)[2] if lift is None else lift
        yield self._move(_raised(self._fingertip, max(0.0, rise)), seconds=(0.6, 1.0), straight=True, upright=True)

    def _put_down(self) -> Script:
        """Let go of what is held and raise the hand."""
        yield Step(0.1)
        self._table.release()
        yield Step(0.15)
        yield self._move(_raised(self._fingertip, ABOVE), seconds=(0.5, 0.8), straight=True)

    def _withdraw(self) -> Script:
        yield self._move(places.IDLE_FINGERTIP, AT_REST, (1.0, 1.8))

    def _turn_box(self) -> Script:
        if self._table.openings_up():
            return
        self.doing = "turns the box"
        front = np.array((tool_box.X_RANGE[1], tool_box.CENTRE[1], tool_box.CENTRE[2]))  # on the axis of the turn
        yield self._move(front, np.array((0.8, -0.4, 0.4)), (1.2, 1.6))
        yield Step(3.2, during=lambda time_s: self._carry_box(front, time_s / 3.2))
        yield from self._withdraw()

    def _carry_box(self, front: Floats, phase: float) -> None:
        away = minimum_jerk(phase / 0.35) - minimum_jerk((phase - 0.65) / 0.35)
        up = minimum_jerk((phase - 0.15) / 0.25) - minimum_jerk((phase - 0.60) / 0.25)
        angle = np.pi * (1 - minimum_jerk((phase - 0.30) / 0.40))
        offset = np.array((BOX_PULLED * away, 0.0, BOX_LIFTED * up))
        self._table.move_box(offset, (np.cos(angle / 2), np.sin(angle / 2), 0.0, 0.0))
        self._fingertip = front + offset
        self._table.move_hand(self._fingertip, self._backward)

    def _empty_hand(self) -> Script:
        """A new task begins: what is still held is put away."""
        held = self._table.held_by_instructor
        if held is not None:
            self.doing = f"takes {held} away"
            yield self._move(_raised(self._fingertip, ABOVE), seconds=(0.6, 0.9), straight=True)
            yield from self._park(held)

    # -- moves and places -------------------------------------------------------------------------------------------

    def _move(
        self,
        goal: Floats,
        backward: Floats | None = None,
        seconds: tuple[float, float] = (1.0, 3.0),
        straight: bool = False,
        upright: bool = False,
        rise: bool = True,
    ) -> Step:
        """Move the fingertip to `goal`; `upright` turns what is held upright on the way."""
        start, back = self._fingertip, self._backward
        duration_s = float(self._paths.uniform(*seconds))
        bulge = np.zeros(3) if straight else natural_bulge(self._paths, start, goal)
        if not rise:
            bulge[2] = 0.0
        path = HandPath(start, np.asarray(goal), back, back if backward is None else backward, bulge, duration_s)

        def during(time_s: float) -> None:
            self._fingertip, self._backward = path.at(time_s)
            self._table.move_hand(self._fingertip, self._backward)
            if upright:
                self._table.straighten(minimum_jerk(time_s / duration_s))

        return Step(duration_s, during)

    def _tip_over(self, point: Floats, height: float) -> Floats:
        """Fingertip when the held cylinder's centre is `height` over `point`."""
        return _raised(point, height + tool_box.CYLINDER_HALF_HEIGHT)

    def _into_hand(self, above: float) -> Floats:
        """Fingertip when the held cylinder stands in the robot's open hand, or `above` it."""
        gripper, rotation = self._table.gripper()
        centre = gripper + ASIDE_IN_HAND * rotation[:, 1] + AHEAD_IN_HAND * rotation[:, 0]
        centre[:2] += self._paths.normal(0.0, 0.0007, 2)
        centre[2] = gripper[2] - self._paths.uniform(0.009, 0.011)
        return self._tip_over(centre, above)

    # -- what to take next --------------------------------------------------------------------------------------------

    def _to_hand_over(self) -> str:
        """A cylinder on the box if there is one, else a parked one."""
        on_box = [colour for colour in tool_box.COLOURS if self._sees.stands(colour)]
        candidates = (
            on_box or [colour for colour in tool_box.COLOURS if self._sees.is_parked(colour)] or tool_box.COLOURS
        )
        return candidates[int(self._order.integers(len(candidates)))]

    def _next_to_point(self, requested: str) -> str | None:
        left = [colour for colour in tool_box.COLOURS if not self._sees.is_done(colour)]
        self._to_point = [colour for colour in self._to_point if colour in left]
        if not self._to_point:
            self._to_point = [left[place] for place in self._order.permutation(len(left))]
        if requested in left:  # the robot asks for it because it stands in the way of the last one
            self._to_point = [requested, *(colour for colour in left if colour != requested)]
        return self._to_point.pop(0) if self._to_point else None


def _raised(point: Floats, height: float) -> Floats:
    return np.asarray(point + np.array((0.0, 0.0, height)))
