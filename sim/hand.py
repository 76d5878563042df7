"""A person's hand: moves like a hand, takes cylinders by their tops, stands them somewhere else."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from paramove.documents import Floats
from sim import places, tool_box
from sim.hand_path import HandPath, minimum_jerk, natural_bulge
from sim.sights import Sights, Table

FROM_ABOVE = np.array((0.20, -0.50, 0.84))  # backward direction of the hand that holds something by its top
AT_REST = np.array((0.20, -0.80, 0.55))
ABOVE = 0.07  # the fingertip waits so far above a top
TRAVEL_Z = tool_box.SURFACE_Z + 0.085  # centre of a carried cylinder: over standing ones


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


class Hand:
    """One hand. Positions in the robot's shoulder frame, m.

    Args:
        table: The table on which it moves things.
        sees: What its owner sees of the table.
        paths: Generator for paths and durations.

    Attributes:
        fingertip, backward: Where it is, and the direction from there to the wrist, (3,) each.
    """

    def __init__(self, table: Table, sees: Sights, paths: np.random.Generator) -> None:
        self._table, self._sees, self.paths = table, sees, paths
        self.fingertip = places.IDLE_FINGERTIP.copy()
        self.backward = AT_REST
        table.move_hand(self.fingertip, self.backward)

    def place(self, fingertip: Floats, backward: Floats) -> None:
        """Is there at once."""
        self.fingertip, self.backward = fingertip, backward
        self._table.move_hand(fingertip, backward)

    def move(
        self,
        goal: Floats,
        backward: Floats | None = None,
        seconds: tuple[float, float] = (1.0, 3.0),
        straight: bool = False,
        upright: bool = False,
        rise: bool = True,
    ) -> Step:
        """The fingertip goes to `goal`; `upright` turns what is held upright on the way."""
        start, back = self.fingertip, self.backward
        duration_s = float(self.paths.uniform(*seconds))
        bulge = np.zeros(3) if straight else natural_bulge(self.paths, start, goal)
        if not rise:
            bulge[2] = 0.0
        path = HandPath(start, np.asarray(goal), back, back if backward is None else backward, bulge, duration_s)

        def during(time_s: float) -> None:
            self.place(*path.at(time_s))
            if upright:
                self._table.straighten(minimum_jerk(time_s / duration_s))

        return Step(duration_s, during)

    def rise(self) -> Step:
        """Straight up, with what it holds."""
        return self.move(raised(self.fingertip, ABOVE), seconds=(0.6, 0.9), straight=True)

    def pick_up(self, name: str, lift: float | None = None) -> Script:
        """Grasp a cylinder by its top and lift it by `lift`, or to the height of travel; it hangs upright then."""
        top = self._sees.top_of(name)
        yield self.move(raised(top, ABOVE), FROM_ABOVE, (1.0, 2.0))
        yield self.move(self._sees.top_of(name), FROM_ABOVE, (0.6, 0.9), straight=True)
        self._table.grasp(name)
        yield Step(0.1)
        rise = TRAVEL_Z - self._table.position(name)[2] if lift is None else lift
        yield self.move(raised(self.fingertip, max(0.0, rise)), seconds=(0.6, 1.0), straight=True, upright=True)

    def over(self, point: Floats, height: float) -> Floats:
        """Fingertip when the centre of what is held is `height` over `point`."""
        held = self._table.held_by_instructor
        assert held is not None
        return raised(point, height + self._table.shapes[held].half_height)

    def put_down(self) -> Script:
        """Let go of what is held and raise the hand."""
        yield Step(0.1)
        self._table.release()
        yield Step(0.15)
        yield self.move(raised(self.fingertip, ABOVE), seconds=(0.5, 0.8), straight=True)

    def stand_at(self, centre: Floats) -> Script:
        """Carry what is held to where its centre is to be, and let go."""
        yield self.move(self.over(centre, TRAVEL_Z - centre[2]), seconds=(1.2, 2.6))
        yield self.move(self.over(centre, 0.0005), seconds=(0.7, 1.0), straight=True)
        yield Step(0.3)
        yield from self.put_down()

    def bring(self, name: str, place: Floats) -> Script:
        """Fetch a cylinder from wherever it is and stand it at `place` [2] on the working plane."""
        yield from self.pick_up(name)
        yield from self.stand_at(tool_box.standing_centre(place[0], place[1], self._table.shapes[name].half_height))

    def park(self, name: str) -> Script:
        """Carry what is held to its place out of sight."""
        yield from self.stand_at(places.PARKED[tool_box.COLOURS.index(name)])

    def withdraw(self) -> Script:
        """To where the robot's camera does not see it."""
        yield self.move(places.IDLE_FINGERTIP, AT_REST, (1.0, 1.8))


def raised(point: Floats, height: float) -> Floats:
    """The point so far above another one."""
    return np.asarray(point + np.array((0.0, 0.0, height)))
