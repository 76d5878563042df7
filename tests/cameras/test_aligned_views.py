"""Images of several cameras become sets of one moment, whichever comes late, twice or not at all."""

from __future__ import annotations

import numpy as np
import pytest

from paramove.cameras.aligned_views import AlignedViews

PERIOD_NS = 100_000_000


def picture(number: int) -> np.ndarray:
    return np.full((2, 2, 3), number, np.uint8)


def fed(views: AlignedViews, *heard: tuple[str, int]) -> list[tuple[int, tuple[int | None, ...]]]:
    """Sets as (time in ms, numbers of their images); an image's number is its time in ms / 10."""
    sets = []
    for name, at_ms in heard:
        for made in views.add(name, at_ms * 1_000_000, picture(at_ms // 10)):
            numbers = tuple(None if image is None else int(image[0, 0, 0]) for image in made.images)
            sets.append((made.captured_ns // 1_000_000, numbers))
    return sets


def test_one_camera_waits_for_nobody() -> None:
    assert fed(AlignedViews(["a"], 0.1), ("a", 0), ("a", 100)) == [(0, (0,)), (100, (10,))]


def test_a_set_is_complete_when_each_camera_has_an_image() -> None:
    heard = [("a", 0), ("b", 20), ("b", 110), ("a", 100)]
    assert fed(AlignedViews(["a", "b"], 0.1), *heard) == [(20, (0, 2)), (110, (10, 11))]


def test_an_image_that_does_not_come_is_missing_from_its_set_only() -> None:
    heard = [("a", 0), ("b", 0), ("a", 100), ("a", 200), ("b", 200)]
    assert fed(AlignedViews(["a", "b"], 0.1), *heard) == [
        (0, (0, 0)),
        (100, (10, None)),
        (200, (20, 20)),
    ]


def test_a_silent_camera_is_not_waited_for_until_it_comes_back() -> None:
    heard = [("a", 0), ("b", 0), *(("a", at) for at in range(100, 700, 100)), ("b", 700), ("a", 700)]
    sets = fed(AlignedViews(["a", "b"], 0.1), *heard)
    assert [images[1] for _, images in sets] == [0, None, None, None, None, None, None, 70]
    assert sets[-1] == (700, (70, 70))


def test_a_camera_that_never_spoke_is_gone_too() -> None:
    sets = fed(AlignedViews(["a", "b"], 0.1), *(("a", at) for at in range(0, 600, 100)))
    assert sets[-1] == (500, (50, None))


def test_a_late_image_makes_no_set() -> None:
    views = AlignedViews(["a", "b"], 0.1)
    fed(views, ("a", 0), ("b", 0), ("a", 100), ("b", 100))
    assert fed(views, ("a", 20)) == []
    assert fed(views, ("a", 200), ("b", 200)) == [(200, (20, 20))]


@pytest.mark.parametrize("names", [[], ["a", "a"]])
def test_cameras_without_names_of_their_own_are_refused(names: list[str]) -> None:
    with pytest.raises(ValueError, match="each with a name of its own"):
        AlignedViews(names, 0.1)


def test_a_camera_that_comes_back_after_the_others_is_part_of_the_sets_again():
    """Its first image comes when the set of that moment was already given without it."""
    views, seen = AlignedViews(["one", "two"], 0.1), []
    for moment in range(30):
        for name in ("one", "two") if moment < 5 or moment > 15 else ("one",):
            seen += views.add(name, round(moment * 1e8), np.full((1, 1, 3), moment, np.uint8))
    assert [[image is not None for image in one.images] for one in seen[-10:]] == [[True, True]] * 10
    assert all((one.images[0] == one.images[1]).all() for one in seen[-10:])


@pytest.mark.parametrize("offset", [0.0, 0.3, 0.7])
def test_cameras_that_are_triggered_at_other_times_are_brought_together(offset):
    views, seen = AlignedViews(["one", "two"], 0.1), []
    for moment in range(20):
        for name, later in (("one", 0.0), ("two", offset)):
            seen += views.add(name, round((moment + later) * 1e8), np.zeros((1, 1, 3), np.uint8))
    assert all(image is not None for one in seen[2:] for image in one.images)
    assert len(seen) > 15
