"""A simulated person teaches by touching positions; the set, and the prompts to the person."""

import itertools

import numpy as np
import pytest

from paramove.cameras import Board
from paramove.demonstrations import RESTING_SHOULDER, DemonstrationSet, TaughtSet
from paramove.documents import InputError
from paramove.observation import BodyKeyPoints, WebcamTeacher, board_targets
from studies.teaching.experiment import cameras
from studies.teaching.simulated_person import RATE_HZ, SIZES, key_points, movement

TARGETS = board_targets(Board(0.03).corners())


class Person:
    """Touches positions before two cameras, one after the other."""

    def __init__(self, folder, targets=TARGETS, order=(1, 2), **options):
        self.order = order
        self.set = TaughtSet(folder, "reach", "ann", "a test")
        self.teacher = WebcamTeacher(cameras(2), targets, self.set, rate_hz=RATE_HZ, **options)
        self.rng, self.frame = np.random.default_rng(4), 0

    def touch(self, target):
        """What was said while the person did."""
        poses, said = movement(target, self.rng), []
        tracks = [key_points(poses, camera, self.rng) for camera in cameras(2)]
        for now in range(len(poses)):
            self.frame += 1
            at_ns = round(self.frame * 1e9 / RATE_HZ)
            said += [self.teacher.see(f"camera_{n}", at_ns, tracks[n - 1][now]) for n in self.order]
        return [one for one in said if one]


def test_nine_corners_of_a_board():
    places = np.array(list(TARGETS.values()))
    assert len(TARGETS) == len(np.unique(places, axis=0)) == 9
    assert TARGETS["the near right corner"][1] < TARGETS["the near left corner"][1]
    assert TARGETS["the far right corner"][0] > TARGETS["the near right corner"][0]


def test_movements_are_written_as_they_end(tmp_path):
    two = dict(list(TARGETS.items())[:2])
    person = Person(tmp_path / "set", two)
    for number, (name, target) in enumerate(two.items(), start=1):
        assert name in person.teacher.prompt
        said = person.touch(target)
        assert len(said) == 1
        assert f"taught_00{number}.mcap" in said[0]
    assert person.teacher.finished
    written = DemonstrationSet.load(tmp_path / "set")
    assert len(written) == 2
    for one, target in zip(written, two.values(), strict=True):
        np.testing.assert_allclose(one.theta, target, rtol=0.0, atol=1e-6)
        np.testing.assert_allclose(one.point("index")[-1], target, rtol=0.0, atol=0.006)
        assert np.linalg.norm(one.point("index")[0] - target) > 0.2
        assert 0.5 < one.duration < 3.0
    assert written.frame == "table"


def test_another_position_is_asked_for_again(tmp_path):
    person = Person(tmp_path / "set", {"the corner": np.array([0.3, 0.25, 0.0])})
    said = person.touch([0.15, -0.2, 0.0])
    assert "left out" in said[0]
    assert "1 of 1" in person.teacher.prompt
    assert not (tmp_path / "set" / "labels.yaml").exists()
    assert "touched" in person.touch([0.3, 0.25, 0.0])[0]


def test_one_camera_sees_when_another_corner_is_touched(tmp_path):
    """Its depth is poor, but a fingertip beside the position is seen in the picture."""
    target = np.array([0.15, -0.1, 0.0])
    written = TaughtSet(tmp_path / "set", "reach", "ann", "a test")
    known = {"sizes": SIZES, "shoulder": RESTING_SHOULDER}
    teacher = WebcamTeacher(cameras(1), {"the corner": target}, written, rate_hz=RATE_HZ, **known)
    rng, frame, said = np.random.default_rng(5), itertools.count(1), []
    for touched in (np.array([0.31, -0.1, 0.0]), target):
        for points in key_points(movement(touched, rng), cameras(1)[0], rng):
            said.append(teacher.see("camera_1", round(next(frame) * 1e9 / RATE_HZ), points))
    first, second = (one for one in said if one)
    assert "cm beside the position" in first
    assert "touched" in second


def test_positions_that_the_set_has_are_not_asked_for_again(tmp_path):
    person = Person(tmp_path / "set", dict(list(TARGETS.items())[:1]))
    person.touch(next(iter(TARGETS.values())))
    more = TaughtSet(tmp_path / "set", "reach", "ann", "a test", append=True)
    assert "1 of 8" in WebcamTeacher(cameras(2), TARGETS, more).prompt
    other = TaughtSet(tmp_path / "set", "reach", "bob", "a test", append=True)
    assert "1 of 9" in WebcamTeacher(cameras(2), TARGETS, other).prompt


def test_key_points_of_a_camera_that_is_not_calibrated_are_an_error(tmp_path):
    person = Person(tmp_path / "set")
    with pytest.raises(InputError, match=r"camera_3.*camera_1, camera_2"):
        person.teacher.see("camera_3", 0, BodyKeyPoints.nobody())


@pytest.mark.parametrize("order", [(1, 2), (2, 1)])
def test_the_order_of_the_cameras_does_not_matter(tmp_path, order):
    person = Person(tmp_path / "set", order=order)
    name, target = next(iter(TARGETS.items()))
    assert name in person.touch(target)[0]
    written = DemonstrationSet.load(tmp_path / "set")[0]
    np.testing.assert_allclose(written.point("index")[-1], target, rtol=0.0, atol=0.006)


def test_one_camera_needs_the_person(tmp_path):
    written = TaughtSet(tmp_path / "set", "reach", "", "a test")
    with pytest.raises(InputError, match="measures"):
        WebcamTeacher(cameras(1), TARGETS, written)
    with pytest.raises(InputError, match="at least one"):
        WebcamTeacher(cameras(2), {}, written)
