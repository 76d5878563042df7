"""A place that is pointed at becomes an object if one stands there and no other nearly as near."""

from __future__ import annotations

import pytest

from paramove.applications.applying import object_at

STANDING = {"yellow": (0.17, 0.05), "green": (0.18, -0.08), "blue": (0.175, -0.03)}


@pytest.mark.parametrize(
    ("place", "name"),
    [((0.17, 0.05), "yellow"), ((0.185, 0.02), "yellow"), ((0.16, -0.07), "green"), ((0.19, -0.045), "blue")],
)
def test_the_clearly_nearest_object_is_meant(place: tuple[float, float], name: str) -> None:
    assert object_at(place, STANDING).name == name


def test_between_two_objects_both_are_named() -> None:
    found = object_at((0.178, -0.056), STANDING)
    assert not found.name
    assert "that can be green or blue" in found.doubt


@pytest.mark.parametrize("place", [(0.12, 0.05), (0.17, 0.1), (float("nan"), 0.0), (float("inf"), 0.0)])
def test_far_from_all_objects_none_is_meant(place: tuple[float, float]) -> None:
    found = object_at(place, STANDING)
    assert not found.name
    assert "nothing that stands near" in found.doubt


def test_an_empty_table_has_nothing_to_point_at() -> None:
    assert not object_at((0.17, 0.05), {}).name
