"""What goes wrong at the table, for trying how a robot takes it: each once, before a person points at an object."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Literal, get_args

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats
from sim import scene, tool_box
from sim.hand import Hand, Script
from sim.world import World

Mishap = Literal[
    "hand_in_the_way",
    "out_of_reach",
    "slippery",
    "two_of_one_colour",
    "too_wide",
    "too_tall",
    "fallen",
    "covered_opening",
    "moved_camera",
    "moved_base",
]
MISHAPS: tuple[Mishap, ...] = get_args(Mishap)

LINGERS_S = 20.0
FAR = np.array((0.228, -0.150))
"""A corner of the box that a Koch does not reach, shoulder frame, m."""
CAMERA_MOVED, BASE_MOVED = np.array((0.025, 0.02, 0.0)), np.array((0.0, 0.03, 0.0))
"""m; sideways, the base still has the box before it."""
CARD = "card"
CARD_HALF = (0.022, 0.022, 0.001)
CARD_AWAY = np.array((0.0, -1.0, -0.5))


class Mishaps:
    """Those of one world.

    Args:
        world: Where they happen.
        kinds: One for each object that is pointed at, in order.
        rules: Colour -> name of the opening where it belongs.

    Attributes:
        lingers_s: How long the hand stays where it has pointed.
        base_moved: By how much the robot's base was, [3], m: a mark is measured from where it stands now.
    """

    def __init__(self, world: World, kinds: Sequence[Mishap], rules: Mapping[str, str]) -> None:
        self._world, self._rules = world, rules
        self._left = list(kinds)
        self._struck: set[str] = set()
        self._fixes: list[Callable[[], None]] = []
        self.lingers_s = 0.0
        self.base_moved = np.zeros(3)

    def strike(self, name: str, hand: Hand) -> Script:
        """The next one happens to an object that is pointed at for the first time."""
        self.lingers_s = 0.0
        if not self._left or name in self._struck:
            return
        self._struck.add(name)
        kind = self._left.pop(0)
        if kind == "hand_in_the_way":
            self.lingers_s = LINGERS_S
        elif kind == "out_of_reach":
            yield from hand.bring(name, FAR)
            yield from hand.withdraw()
        elif kind == "fallen":
            self._world.lay(name)
        elif kind == "covered_opening":
            self._cover(name)
        elif kind in ("moved_camera", "moved_base"):
            self._move(kind)
        else:
            self._change(kind, name)

    def fix(self) -> None:
        """The robot has asked for help: what a person can put right is right again."""
        while self._fixes:
            self._fixes.pop()()

    def _change(self, kind: Mishap, name: str) -> None:
        """An object is exchanged for another one."""
        model = self._world.model
        geom = model.geom(name)
        if kind == "slippery":  # also between fingers of another friction
            self._set(model.geom_friction, geom.id, (0.01, 0.0, 0.0))
            self._set(model.geom_priority, geom.id, 2)
        elif kind == "two_of_one_colour":
            other = next(one for one in tool_box.COLOURS if one not in self._struck)
            self._set(model.geom_rgba, model.geom(other).id, model.geom_rgba[geom.id].copy())
        else:
            wide, factors, half_height = kind == "too_wide", np.ones(3), self._world.shapes[name].half_height
            upright = 2 if geom.size[2] > 0 else 1  # MuJoCo's order: a block's width twice, a cylinder's radius
            factors[slice(upright) if wide else upright] = 2.2 if wide else 1.8
            self._set(model.geom_size, geom.id, factors * geom.size)
            self._set(model.geom_rbound, geom.id, 2.2 * model.geom_rbound[geom.id])
            self._set(model.geom_aabb, geom.id, 2.2 * model.geom_aabb[geom.id])
            bounds = model.body_bvhadr[geom.bodyid[0]]
            self._set(model.bvh_aabb, bounds, 2.2 * model.bvh_aabb[bounds])
            if not wide:
                x, y, z = self._world.position(name)
                self._world.place(name, np.array((x, y, z + 0.8 * half_height)))

    def _cover(self, name: str) -> None:
        card = self._world.model.body(CARD).mocapid[0]
        opening = next(one for one in tool_box.OPENINGS if one.name == self._rules[name])
        over = self._world.world_from_shoulder + opening.centre + (0.0, 0.0, CARD_HALF[2])
        self._set(self._world.data.mocap_pos, card, over)

    def _move(self, kind: Mishap) -> None:
        """Somebody pushed it; no one puts that right."""
        model = self._world.model
        if kind == "moved_camera":
            model.cam_pos[model.camera("camera").id] += CAMERA_MOVED
        else:
            model.body_pos[model.body(self._world.mount.root).id] += BASE_MOVED
            self.base_moved = BASE_MOVED

    def _set(self, array: Floats, row: int, value: ArrayLike) -> None:
        """Until it is fixed."""
        before = np.copy(array[row])
        array[row] = value
        self._fixes.append(lambda: array.__setitem__(row, before))


def add_card(spec: mujoco.MjSpec, world_from_shoulder: Floats) -> None:
    """What covers an opening; see `scene.Furnish`."""
    body = spec.worldbody.add_body(name=CARD, mocap=True, pos=world_from_shoulder + CARD_AWAY)
    body.add_geom(
        name=CARD, type=mujoco.mjtGeom.mjGEOM_BOX, size=CARD_HALF, rgba=scene.RGBA["box"], **scene.touchable()
    )
