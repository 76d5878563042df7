"""Counts what the robot touches and must not, and how deep it presses into objects. Looks at every physics step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray

from paramove.documents import Floats
from sim import tool_box

PAUSE_STEPS = 50  # a pair that parts for less than this is one contact
_NOTHING, _OBJECT, _ROBOT = 0, 1, 2


@dataclass
class ContactRecord:
    """Contacts since the start.

    Attributes:
        unwanted: Contacts begun between the robot and anything but the object it handles, itself included.
        unwanted_pairs: "a - b" -> how often.
        deepest: Largest penetration between robot and objects, m.
        touched: Objects that the robot touched in the latest step.
        present: Pairs of the robot in contact in the latest step.
    """

    unwanted: int = 0
    unwanted_pairs: dict[str, int] = field(default_factory=dict)
    deepest: float = 0.0
    touched: tuple[str, ...] = ()
    present: tuple[tuple[int, int], ...] = ()


class ContactWatch:
    """Classifies the contacts of a model. Geoms without a name are called by their body.

    Args:
        model: Of the world.
        root: The robot's first body.
        sides: Name of a geom or body -> side of the hand.
    """

    def __init__(self, model: mujoco.MjModel, root: str, sides: Mapping[str, str]) -> None:
        self.record = ContactRecord()
        self._names = [_name(model, geom) for geom in range(model.ngeom)]
        kind = np.full(model.ngeom, _NOTHING)
        kind[model.body_rootid[model.geom_bodyid] == model.body(root).id] = _ROBOT
        self._object_of: dict[int, str] = {}
        for colour in tool_box.COLOURS:
            geom = model.geom(colour).id
            kind[geom] = _OBJECT
            self._object_of[geom] = colour
        self._kind = kind
        self._side = {
            geom: side
            for geom in range(model.ngeom)
            for part, side in sides.items()
            if kind[geom] == _ROBOT and part in (self._names[geom], str(model.body(model.geom_bodyid[geom]).name))
        }
        self._last_seen: dict[tuple[int, int], int] = {}
        self._step = 0
        self._held: str | None = None

    def update(self, data: mujoco.MjData) -> ContactRecord:
        """Take in the contacts of the step just made."""
        self._step += 1
        record = self.record
        if data.ncon == 0:
            record.touched, record.present, self._held = (), (), None
            return record
        pairs = data.contact.geom
        kinds = self._kind[pairs]
        of_robot = np.flatnonzero((kinds == _ROBOT).any(axis=1))
        if of_robot.size == 0:
            record.touched, record.present, self._held = (), (), None
            return record
        self._take(pairs[of_robot], kinds[of_robot], data.contact.dist[of_robot])
        return record

    def name_of(self, pair: tuple[int, int]) -> str:
        """ "a - b", the robot's part first."""
        return f"{self._names[pair[0]]} - {self._names[pair[1]]}"

    def _take(self, pairs: NDArray[np.int32], kinds: NDArray[np.int_], dists: Floats) -> None:
        record = self.record
        present: set[tuple[int, int]] = set()
        sides: dict[str, set[str]] = {}
        for (first, second), (first_kind, _), dist in zip(pairs.tolist(), kinds.tolist(), dists.tolist(), strict=True):
            robot, other = (first, second) if first_kind == _ROBOT else (second, first)
            present.add((robot, other))
            touched = self._object_of.get(other)
            if touched is not None:
                sides.setdefault(touched, set()).add(self._side.get(robot, "other"))
                record.deepest = max(record.deepest, -dist)
        held = [name for name, touching in sides.items() if len(touching - {"other"}) > 1]
        if held:
            self._held = held[0]
        elif self._held not in sides:
            self._held = None
        for pair in sorted(present):
            if self._is_unwanted(pair) and self._step - self._last_seen.get(pair, -PAUSE_STEPS - 1) > PAUSE_STEPS:
                record.unwanted += 1
                name = self.name_of(pair)
                record.unwanted_pairs[name] = record.unwanted_pairs.get(name, 0) + 1
            self._last_seen[pair] = self._step
        record.touched = tuple(sorted(sides))
        record.present = tuple(sorted(present))

    def _is_unwanted(self, pair: tuple[int, int]) -> bool:
        """The hand may touch one object; with one in the hand, no other."""
        touched = self._object_of.get(pair[1])
        if touched is None or pair[0] not in self._side:
            return True
        return self._held is not None and touched != self._held


def _name(model: mujoco.MjModel, geom: int) -> str:
    return str(model.geom(geom).name or model.body(model.geom_bodyid[geom]).name)
