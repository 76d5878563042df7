"""Sets of images wait a little for their key points, and never for long."""

import numpy as np
import pytest

from paramove.action_space.awaited_key_points import AwaitedKeyPoints
from paramove.cameras import AlignedViews, Views
from paramove.observation import BodyKeyPoints

MS = 1_000_000
IMAGE = np.zeros((2, 2, 3), np.uint8)
POINTS = BodyKeyPoints.nobody()


class Awaited:
    """One camera or two, with times in ms; what goes on is (time, whether each image has its key points)."""

    def __init__(self, *names):
        self.awaited = AwaitedKeyPoints(names or ("camera_1",))
        self.count = len(names) or 1

    def images(self, at, *missing):
        views = tuple(None if number in missing else (at * MS, IMAGE) for number in range(self.count))
        return self._released(self.awaited.add_set(Views(at * MS, views)))

    def points(self, at, camera="camera_1"):
        return self._released(self.awaited.add_points(camera, at * MS, POINTS))

    def tick(self, at):
        return self._released(self.awaited.released(at * MS))

    def _released(self, found):
        return [(views.captured_ns // MS, *(one is not None for one in points)) for views, points in found]


def test_without_any_nothing_waits():
    awaited = Awaited()
    assert [awaited.images(at) for at in (0, 66, 133)] == [[(0, False)], [(66, False)], [(133, False)]]


def test_an_image_waits_for_its_own():
    awaited = Awaited()
    assert awaited.images(0) == [(0, False)]
    assert awaited.points(0) == []
    assert awaited.images(66) == []
    assert awaited.points(66) == [(66, True)]


def test_key_points_may_come_before_their_image():
    awaited = Awaited()
    assert awaited.points(66) == []
    assert awaited.images(66) == [(66, True)]


def test_an_image_that_the_network_left_out_goes_on_with_the_next():
    awaited = Awaited()
    awaited.points(0)
    assert awaited.images(66) == []
    assert awaited.images(133) == []
    assert awaited.points(133) == [(66, False), (133, True)]


def test_an_image_waits_at_most_150_ms():
    awaited = Awaited()
    awaited.points(0)
    assert awaited.images(66) == []
    assert awaited.tick(200) == []
    assert awaited.tick(220) == [(66, False)]


def test_a_detector_that_is_gone_is_not_waited_for():
    awaited = Awaited()
    awaited.points(0)
    assert awaited.images(1001) == [(1001, False)]


def test_all_cameras_of_a_set_are_waited_for_together():
    awaited = Awaited("camera_1", "camera_2")
    awaited.points(0, "camera_1")
    awaited.points(0, "camera_2")
    assert awaited.images(66) == []
    assert awaited.points(66, "camera_2") == []
    assert awaited.points(66, "camera_1") == [(66, True, True)]
    assert awaited.images(133, 1) == []
    assert awaited.points(133, "camera_1") == [(133, True, False)]


def test_a_detector_that_is_too_slow_is_reported_and_not_waited_for():
    awaited = Awaited()
    for at in range(0, 400, 66):
        awaited.images(at)
    awaited.points(132)
    assert "camera_1, 264 ms" in awaited.awaited.trouble()
    assert awaited.images(462) == [(462, False)]
    awaited.points(396)
    assert awaited.awaited.trouble() == ""
    assert awaited.images(528) == []


@pytest.mark.parametrize(("network_ms", "least"), [(30, 0.95), (60, 0.9)])
def test_two_cameras_and_one_detector_lose_no_set(network_ms, least):
    """The detector takes the latest image of each camera in turn; both cameras give 15 images a second."""
    names = ("camera_1", "camera_2")
    aligned, awaited = AlignedViews(names, 1 / 15), AwaitedKeyPoints(names)
    released, busy_until, waiting = [], 0, {}
    for now in range(20_000):
        if now % 67 == 0:
            for name in names:
                waiting[name] = now
                for views in aligned.add(name, now * MS, (now * MS, IMAGE)):
                    released += awaited.add_set(views)
        if waiting and now >= busy_until:
            name = min(waiting, key=waiting.get)
            busy_until, done = now + network_ms // 2, (name, waiting.pop(name))
            released += awaited.add_points(done[0], done[1] * MS, POINTS)
        released += awaited.released(now * MS)
    assert all(timed is not None for views, _ in released for timed in views.images), "a camera was left out"
    assert len(released) >= 298
    assert np.mean([all(one is not None for one in points) for _, points in released]) > least
