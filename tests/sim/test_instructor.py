"""The instructor's story, asked for by a fake robot, on a table without physics; parts of it with physics."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.msgs.rule_pb2 import Speech
from paramove.robots.hoap3.firmware import Firmware
from sim import looks, places, tool_box
from sim.instructor import Instructor
from sim.looks import Looks
from sim.world import OPENINGS_UP, World
from tests.sim.fake_table import FakeTable

TICK_S = 1 / 60
RULES = {"yellow": "opening_2", "green": "opening_0", "blue": "opening_3"}


class Story:
    """An instructor, a table, and a clock."""

    def __init__(self, seed: int = 0) -> None:
        self.table = FakeTable()
        self.instructor = Instructor(self.table, RULES, looks.streams(seed))
        self.time_s = 0.0

    def ask(self, request: int, name: str = "") -> None:
        self.instructor.handle(request, name)

    def run(self, until: Callable[[], bool] | None = None, longest_s: float = 300.0) -> float:
        """Lets time pass until the condition holds, or until the instructor has nothing to do; returns how long."""
        began_s = self.time_s
        while self.time_s - began_s < longest_s:
            if until() if until is not None else not self.instructor.busy:
                return self.time_s - began_s
            self.instructor.advance(TICK_S)
            self.time_s += TICK_S
        raise AssertionError(f"after {longest_s} s the instructor still {self.instructor.doing}")

    def in_opening(self, name: str) -> bool:
        item = next(item for item in tool_box.OPENINGS if item.name == RULES[name])
        centre = self.table.position(name)
        return bool(np.hypot(*(centre[:2] - (item.x, item.y))) < 0.004 and centre[2] < tool_box.SURFACE_Z)

    def standing(self) -> list[np.ndarray]:
        return [centre[:2] for centre in self.table.positions.values() if abs(centre[2] + 0.109) < 1e-6]


@pytest.mark.parametrize("seed", range(5))
def test_hands_over_an_object_below_the_gripper_and_lets_go(seed: int) -> None:
    story = Story(seed)
    story.ask(Speech.REQUEST_HAND_ME_AN_OBJECT)
    assert story.run() < 12.0
    held = story.table.held_by_instructor
    assert held is not None
    below = story.table.gripper_position - story.table.position(held)
    assert 0.009 <= below[2] <= 0.011
    aside = (-0.0025, -0.004)  # towards the fingertips and the thumb
    assert_allclose(below[:2], aside, rtol=0, atol=0.003)  # 0.7 mm of noise
    assert story.instructor.doing == f"holds {held} in the robot's hand"

    story.table.gripper_position = story.table.gripper_position + np.array((0.005, 0.010, 0.0))
    story.ask(Speech.REQUEST_HAND_ME_AN_OBJECT)
    assert story.run() < 5.0
    below = story.table.gripper_position - story.table.position(held)
    assert_allclose(below[:2], aside, rtol=0, atol=0.003)

    story.ask(Speech.REQUEST_LET_GO)
    story.run()
    assert story.table.held_by_instructor is None
    assert_allclose(story.table.fingertip, places.IDLE_FINGERTIP, rtol=0, atol=1e-9)
    assert story.instructor.doing == "waits"


def test_stands_an_object_at_the_mark() -> None:
    story = Story()
    story.ask(Speech.REQUEST_STAND_OBJECT_AT_START)
    story.run()
    (standing,) = story.standing()
    assert_allclose(standing, places.START, rtol=0, atol=1e-3)
    assert story.table.held_by_instructor is None
    assert_allclose(story.table.fingertip, places.IDLE_FINGERTIP, rtol=0, atol=1e-9)


def test_hands_over_the_object_that_is_asked_for() -> None:
    story = Story()
    story.ask(Speech.REQUEST_HAND_ME_AN_OBJECT, "blue")
    story.run()
    assert story.table.held_by_instructor == "blue"


def test_shows_every_rule_after_turning_the_box() -> None:
    story = Story()
    story.table.positions["green"] = tool_box.standing_centre(0.18, 0.05)  # left on the box by the robot
    story.ask(Speech.REQUEST_SHOW_RULES)
    story.run(lambda: story.instructor.doing == "turns the box")
    assert not story.standing()
    story.run(lambda: story.instructor.doing.startswith("shows"))
    assert story.table.openings_up()
    assert_allclose(story.table.box_offset, 0.0, rtol=0, atol=1e-12)
    story.run()
    assert all(story.in_opening(colour) for colour in tool_box.COLOURS)


def test_a_shown_object_is_seen_alone_and_at_rest_before_it_is_taken() -> None:
    story = Story()
    story.ask(Speech.REQUEST_SHOW_RULES)
    camera = Looks.draw(0).camera
    for _ in tool_box.COLOURS:
        story.run(lambda: len(story.standing()) == 1)
        alone_s = 0.0

        def hand_away() -> bool:
            u, v = camera.project(story.table.fingertip[None])[0]
            return not (0 < u < looks.WIDTH_PX and 0 < v < looks.HEIGHT_PX)

        while story.table.held_by_instructor is None:
            alone_s += TICK_S if hand_away() else 0.0
            story.instructor.advance(TICK_S)
        assert alone_s >= 1.0
        story.run(lambda: story.table.held_by_instructor is None)


def test_order_of_colours_differs_between_seeds() -> None:
    orders = set()
    for seed in range(12):
        story = Story(seed)
        story.ask(Speech.REQUEST_SHOW_RULES)
        story.run()
        orders.add(tuple(dict.fromkeys(story.table.grasps)))
    assert len(orders) >= 4


def test_shows_one_rule_again() -> None:
    story = Story()
    story.ask(Speech.REQUEST_SHOW_RULES)
    story.run()
    before = len(story.table.grasps)
    story.ask(Speech.REQUEST_SHOW_RULE_AGAIN, "green")
    story.run(lambda: len(story.standing()) == 1)
    story.run()
    assert set(story.table.grasps[before:]) == {"green"}
    assert story.in_opening("green")


def test_points_at_every_object_in_turn_after_arranging_them() -> None:
    story = Story()
    story.ask(Speech.REQUEST_SHOW_RULES)
    story.run()
    pointed = []
    for _ in range(3):
        story.ask(Speech.REQUEST_POINT_AT_OBJECT)
        story.run(lambda: story.instructor.doing.startswith("points"))
        assert len(story.standing()) == 3 - len(pointed)
        name = story.instructor.pointed_at
        target = story.table.position(name)
        story.run(lambda target=target: np.linalg.norm(story.table.fingertip[:2] - target[:2]) < 0.0296)
        away_s = story.run(lambda target=target: np.linalg.norm(story.table.fingertip[:2] - target[:2]) > 0.031)
        assert 3.9 < away_s < 5.5  # nobody acknowledged
        story.run()
        pointed.append(name)
        item = next(item for item in tool_box.OPENINGS if item.name == RULES[name])
        story.table.positions[name] = item.centre - (0.0, 0.0, 0.075)  # the robot places it
    assert sorted(pointed) == sorted(tool_box.COLOURS)
    story.ask(Speech.REQUEST_POINT_AT_OBJECT)
    story.run()
    assert story.instructor.doing == "waits"


@pytest.mark.parametrize("seed", range(6))
def test_fingertip_of_the_pointing_hand_is_nearest_to_its_object(seed: int) -> None:
    story = Story(seed)
    story.ask(Speech.REQUEST_SHOW_RULES)
    story.run()
    story.ask(Speech.REQUEST_POINT_AT_OBJECT)
    story.run(lambda: story.instructor.doing.startswith("points"))
    name = story.instructor.pointed_at
    target = story.table.position(name)
    story.run(lambda: np.linalg.norm(story.table.fingertip[:2] - target[:2]) < 0.0296)
    tip = story.table.fingertip
    assert 0.30 < (tip[2] - tool_box.SURFACE_Z) / 0.05 < 1.5
    assert tip[0] > target[0]  # on the camera's side
    distances = {colour: np.linalg.norm(tip[:2] - story.table.position(colour)[:2]) for colour in tool_box.COLOURS}
    assert min(distances, key=distances.__getitem__) == name


def test_withdraws_as_soon_as_the_robot_acknowledges() -> None:
    story = Story()
    story.ask(Speech.REQUEST_SHOW_RULES)
    story.run()
    story.ask(Speech.REQUEST_POINT_AT_OBJECT)
    story.run(lambda: story.instructor.doing.startswith("points"))
    target = story.table.position(story.instructor.pointed_at)
    story.run(lambda: np.linalg.norm(story.table.fingertip[:2] - target[:2]) < 0.0296)
    story.instructor.advance(1.0)
    story.ask(Speech.REQUEST_UNSPECIFIED)
    assert story.run(lambda: np.linalg.norm(story.table.fingertip[:2] - target[:2]) > 0.04) < 1.0


def test_helps_a_fallen_object_to_a_free_place() -> None:
    story = Story()
    story.ask(Speech.REQUEST_SHOW_RULES)
    story.run()
    story.ask(Speech.REQUEST_POINT_AT_OBJECT)
    story.run()
    story.table.positions["yellow"] = np.array((0.21, 0.10, tool_box.SURFACE_Z + tool_box.CYLINDER_RADIUS))
    story.ask(Speech.REQUEST_HELP, "yellow")
    story.run()
    standing = story.standing()
    assert len(standing) == 3
    place = story.table.position("yellow")[:2]
    assert places.STRIP_X[0] - 0.001 <= place[0] <= places.STRIP_X[1] + 0.001
    assert sorted(np.linalg.norm(place - other) for other in standing)[1] >= places.MIN_GAP - 0.001


def test_what_is_held_is_put_away_before_a_new_task() -> None:
    story = Story()
    story.ask(Speech.REQUEST_HAND_ME_AN_OBJECT, "yellow")
    story.run()
    story.ask(Speech.REQUEST_SHOW_RULES)
    story.run(lambda: story.instructor.doing == "turns the box")
    assert_allclose(story.table.position("yellow"), places.PARKED[0], rtol=0, atol=0.002)


def test_a_request_said_twice_is_done_once_and_unknown_ones_are_passed_over() -> None:
    story = Story()
    for _ in range(3):
        story.ask(Speech.REQUEST_SHOW_RULES)
        story.ask(Speech.REQUEST_UNSPECIFIED)
        story.instructor.advance(TICK_S)
    story.run()
    assert len(story.table.grasps) == 6  # each colour is brought once and carried into its opening once


def test_thank_you_ends_the_story() -> None:
    story = Story()
    story.ask(Speech.REQUEST_THANK_YOU)
    story.run()
    assert story.instructor.finished


def test_moves_take_one_to_three_seconds_and_start_and_end_at_rest() -> None:
    story = Story()
    story.ask(Speech.REQUEST_SHOW_RULES)
    tips = []
    while story.instructor.busy:
        story.instructor.advance(TICK_S)
        tips.append(story.table.fingertip)
    speed = np.linalg.norm(np.diff(tips, axis=0), axis=1) / TICK_S
    assert speed.max() < 1.5
    assert np.abs(np.diff(speed)).max() / TICK_S < 12.0  # m/s^2


def test_with_physics_a_cylinder_is_carried_into_its_opening(world: World) -> None:
    world.move_box(np.zeros(3), OPENINGS_UP)
    world.place("green", tool_box.standing_centre(0.185, -0.02))
    world.apply(np.zeros(28))
    world.step()
    instructor = Instructor(world, world_rules := Looks.draw(0).rules, looks.streams(0))
    description = world.description
    firmware, counts = Firmware(description), description.units.to_counts(description.base_pose)
    instructor.handle(Speech.REQUEST_SHOW_RULE_AGAIN, "green")
    while instructor.busy and world.time_s < 20:
        instructor.advance(0.001)
        world.apply(firmware.step(counts, world.joint_positions(), world.joint_velocities()))
        world.step()
    item = next(item for item in tool_box.OPENINGS if item.name == world_rules["green"])
    centre = world.position("green")
    assert np.hypot(centre[0] - item.x, centre[1] - item.y) < tool_box.OPENING_RADIUS
    assert centre[2] + tool_box.CYLINDER_HALF_HEIGHT < tool_box.SURFACE_Z
    assert world.last_touched_by["green"] == "instructor"
    assert world.contacts.unwanted == 0
