"""What differs from seed to seed: its spread, and what every camera must see."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sim import looks, places, tool_box
from sim.camera import Sensor, undistorting_map
from sim.looks import Camera, Looks

SEEDS = range(100)


@pytest.fixture(scope="module")
def drawn() -> list[Looks]:
    return [Looks.draw(seed) for seed in SEEDS]


def test_the_same_seed_looks_the_same(drawn: list[Looks]) -> None:
    again = Looks.draw(7)
    assert again.rules == drawn[7].rules
    assert again.brightness == drawn[7].brightness
    assert_allclose(again.camera.position, drawn[7].camera.position, rtol=0, atol=0)


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("light 0", 0.5, 1.6),
        ("light 1", 0.5, 1.6),
        ("noise", 2.0, 6.0),
        ("focal", 0.9, 1.1),
        ("k1", -0.1, 0.1),
        *((f"moved {axis}", -0.05, 0.05) for axis in range(3)),
        *((f"turned {axis}", -6.0, 6.0) for axis in range(3)),
    ],
)
def test_spread_over_100_seeds(drawn: list[Looks], name: str, low: float, high: float) -> None:
    """Every quantity stays in its range, reaches the outer tenths of it and is not crowded anywhere."""
    values = np.array([_quantities(item)[name] for item in drawn])
    share = (values - low) / (high - low)
    assert (share >= 0).all()
    assert (share <= 1).all()
    assert share.min() < 0.1
    assert share.max() > 0.9
    assert 0.35 < share.mean() < 0.65
    assert 0.20 < share.std() < 0.38  # 0.289 for a uniform one


def test_rules_differ_and_use_distinct_openings(drawn: list[Looks]) -> None:
    assert all(len(set(item.rules.values())) == 3 for item in drawn)
    assert len({tuple(item.rules.values()) for item in drawn}) > 20  # of 24
    for colour in tool_box.COLOURS:
        assert {item.rules[colour] for item in drawn} == {opening.name for opening in tool_box.OPENINGS}


def test_every_camera_sees_the_openings_and_the_strip_but_not_what_is_put_away(drawn: list[Looks]) -> None:
    table = np.array(
        [item.centre for item in tool_box.OPENINGS]
        + [tool_box.standing_centre(x, y) for x in places.STRIP_X for y in places.STRIP_Y]
    )
    away = np.array([places.IDLE_FINGERTIP, *places.PARKED])
    size = np.array((looks.WIDTH_PX, looks.HEIGHT_PX))
    for item in drawn:
        seen = item.camera.project(table)
        assert ((seen > 0) & (seen < size)).all()
        hidden = item.camera.project(away)
        assert not ((hidden > 0) & (hidden < size)).all(axis=1).any()


def test_streams_of_purposes_are_independent() -> None:
    first = {name: draw.random() for name, draw in looks.streams(3).items()}
    assert len(set(first.values())) == len(looks.PURPOSES)


def test_lens_maps_each_pixel_to_where_the_undistorted_point_was_rendered() -> None:
    camera = Looks.draw(11).camera
    columns, rows = undistorting_map(camera)
    points = np.array([item.centre for item in tool_box.OPENINGS])
    image = camera.project(points)
    straight = Camera(**{**vars(camera), "k1": 0.0}).project(points)
    margin = np.array((16.0, 12.0))
    for (u, v), expected in zip(image, straight + margin, strict=True):
        near = (round(v), round(u))
        found = np.array((columns[near], rows[near])) + (np.array((u, v)) - (near[1], near[0]))
        assert_allclose(found, expected, rtol=0, atol=0.1)


def test_noise_has_the_drawn_deviation_and_differs_from_image_to_image() -> None:
    world_looks = Looks.draw(5)
    sensor = Sensor(world_looks.camera, world_looks.pixel_noise, np.random.default_rng(0))
    grey = np.full((looks.HEIGHT_PX + 24, looks.WIDTH_PX + 32, 3), 128, dtype=np.uint8)
    first, second = sensor.expose(grey).astype(float), sensor.expose(grey).astype(float)
    inner = np.s_[60:-60, 60:-60]
    assert_allclose(first[inner].std(), world_looks.pixel_noise, rtol=0.03, atol=0)
    assert abs(np.corrcoef(first[inner].ravel(), second[inner].ravel())[0, 1]) < 0.02


def _quantities(item: Looks) -> dict[str, float]:
    camera = item.camera
    values = {"noise": item.pixel_noise, "focal": camera.focal_scale, "k1": camera.k1}
    values |= {f"light {number}": level for number, level in enumerate(item.brightness)}
    values |= {f"moved {axis}": value for axis, value in enumerate(camera.moved)}
    values |= {f"turned {axis}": value for axis, value in enumerate(camera.turned_deg)}
    return values
