"""What is learned of an object's full size from where it rests."""

import pytest

from paramove.objects.full_size import FullSize, Size

STANDING, HELD = Size(900.0, 42.0, 20.0, 21.0, 0.0), Size(1150.0, 52.0, 22.0, 26.0, 0.0)


def area_px(sizes: FullSize) -> float:
    expected = sizes.expected("blue", 100.0, 100.0)
    assert expected is not None
    return expected.area_px


def test_an_object_that_may_be_held_up_counts_until_it_is_known_to_stand() -> None:
    sizes = FullSize()
    sizes.learn("blue", 100.0, 100.0, HELD, stands=False)
    assert area_px(sizes) == pytest.approx(HELD.area_px, rel=1e-6)
    sizes.learn("blue", 100.0, 100.0, STANDING)
    assert area_px(sizes) == pytest.approx(STANDING.area_px, rel=1e-6)
    sizes.learn("blue", 100.0, 100.0, HELD, stands=False)
    assert area_px(sizes) == pytest.approx(STANDING.area_px, rel=1e-6)


def test_a_partly_hidden_sample_is_replaced_by_a_full_one() -> None:
    sizes = FullSize()
    sizes.learn("blue", 100.0, 100.0, Size(500.0, 22.0, 20.0, 11.0, 0.0))
    sizes.learn("blue", 100.0, 100.0, STANDING)
    assert area_px(sizes) == pytest.approx(STANDING.area_px, rel=1e-6)


@pytest.mark.parametrize("other", [Size(2500.0, 65.0, 50.0, 33.0, 0.0), Size(1700.0, 76.0, 20.0, 38.0, 0.0)])
def test_an_object_that_is_exchanged_for_a_larger_one_and_back_looks_as_before(other: Size) -> None:
    sizes = FullSize()
    sizes.learn("blue", 100.0, 100.0, STANDING)
    sizes.learn("blue", 100.0, 100.0, other)
    assert area_px(sizes) == pytest.approx(other.area_px, rel=1e-6)
    assert not sizes.was_exchanged_back("blue", 100.0, 100.0, Size(450.0, 21.0, 20.0, 11.0, 0.0)), (
        "half of it is hidden"
    )
    assert area_px(sizes) == pytest.approx(other.area_px, rel=1e-6)
    assert sizes.was_exchanged_back("blue", 100.0, 100.0, STANDING)
    assert area_px(sizes) == pytest.approx(STANDING.area_px, rel=1e-6)
