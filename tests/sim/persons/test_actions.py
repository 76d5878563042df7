"""Training movements: they begin, go and end where their theta says, with an arm whose lengths hold."""

import numpy as np
import pytest

from paramove.demonstrations.arm import ArmLengths
from paramove.demonstrations.synthetic import RESTING_HAND, RESTING_SHOULDER, Demonstrator, Variation, table_place
from sim.persons import actions
from sim.persons.staging import Stop, staged

SMALL = {"columns": 2, "rows": 2, "repetitions": 1}


def hand(poses):
    return poses[:, 6:]


def nearest(poses, place):
    return np.linalg.norm(hand(poses) - place, axis=1).min()


@pytest.mark.parametrize("name", sorted(actions.SHOWN))
def test_movements_are_those_of_an_arm(name):
    shown = actions.redirect(extra=0, repetitions=1) if name == "redirect" else actions.SHOWN[name](**SMALL)
    assert shown.theta.shape == (len(shown.sequences), len(shown.description.parameter_names))
    assert shown.description.action == name
    assert 1.0 < shown.description.duration < 8.0
    for poses in shown.sequences:
        assert poses.shape[1] == 9
        upper = np.linalg.norm(poses[:, 3:6] - poses[:, :3], axis=1)
        lower = np.linalg.norm(poses[:, 6:] - poses[:, 3:6], axis=1)
        np.testing.assert_allclose(upper, 0.26, rtol=0.0, atol=0.01)
        np.testing.assert_allclose(lower, 0.442, rtol=0.0, atol=0.015)


def test_pointing_goes_to_theta_and_back():
    shown = actions.pointing(**SMALL)
    for poses, theta in zip(shown.sequences, shown.theta, strict=True):
        assert nearest(poses, table_place(theta)) < 0.03
        for end in (poses[0], poses[-1]):
            assert np.linalg.norm(end[6:] - RESTING_HAND) < 0.12


def test_parts_of_pointing_meet_at_the_place():
    out, back = actions.point(**SMALL), actions.withdraw(**SMALL)
    for poses, theta in zip(out.sequences, out.theta, strict=True):
        assert np.linalg.norm(poses[-1, 6:] - table_place(theta)) < 0.03
        assert np.linalg.norm(poses[0, 6:] - RESTING_HAND) < 0.12
    for poses, theta in zip(back.sequences, back.theta, strict=True):
        assert np.linalg.norm(poses[0, 6:] - table_place(theta)) < 0.03
        assert np.linalg.norm(poses[-1, 6:] - RESTING_HAND) < 0.12


def test_redirect_goes_from_one_place_to_the_other():
    shown = actions.redirect(extra=2, repetitions=1)
    assert len(shown.sequences) == 16 + 9 + 2
    for poses, theta in zip(shown.sequences, shown.theta, strict=True):
        assert np.linalg.norm(poses[0, 6:] - table_place(theta[:2])) < 0.04
        assert np.linalg.norm(poses[-1, 6:] - table_place(theta[2:])) < 0.04


def test_the_two_carrying_actions_visit_the_same_places_in_the_other_order():
    taken, brought = actions.table_to_box(**SMALL), actions.box_to_table(**SMALL)
    for shown, table_first in ((taken, True), (brought, False)):
        for poses, theta in zip(shown.sequences, shown.theta, strict=True):
            at_table = int(np.linalg.norm(hand(poses) - table_place(theta), axis=1).argmin())
            at_box = int(np.linalg.norm(hand(poses) - actions.BOX_PLACE, axis=1).argmin())
            assert (at_table < at_box) == table_first


def test_pouring_puts_the_glass_back():
    shown = actions.pouring(**SMALL)
    for poses, theta in zip(shown.sequences, shown.theta, strict=True):
        near = np.linalg.norm(hand(poses) - table_place(theta), axis=1) < 0.07
        at_pot = int(np.linalg.norm(hand(poses) - actions.POT_PLACE, axis=1).argmin())
        assert near[:at_pot].any()
        assert near[at_pot:].any()


def test_far_plane():
    places = actions.far_place(np.array([[0.0, 0.0], [0.3, 0.8], [1.0, 1.0]]))
    np.testing.assert_allclose(places[[0, -1], 1] - actions.FAR_ORIGIN[1], [0.0, -actions.FAR_SPAN[0]], atol=1e-12)
    np.testing.assert_allclose(places[[0, -1], 2] - actions.FAR_ORIGIN[2], [0.0, actions.FAR_SPAN[1]], atol=1e-12)
    assert (np.diff(places[:, 1]) < 0).all(), "u runs to the right"
    assert (np.diff(places[:, 2]) > 0).all(), "v runs upwards"


def test_fingertip_is_between_eye_and_far_target():
    target, lengths = actions.far_place((0.2, 0.7)), ArmLengths()
    tip = actions.fingertip_towards(target, lengths)
    reach = lengths.upper_arm + lengths.forearm + lengths.fingertip
    assert np.linalg.norm(tip - RESTING_SHOULDER) == pytest.approx(actions.FAR_REACH * reach, abs=1e-9)
    line = (target - actions.EYE) / np.linalg.norm(target - actions.EYE)
    assert np.linalg.norm(np.cross(tip - actions.EYE, line)) < 1e-9


def test_staged_movement_is_at_its_stops_when_it_says():
    person = Demonstrator(variation=Variation.none())
    places = [table_place((0.2, 0.4)), table_place((0.8, 0.9))]
    moved = staged([Stop(places[0]), Stop(places[1])], person, np.random.default_rng(0))
    tip = moved.points.reshape(len(moved.points), 7, 3)[:, 5]
    for place, arrives, leaves in zip(places, moved.arrives_s, moved.leaves_s, strict=True):
        for time in (arrives + 0.02, leaves - 0.02):
            assert np.linalg.norm(tip[round(time * 60)] - place) < 0.002
    assert not moved.holds.any()
    assert np.linalg.norm(np.diff(tip, axis=0), axis=1).max() * 60 < 4.0, "no jumps"


def test_an_object_is_held_between_two_stops():
    person = Demonstrator(variation=Variation.none())
    stops = actions.carrying_stops(table_place((0.3, 0.3)), actions.BOX_PLACE)
    moved = staged(stops, person, np.random.default_rng(0))
    held = np.flatnonzero(moved.holds) / 60
    assert moved.arrives_s[0] < held[0] < moved.leaves_s[0]
    assert moved.arrives_s[1] < held[-1] < moved.leaves_s[1]


def test_without_stops_there_is_no_movement():
    with pytest.raises(ValueError, match="at least one stop"):
        staged([], Demonstrator(), np.random.default_rng(0))
