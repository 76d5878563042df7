"""Key points of both arms, as arrays and as messages."""

import numpy as np
import pytest

from paramove.observation import ARM_POINTS, BodyKeyPoints, key_points_from, key_points_message


def some_points(seed=0):
    rng = np.random.default_rng(seed)
    return BodyKeyPoints(
        rng.uniform(0, 640, (2, 4, 2)),
        rng.uniform(1, 6, (2, 4)),
        rng.normal(0, 0.2, (2, 4)),
        rng.random((2, 4)),
        0.9,
        280.0,
    )


def same(one, other):
    for name in ("positions", "deviations", "depths", "certainties", "certainty", "px_per_m"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_a_message_keeps_all_of_them():
    points = some_points()
    message = key_points_message(points, 1_500_000_000)
    assert message.captured.ToNanoseconds() == 1_500_000_000
    assert [one.name for one in message.points[:4]] == [f"right_{name}" for name in ARM_POINTS]
    same(key_points_from(type(message).FromString(message.SerializeToString())), points)


def test_unknown_points_are_not_sent():
    points = some_points()
    points.positions[0, 2] = np.nan
    received = key_points_from(key_points_message(points, 0))
    assert np.isnan(received.positions[0, 2]).all()
    assert np.isfinite(received.positions).sum() == 14


@pytest.mark.parametrize("broken", [{"x": float("nan")}, {"deviation": 0.0}, {"depth": float("inf")}, {"name": "tail"}])
def test_a_point_of_no_use_is_left_out(broken):
    message = key_points_message(some_points(), 0)
    for name, value in broken.items():
        setattr(message.points[1], name, value)
    assert np.isnan(key_points_from(message).positions[0, 1]).all()
    assert np.isfinite(key_points_from(message).positions[0, 0]).all()


def test_exchanged_twice_is_as_before():
    points = some_points()
    np.testing.assert_array_equal(points.exchanged().positions[0], points.positions[1])
    same(points.exchanged().exchanged(), points)


def test_nobody_has_no_points():
    assert not BodyKeyPoints.nobody().has_person
    assert len(key_points_message(BodyKeyPoints.nobody(), 0).points) == 0
    assert not key_points_from(key_points_message(BodyKeyPoints.nobody(), 0)).has_person


def test_the_direction_of_the_arm_needs_no_lens():
    points = some_points()
    points.positions[0, 0], points.positions[0, 3], points.depths[0, 3] = (100.0, 100.0), (184.0, 16.0), -0.3
    np.testing.assert_allclose(points.arm_direction, np.array([1.0, -1.0, -1.0]) / np.sqrt(3.0), atol=1e-9)
    assert np.isnan(BodyKeyPoints.nobody().arm_direction).all()
