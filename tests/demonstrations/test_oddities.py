"""What hardly fits in a set is named: other units, other bodies, wrong labels, angles that jump."""

from dataclasses import replace

import numpy as np
import pytest

from paramove.demonstrations import DemonstrationSet, synthetic_takes, write_set
from paramove.demonstrations.oddities import oddities


@pytest.fixture(scope="module", params=["reaching", "pointing"])
def movements(request, tmp_path_factory):
    """27 movements to 9 targets of a synthetic person."""
    folder = tmp_path_factory.mktemp(request.param) / "set"
    takes, names = synthetic_takes(request.param, 3, 3, 3, 1)
    write_set(folder, takes, names, "")
    return list(DemonstrationSet.load(folder))


def changed(movements, number, **changes):
    return [replace(one, **changes) if n == number else one for n, one in enumerate(movements)]


def named(found, movements, number):
    """The oddities, which all must be of one movement."""
    assert found
    assert all(movements[number].source in oddity.message for oddity in found)
    return found


def test_good_movements_are_not_odd(movements):
    assert oddities(movements) == []


@pytest.mark.parametrize(("number", "other"), [(4, 20), (0, 26), (13, 0), (20, 2), (25, 8)])
def test_a_wrong_label_is_named_with_the_right_one(movements, number, other):
    theta = movements[other].theta
    (oddity,) = named(oddities(changed(movements, number, theta=theta)), movements, number)
    right = ", ".join(f"{value:.4g}" for value in movements[number].theta)
    assert f"goes where theta {right} does" in oddity.message
    assert not oddity.spoils


@pytest.mark.parametrize(("factor", "unit"), [(1e3, "millimetres"), (1e2, "centimetres"), (1e-3, "metres")])
@pytest.mark.parametrize("points", ["all", "one"])
def test_a_take_in_another_unit_spoils_training(movements, factor, unit, points):
    if points == "one":
        movements = [replace(one, positions=one.positions[:, 5:6], point_names=("index",)) for one in movements]
    odd = changed(movements, 4, positions=movements[4].positions * factor)
    (oddity,) = named(oddities(odd), movements, 4)
    assert oddity.spoils
    assert unit in oddity.message


def test_theta_in_another_unit_is_named_with_where_the_hand_goes(movements):
    (oddity,) = oddities([replace(one, theta=one.theta * 1e3) for one in movements])
    assert "target_x is -70 ... 230" in oddity.message
    assert "millimetres?" in oddity.message
    (oddity,) = named(oddities(changed(movements, 7, theta=movements[7].theta * 1e3)), movements, 7)
    assert oddity.spoils
    (oddity,) = oddities(changed(movements, 7, theta=movements[7].theta * 1e3)[7:8])  # a set of one
    assert "millimetres?" in oddity.message


@pytest.mark.parametrize("factor", [0.2, 5.0])
def test_a_movement_of_another_duration_is_named(movements, factor):
    odd = changed(movements, 4, time=movements[4].time * factor)
    (oddity,) = named(oddities(odd), movements, 4)
    assert "is its rate right?" in oddity.message


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_a_person_may_take_twice_as_long(movements, factor):
    assert oddities(changed(movements, 4, time=movements[4].time * factor)) == []


def test_a_number_in_theta_far_from_all_others_is_named(movements):
    theta = movements[7].theta.copy()
    theta[1] = 3.5
    (oddity,) = [one for one in oddities(changed(movements, 7, theta=theta)) if "typed correctly?" in one.message]
    assert movements[7].source in oddity.message
    assert "its target_y is 3.5" in oddity.message


@pytest.mark.parametrize(
    ("order", "signs", "words"),
    [
        ((1, 0, 2), (1, 1, 1), "the hand goes along y where target_x changes"),
        ((0, 1, 2), (1, -1, 1), "target_y grows where the hand's y falls"),
        ((0, 1, 2), (-1, 1, 1), "target_x grows where the hand's x falls"),
    ],
)
def test_theta_in_other_axes_than_the_points_is_named(movements, order, signs, words):
    turned = [replace(one, theta=one.theta[list(order)] * np.array(signs)) for one in movements]
    assert any(words in oddity.message for oddity in oddities(turned))


def test_swapped_points_are_named(movements):
    positions = movements[9].positions.copy()
    positions[:, [2, 3]] = positions[:, [3, 2]]
    (oddity,) = named(oddities(changed(movements, 9, positions=positions)), movements, 9)
    assert " m apart, in the other movements " in oddity.message


@pytest.mark.parametrize(
    ("name", "low", "high", "turn", "signed", "odd"),
    [
        ("angle_deg", 150.0, 210.0, 360.0, True, True),
        ("parameter_1", 150.0, 210.0, 360.0, True, True),
        ("yaw", 2.5, 3.9, 2 * np.pi, True, True),
        ("heading", -40.0, 50.0, 360.0, False, True),
        ("heading", -40.0, 50.0, 360.0, True, False),
        ("angle", -170.0, 170.0, 360.0, True, False),
        ("parameter_1", 0.0, 300.0, 1e9, False, False),
    ],
)
def test_an_angle_that_crosses_its_border_is_named_with_the_remedy(movements, name, low, high, turn, signed, odd):
    values = np.linspace(low, high, len(movements)) % turn
    if signed:
        values = (values + turn / 2) % turn - turn / 2
    turned = [
        replace(one, theta=np.array([v]), parameter_names=(name,)) for one, v in zip(movements, values, strict=True)
    ]
    found = [oddity.message for oddity in oddities(turned) if oddity.message.startswith(name)]
    assert len(found) == odd
    assert all("sine and cosine" in message for message in found)


def test_few_movements_have_no_odd_one(movements):
    assert oddities([]) == []
    for count in (1, 2, 3):
        assert oddities(movements[:count]) == []
