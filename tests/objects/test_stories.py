"""From rendered images to gestures: the instructor shows a rule and points (thesis 5.2.6, steps 3 and 4)."""

from typing import Any

import numpy as np
import pytest

from benchmarks.many_worlds import RESTS, View, tolerance
from paramove.msgs.gesture_pb2 import Gesture
from paramove.robots.description import RobotDescription
from sim import tool_box
from sim.scene import HOAP3
from sim.tool_box import Measures
from sim.world import OPENINGS_UP
from tests.objects.scene import CYLINDER_HEIGHT, CYLINDER_RADIUS, Look, Scene
from tests.objects.stories import OPENING, RIM_RADIUS, Story, segment, show_rule


@pytest.mark.parametrize(
    ("seed", "lowering_ticks", "drop"), [(0, 12, False), (1, 25, False), (2, 12, True), (5, 9, False)]
)
def test_a_shown_rule_is_located_within_four_millimetres(seed: int, lowering_ticks: int, drop: bool) -> None:
    draw = np.random.default_rng(seed)
    with Scene(Look.random(seed), seed, opening_radius=RIM_RADIUS) as scene:
        story = Story(scene)
        story.calibrate()
        start = (draw.uniform(0.13, 0.18), draw.uniform(-0.12, -0.07))
        show_rule(story, "blue", start, lowering_ticks, drop, yaw=draw.uniform(-0.6, 0.6))
    assert story.kinds("blue") == ["APPEARED", "MOVED", "VANISHED"]
    vanished = next(g for g in story.gestures if g.kind == Gesture.KIND_VANISHED)
    assert vanished.located
    assert np.hypot(vanished.x - OPENING[0], vanished.y - OPENING[1]) < 0.004
    moved = next(g for g in story.gestures if g.kind == Gesture.KIND_MOVED)
    assert abs(moved.width_m - 2 * CYLINDER_RADIUS) < 0.002
    assert abs(moved.height_m - CYLINDER_HEIGHT) < 0.006
    assert not moved.twin


def test_an_object_that_is_held_up_is_not_taken_for_a_larger_one() -> None:
    """A gripper pauses with it, nearer to the camera, for less time than one stands on the table."""
    start, up = (0.15, -0.05, CYLINDER_HEIGHT / 2), (0.14, 0.02, 0.11)
    with Scene(Look(), 0) as scene:
        story = Story(scene)
        story.calibrate()
        scene.stand("blue", *start[:2])
        story.step(40)
        for centre in segment(start, up, 12):
            scene.put("blue", tuple(centre))
            story.step()
        story.step(14)
    *_, moved, rested = (gesture for gesture in story.gestures if gesture.object == "blue")
    assert (moved.kind, rested.kind) == (Gesture.KIND_MOVED, Gesture.KIND_RESTED)
    np.testing.assert_allclose(rested.width_m, moved.width_m, rtol=0, atol=0.001)
    np.testing.assert_allclose(rested.height_m, moved.height_m, rtol=0, atol=0.003)


@pytest.mark.parametrize("seed", [3, 7])
def test_the_object_that_the_finger_is_near_is_pointed_at(seed: int) -> None:
    places = {"yellow": (0.14, -0.10), "green": (0.17, -0.03), "blue": (0.13, 0.05)}
    with Scene(Look.random(seed), seed) as scene:
        story = Story(scene)
        story.calibrate()
        for name, place in places.items():
            scene.stand(name, *place)
        story.step(12)
        x, y = places["green"]
        for centre in segment((0.40, 0.20, 0.12), (x + 0.085, y, 0.055), 20):
            scene.put("hand", tuple(centre))
            story.step()
        story.step(22)
    pointed = [g for g in story.gestures if g.kind == Gesture.KIND_POINTED_AT]
    assert [g.object for g in pointed] == ["green"]
    assert np.hypot(pointed[0].x - x, pointed[0].y - y) < 0.003


@pytest.fixture(scope="module")
def hoap3() -> RobotDescription:
    return RobotDescription.load(HOAP3)


@pytest.mark.parametrize(
    ("seed", "elevation_deg", "diameter_mm", "chamfer_mm"),
    [
        (0, 35, 25, 2),
        pytest.param(1, 35, 34, 8, marks=pytest.mark.long),
        pytest.param(3, 52, 28, 6, marks=pytest.mark.long),
        (6, 65, 25, 2),
        pytest.param(7, 65, 34, 8, marks=pytest.mark.long),
    ],
)
def test_rules_hold_whatever_camera_and_openings(
    seed: int, elevation_deg: float, diameter_mm: float, chamfer_mm: float, hoap3: RobotDescription
) -> None:
    """Nobody tells the robot of either: it sees from where the camera looks, and where the rims are.

    The extremes and a middle; `python -m benchmarks.many_worlds --measures drawn` looks at a hundred others.
    """
    measures = Measures(elevation_deg, diameter_mm / 2000, chamfer_mm / 1000)
    view = View(seed, hoap3, measures)
    try:
        assert view.calibrate(lambda: np.zeros(2)) == []
        view.park()
        view.world.move_box(np.zeros(3), OPENINGS_UP)
        view.see(RESTS)
        for place, (colour, name) in enumerate(view.looks.rules.items()):
            rule = view.show_rule(colour, np.array((0.175, 0.03 * place - 0.05)))
            opening = next(item for item in tool_box.OPENINGS if item.name == name)
            assert rule is not None
            assert np.linalg.norm(rule - opening.centre[:2]) < min(0.0045, tolerance(measures))
    finally:
        view.close()


@pytest.mark.parametrize(
    ("seed", "widths_mm", "heights_mm", "kinds"),
    [
        (4, (28, 25, 22), (28, 40, 50), ("block", "cylinder", "cylinder")),
        (0, (20, 30, 25), (20, 60, 25), ("block", "cylinder", "block")),
    ],
)
def test_blocks_and_objects_of_other_heights_are_located_and_measured(
    seed: int,
    widths_mm: tuple[int, int, int],
    heights_mm: tuple[int, int, int],
    kinds: tuple[Any, Any, Any],
    hoap3: RobotDescription,
) -> None:
    """Blue calibrates."""
    (a, b, c), (d, e, f) = ([1e-3 * size for size in sizes] for sizes in (widths_mm, heights_mm))
    view = View(seed, hoap3, Measures(object_width=(a, b, c), object_height=(d, e, f), object_shape=kinds))
    try:
        assert view.calibrate(lambda: np.zeros(2)) == []
        for name, shape in view.world.shapes.items():
            for place in ((0.175, -0.09), (0.180, 0.06)):
                view.park()
                view.see(RESTS)
                view.stand(name, place)
                before = len(view.gestures)
                view.see(RESTS)
                seen = view.gestures[before:][-1]
                assert seen.object == name
                assert np.hypot(seen.x - place[0], seen.y - place[1]) < 0.004
                assert abs(seen.height_m - 2 * shape.half_height) < 0.007
                assert abs(seen.width_m - 2 * shape.half_width) < 0.0025
                assert seen.HasField("turn_rad") == (shape.kind == "block")
                if shape.kind == "block":
                    off = np.remainder(seen.turn_rad - view.looks.turns[name] + np.pi / 4, np.pi / 2) - np.pi / 4
                    assert abs(np.rad2deg(off)) < 8.0
    finally:
        view.close()
