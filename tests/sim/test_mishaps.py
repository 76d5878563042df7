"""What goes wrong on request, and what a person who helps puts right."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from paramove.robots.description import RobotDescription
from sim import looks, tool_box
from sim.hand import Hand
from sim.looks import Looks
from sim.mishaps import CAMERA_MOVED, CARD, CARD_AWAY, FAR, LINGERS_S, MISHAPS, Mishap, Mishaps, add_card
from sim.sights import Sights
from sim.world import World

NAME, OTHER = "yellow", "green"


class Scene:
    """A world in which one mishap happens to an object."""

    def __init__(self, description: RobotDescription, kind: Mishap) -> None:
        self.world = World(Looks.draw(0), description, [add_card])
        self.world.place(NAME, tool_box.standing_centre(0.175, 0.0))
        mujoco.mj_forward(self.world.model, self.world.data)
        self.before = self.features()
        rules = Looks.draw(0).rules
        sees = Sights(self.world, {})
        self.hand = Hand(self.world, sees, looks.streams(0)["paths"])
        self.mishaps = Mishaps(self.world, [kind], rules)
        self.opening = next(one for one in tool_box.OPENINGS if one.name == rules[NAME])
        self.steps = list(self.mishaps.strike(NAME, self.hand))

    def features(self) -> dict[Mishap, np.ndarray]:
        """What each mishap changes."""
        model = self.world.model
        geom = model.geom(NAME).id
        size = model.geom_size[geom]
        return {
            "slippery": np.append(model.geom_friction[geom], model.geom_priority[geom]),
            "two_of_one_colour": model.geom_rgba[model.geom(OTHER).id].copy(),
            "too_wide": size[:1].copy(),
            "too_tall": size[1:2].copy(),
            "fallen": self.world.data.joint(NAME).qpos[3:].copy(),
            "covered_opening": self.world.data.mocap_pos[model.body(CARD).mocapid[0]].copy(),
            "moved_camera": model.cam_pos[model.camera("camera").id].copy(),
            "moved_base": model.body_pos[model.body(self.world.mount.root).id].copy(),
        }

    def changed(self) -> list[Mishap]:
        return [kind for kind, now in self.features().items() if not np.array_equal(now, self.before[kind])]


CHANGES = [kind for kind in MISHAPS if kind not in ("hand_in_the_way", "out_of_reach")]


@pytest.mark.parametrize("kind", CHANGES)
def test_one_thing_changes_and_a_person_who_helps_puts_it_right(description: RobotDescription, kind: Mishap) -> None:
    scene = Scene(description, kind)
    assert scene.changed() == [kind]
    scene.mishaps.fix()
    stays = kind.startswith("moved") or kind == "fallen"
    assert scene.changed() == ([kind] if stays else []), "nobody knows where camera and base were; a hand stands it up"


@pytest.mark.parametrize("kind", MISHAPS)
def test_it_happens_once(description: RobotDescription, kind: Mishap) -> None:
    scene = Scene(description, kind)
    assert list(scene.mishaps.strike(NAME, scene.hand)) == []
    assert list(scene.mishaps.strike(OTHER, scene.hand)) == []
    assert scene.mishaps.lingers_s == 0.0


def test_what_is_changed(description: RobotDescription) -> None:
    def after(kind: Mishap) -> np.ndarray:
        return scene.features()[kind] / scene.before[kind]

    scene = Scene(description, "too_wide")
    np.testing.assert_allclose(after("too_wide"), 2.2)
    scene = Scene(description, "too_tall")
    np.testing.assert_allclose(after("too_tall"), 1.8)
    foot = scene.world.data.qpos[scene.world.model.joint(NAME).qposadr[0] + 2] - scene.features()["too_tall"][0]
    assert foot == pytest.approx(scene.world.world_from_shoulder[2] + tool_box.SURFACE_Z), "it still stands"
    scene = Scene(description, "moved_camera")
    np.testing.assert_allclose(scene.features()["moved_camera"] - scene.before["moved_camera"], CAMERA_MOVED)
    scene = Scene(description, "covered_opening")
    card = scene.features()["covered_opening"] - scene.world.world_from_shoulder
    np.testing.assert_allclose(card, (scene.opening.x, scene.opening.y, tool_box.SURFACE_Z + 0.001), atol=1e-12)
    np.testing.assert_allclose(scene.before["covered_opening"] - scene.world.world_from_shoulder, CARD_AWAY)


@pytest.mark.parametrize(("kind", "height"), [("too_wide", 0.025), ("too_tall", 0.045)])
def test_an_exchanged_object_stands(description: RobotDescription, kind: Mishap, height: float) -> None:
    scene = Scene(description, kind)
    for _ in range(300):
        scene.world.step()
    assert scene.world.position(NAME)[2] - tool_box.SURFACE_Z == pytest.approx(height, abs=1e-4)


def test_the_hand_brings_it_out_of_reach_or_stays(description: RobotDescription) -> None:
    scene = Scene(description, "out_of_reach")
    assert scene.steps
    scene = Scene(description, "hand_in_the_way")
    assert scene.mishaps.lingers_s == LINGERS_S
    assert all(
        low <= value <= high for value, (low, high) in zip(FAR, (tool_box.X_RANGE, tool_box.Y_RANGE), strict=True)
    )
