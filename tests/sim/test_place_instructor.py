"""The instructor who points at free places: which places, what happens when the robot does not understand, help."""

from __future__ import annotations

import numpy as np
import pytest

from paramove.applications.options import within
from paramove.msgs.rule_pb2 import Speech
from sim import looks, tool_box
from sim.arm import ELBOW, SHOULDER, TIP
from sim.place_instructor import (
    ANOTHER_PLACE,
    FREE_OF_ROBOT,
    OBJECT,
    START,
    PlaceInstructor,
    where_people_point,
)
from sim.small_person import POINTED_ABOVE_PLANE, SmallPerson
from tests.applications.launched import relocator
from tests.sim.fake_table import FakeTable

TICK_S = 1 / 60
PLACE = Speech.REQUEST_POINT_AT_PLACE
OPTIONS = relocator()


class Story:
    """An instructor before a robot that holds the object at the relocator's place."""

    def __init__(self, seed: int) -> None:
        self.table = FakeTable()
        self.table.gripper_position = np.array(OPTIONS.hold)
        self.table.positions[OBJECT] = np.array(OPTIONS.hold)
        draw = np.random.default_rng((seed, 1))
        person = SmallPerson(np.random.default_rng(seed))
        self.instructor = PlaceInstructor(self.table, looks.streams(seed), person, draw)
        self.arm = self.instructor.arm

    def until(self, condition, longest_s: float = 40.0) -> None:
        for _ in range(round(longest_s / TICK_S)):
            self.instructor.advance(TICK_S)
            if condition():
                return
        raise AssertionError(f"after {longest_s} s the instructor still {self.instructor.doing}")

    def until_there(self) -> np.ndarray:
        self.until(lambda: self.arm.at_target)
        assert self.arm.target is not None
        return self.arm.target

    def until_done(self) -> None:
        self.until(lambda: not self.instructor.busy)


@pytest.mark.parametrize("seed", range(6))
def test_points_at_free_places_that_the_robot_reaches(seed):
    story, before = Story(seed), np.array(START)
    for _ in range(3):
        story.instructor.handle(PLACE, OBJECT)
        x, y, z = story.until_there()
        assert within((x, y), OPTIONS.area_x, OPTIONS.area_y, 0.003)
        assert z == pytest.approx(tool_box.SURFACE_Z + POINTED_ABOVE_PLANE)
        assert np.hypot(x - OPTIONS.hold[0], y - OPTIONS.hold[1]) >= FREE_OF_ROBOT
        assert np.hypot(x - before[0], y - before[1]) >= ANOTHER_PLACE
        assert where_people_point(np.array([x, y]))
        assert np.linalg.norm(story.table.fingertip - [x, y, z]) < 0.012
        story.instructor.handle(Speech.REQUEST_UNSPECIFIED)
        story.until_done()
        before = np.array([x, y])
    assert story.arm.pointings == 3


def test_who_is_not_understood_points_once_more_at_the_same_place_then_at_another():
    story = Story(1)
    story.instructor.handle(PLACE, OBJECT)
    places = [story.until_there()]
    for _ in range(2):
        story.instructor.handle(PLACE, OBJECT)  # still at the place, or on the way back
        story.until(lambda: not story.arm.at_target)
        places.append(story.until_there())
    assert np.array_equal(places[0], places[1])
    assert not np.array_equal(places[1], places[2])


def test_a_request_that_is_repeated_before_the_hand_arrives_is_one():
    story = Story(2)
    story.instructor.handle(PLACE, OBJECT)
    story.instructor.advance(0.5)
    story.instructor.handle(PLACE, OBJECT)
    story.until_done()
    assert story.arm.pointings == 1


def test_points_at_the_object_where_it_stands():
    story = Story(4)
    story.table.positions[OBJECT] = tool_box.standing_centre(*START)
    story.instructor.handle(Speech.REQUEST_POINT_AT_OBJECT, OBJECT)
    x, y, z = story.until_there()
    assert (x, y) == pytest.approx(START)
    assert z > tool_box.SURFACE_Z + 2 * tool_box.CYLINDER_HALF_HEIGHT
    story.until_done()
    assert story.arm.posture[TIP, 2] < tool_box.SURFACE_Z


def test_helps_by_standing_the_object_at_its_start():
    story = Story(3)
    story.table.positions[OBJECT] = tool_box.standing_centre(0.18, 0.05)
    story.instructor.handle(Speech.REQUEST_HELP, OBJECT)
    story.until_done()
    np.testing.assert_allclose(story.table.position(OBJECT)[:2], START, rtol=0, atol=0.002)
    assert OPTIONS.start == START


@pytest.mark.parametrize("seed", range(4))
def test_the_arm_hangs_between_two_pointings_and_never_jumps(seed):
    story, postures = Story(seed), []
    story.instructor.advance(1.0)
    for _ in range(2):
        story.instructor.handle(PLACE, OBJECT)
        story.until(lambda: postures.append(story.arm.posture) or not story.instructor.busy)
        hanging = postures[-1]
        assert hanging[TIP, 2] < tool_box.SURFACE_Z
        assert np.hypot(*(hanging[TIP, :2] - [OPTIONS.area_x[1], OPTIONS.area_y[0]])) > OPTIONS.hand_away
    speeds = np.linalg.norm(np.diff(postures, axis=0), axis=2) / TICK_S
    assert speeds[:, [SHOULDER, TIP]].max() < 1.5
    assert speeds[:, ELBOW].max() < 2.5


@pytest.mark.parametrize(
    ("place", "inside"), [((0.16, 0.0), True), ((0.125, 0.07), False), ((0.30, 0.0), False), ((0.17, -0.2), False)]
)
def test_people_point_on_their_part_of_the_table(place, inside):
    assert where_people_point(np.array(place)) is inside
