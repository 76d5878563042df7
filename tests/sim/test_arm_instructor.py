"""The instructor as a whole arm at the robot's scale: postures, pointing, and what people measure of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.action_space.person import read_person
from paramove.msgs.rule_pb2 import Speech
from sim import looks, places, tool_box
from sim.arm import ELBOW, SHOULDER, TIP, WRIST
from sim.arm_cameras import calibrated, draw_arm_cameras
from sim.instructor import Instructor
from sim.sights import Sights
from sim.small_person import (
    POINTED_ABOVE_PLANE,
    SmallPerson,
    shoulder_from_table,
    table_from_shoulder,
)
from tests.sim.fake_table import FakeTable

TICK_S = 1 / 60
RULES = {"yellow": "opening_2", "green": "opening_0", "blue": "opening_3"}
CORNERS = [(x, y) for x in places.STRIP_X for y in places.STRIP_Y]


def person_of(seed: int) -> SmallPerson:
    return SmallPerson(np.random.default_rng(seed))


def place_over(x: float, y: float) -> np.ndarray:
    return np.array([x, y, tool_box.SURFACE_Z + POINTED_ABOVE_PLANE])


class Story:
    """An instructor with an arm before a table on which all cylinders stand."""

    def __init__(self, seed: int) -> None:
        self.table = FakeTable()
        self.table.up = True
        layout, _ = places.draw_layout(np.random.default_rng(seed))
        for colour, place in zip(tool_box.COLOURS, layout, strict=True):
            self.table.positions[colour] = tool_box.standing_centre(*place)
        draw = np.random.default_rng((seed, 1))
        self.instructor = Instructor(self.table, RULES, looks.streams(seed), person_of(seed), draw)
        assert self.instructor.arm is not None
        self.arm = self.instructor.arm
        self.postures: list[np.ndarray] = []
        self.targets: list[tuple[np.ndarray, bool]] = []

    def point(self, name: str) -> None:
        sights = Sights(self.table, {})
        assert all(sights.stands(colour) for colour in tool_box.COLOURS)
        self.instructor.arranged = True
        self.instructor.handle(Speech.REQUEST_POINT_AT_OBJECT, name)
        for _ in range(60 * 30):
            self.instructor.advance(TICK_S)
            self.postures.append(self.arm.posture)
            if self.arm.target is not None:
                self.targets.append((self.arm.target, self.arm.at_target))
            if not self.instructor.busy:
                return
        raise AssertionError(f"after 30 s the instructor still {self.instructor.doing}")


def test_frames_are_inverse_of_each_other() -> None:
    points = np.random.default_rng(0).normal(size=(5, 3))
    assert_allclose(table_from_shoulder(shoulder_from_table(points)), points, rtol=0, atol=1e-12)
    assert shoulder_from_table([0.0, 0.0, 0.0])[2] == pytest.approx(tool_box.SURFACE_Z)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("corner", CORNERS)
def test_points_at_every_corner_of_the_strip(seed: int, corner: tuple[float, float]) -> None:
    place = place_over(*corner)
    movement = person_of(seed).points_at(place, np.random.default_rng(seed))
    middle = movement.at((movement.arrives_s + movement.leaves_s) / 2)
    assert np.linalg.norm(middle[TIP] - place) < 0.012  # people miss a little
    assert movement.postures[:, TIP, 2].min() > tool_box.TABLE_Z
    assert 1.8 < movement.duration_s < 5.5
    near = np.linalg.norm(movement.postures[:, TIP, :2] - place[:2], axis=1) < tool_box.CYLINDER_RADIUS + 0.005
    top = tool_box.SURFACE_Z + 2 * tool_box.CYLINDER_HALF_HEIGHT
    assert movement.postures[near, TIP, 2].min() > top + 0.004  # the finger does not touch the object


@pytest.mark.parametrize("seed", range(4))
def test_sizes_are_those_of_one_arm_in_every_posture(seed: int) -> None:
    story = Story(seed)
    story.point("green")
    sizes = story.arm.body.sizes
    lengths = np.linalg.norm(np.diff(story.postures, axis=1), axis=2)
    assert_allclose(lengths[:, SHOULDER], sizes.upper_arm, rtol=0, atol=0.009)  # between postures by straight lines
    assert_allclose(lengths[:, ELBOW], sizes.forearm, rtol=0, atol=0.012)  # and the wrist is bent aside by up to 6 mm
    assert_allclose(lengths[:, WRIST], sizes.hand, rtol=0, atol=0.006)


@pytest.mark.parametrize("seed", range(4))
def test_pointing_is_slow_enough_everywhere_and_tells_its_target(seed: int) -> None:
    story = Story(seed)
    story.point("blue")
    speeds = np.linalg.norm(np.diff(story.postures, axis=0), axis=2) / TICK_S
    assert speeds[:, [SHOULDER, TIP]].max() < 1.5
    assert speeds[:, ELBOW].max() < 2.5
    place = place_over(*story.table.position("blue")[:2])
    assert all(np.array_equal(target, place) for target, _ in story.targets)
    assert 0.15 < TICK_S * sum(there for _, there in story.targets) < 1.5
    assert story.arm.target is None
    assert story.arm.pointings == 1
    assert_allclose(story.postures[-1][TIP], places.IDLE_FINGERTIP, rtol=0, atol=1e-9)


def test_the_person_sits_while_pointing_and_leans_for_what_is_far() -> None:
    person = person_of(0)
    near = person.holding(person.seat + np.array([-0.10, 0.05, -0.12]), np.array([0.2, -0.5, 0.8]))
    assert_allclose(near[SHOULDER], person.seat, rtol=0, atol=1e-9)
    far = person.holding(places.PARKED[0], np.array([0.2, -0.5, 0.8]))
    assert np.linalg.norm(far[SHOULDER] - person.seat) > 0.2
    assert_allclose(far[TIP], places.PARKED[0], rtol=0, atol=1e-12)


def test_measures_are_a_little_wrong_and_in_the_table_frame(tmp_path: Path) -> None:
    errors = []
    for seed in range(12):
        person = person_of(seed)
        person.write_measures(tmp_path / "person.yaml")
        measured = read_person(tmp_path / "person.yaml")
        errors.append(np.array(measured.shoulder) - table_from_shoulder(person.seat))
        assert measured.upper_arm == pytest.approx(person.sizes.upper_arm, rel=0.035)
        assert measured.hand == pytest.approx(person.sizes.hand, rel=0.035)
    assert np.abs(errors).max() < 0.0025
    assert np.abs(errors).max() > 0.001


def test_calibrated_cameras_see_the_objects_about_where_they_are() -> None:
    corners = table_from_shoulder(np.array([place_over(*corner) for corner in CORNERS]))
    differences = []
    for seed in range(8):
        cameras = draw_arm_cameras(np.random.default_rng(seed))
        for camera, known in zip(cameras, calibrated(cameras, np.random.default_rng((seed, 1))), strict=True):
            seen = camera.project(corners)
            assert (seen > 8).all()
            assert (seen < (camera.width_px - 8, camera.height_px - 8)).all()
            differences.append(np.abs(known.project(corners) - seen).max())
    assert max(differences) < 3.0
    assert min(differences) > 0.05


def test_who_is_asked_again_while_withdrawing_points_again() -> None:
    story = Story(2)
    story.instructor.arranged = True
    story.instructor.handle(Speech.REQUEST_POINT_AT_OBJECT, "")
    asked = False
    for _ in range(60 * 40):
        story.instructor.advance(TICK_S)
        if story.arm.at_target and not asked:
            asked = True
            story.instructor.handle(Speech.REQUEST_POINT_AT_OBJECT, "")
            story.instructor.handle(Speech.REQUEST_POINT_AT_OBJECT, "")
        if asked and not story.instructor.busy:
            break
    assert story.arm.pointings == 2


def test_a_request_before_the_finger_has_arrived_is_the_one_being_answered() -> None:
    story = Story(2)
    story.instructor.arranged = True
    story.instructor.handle(Speech.REQUEST_POINT_AT_OBJECT, "")
    for _ in range(60 * 40):
        story.instructor.advance(TICK_S)
        if not story.arm.at_target and story.arm.pointings < 1:
            story.instructor.handle(Speech.REQUEST_POINT_AT_OBJECT, "")
        if not story.instructor.busy:
            break
    assert story.arm.pointings == 1
