"""Images wait a little for their key points, and never for long."""

import numpy as np

from paramove.action_space.awaited_key_points import AwaitedKeyPoints
from paramove.observation import BodyKeyPoints

MS = 1_000_000
IMAGE = np.zeros((2, 2, 3), np.uint8)
POINTS = BodyKeyPoints.nobody()


def released(found):
    return [(captured_ns // MS, points is not None) for captured_ns, (_, points) in found]


def test_without_any_nothing_waits():
    awaited = AwaitedKeyPoints()
    assert [released(awaited.add_image(at * MS, IMAGE)) for at in (0, 66, 133)] == [
        [(0, False)],
        [(66, False)],
        [(133, False)],
    ]


def test_an_image_waits_for_its_own():
    awaited = AwaitedKeyPoints()
    assert released(awaited.add_image(0, IMAGE)) == [(0, False)]
    assert released(awaited.add_points(0, POINTS)) == []
    assert released(awaited.add_image(66 * MS, IMAGE)) == []
    assert released(awaited.add_points(66 * MS, POINTS)) == [(66, True)]


def test_key_points_may_come_before_their_image():
    awaited = AwaitedKeyPoints()
    assert released(awaited.add_points(66 * MS, POINTS)) == []
    assert released(awaited.add_image(66 * MS, IMAGE)) == [(66, True)]


def test_an_image_that_the_network_left_out_goes_on_with_the_next():
    awaited = AwaitedKeyPoints()
    list(awaited.add_points(0, POINTS))
    assert released(awaited.add_image(66 * MS, IMAGE)) == []
    assert released(awaited.add_image(133 * MS, IMAGE)) == []
    assert released(awaited.add_points(133 * MS, POINTS)) == [(66, False), (133, True)]


def test_an_image_waits_at_most_150_ms():
    awaited = AwaitedKeyPoints()
    list(awaited.add_points(0, POINTS))
    assert released(awaited.add_image(66 * MS, IMAGE)) == []
    assert released(awaited.released(200 * MS)) == []
    assert released(awaited.released(220 * MS)) == [(66, False)]


def test_a_detector_that_is_gone_is_not_waited_for():
    awaited = AwaitedKeyPoints()
    list(awaited.add_points(0, POINTS))
    assert released(awaited.add_image(1001 * MS, IMAGE)) == [(1001, False)]
