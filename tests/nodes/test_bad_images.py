"""Bad images end in a clear state and in no gesture: through camera, action tracker and recognizer."""

from __future__ import annotations

import numpy as np
import pytest

from nodes import action_tracker
from tests.action_space.drawn_arm import RATE_HZ, camera, drawn, write_setup
from tests.action_space.performances import performed
from tests.nodes.chain import through_the_chain
from tests.nodes.rendered_room import Room, scratching, second_person, waving

TABLE = ((-0.085, -0.66), (0.72, -0.66), (0.72, 0.72), (-0.085, 0.72))


@pytest.fixture(scope="module")
def config(tmp_path_factory):
    return action_tracker.Config.model_validate(write_setup(tmp_path_factory.mktemp("setup"), 2))


@pytest.fixture(scope="module")
def times():
    return performed([(0.4, 0.6)], np.random.default_rng(11), RATE_HZ)[0]


@pytest.fixture(scope="module")
def good():
    """A person points once; two views."""
    poses = performed([(0.4, 0.6)], np.random.default_rng(11), RATE_HZ)[1]
    return [list(drawn(poses, camera(number))) for number in (1, 2)]


def test_good_images_are_a_gesture_and_no_trouble(config, good, times):
    outcome = through_the_chain(config, good, times)
    assert len(outcome.gestures) == 1
    assert [state for state, _ in outcome.tracker] == ["ready"]


@pytest.mark.parametrize("kind", ["black", "frozen", "gone"])
@pytest.mark.parametrize("frame", [16, 23])
def test_no_usable_images_from_one_moment_on(config, good, times, kind, frame):
    """The hand is on its way to the target; that of frame 23 has arrived, but was not seen to stay."""
    bad = {"black": lambda view: np.zeros_like(view[0]), "frozen": lambda view: view[frame], "gone": lambda view: None}
    streams = [[image if n < frame else bad[kind](view) for n, image in enumerate(view)] for view in good]
    outcome = through_the_chain(config, streams, times)
    assert outcome.gestures == []
    assert outcome.tracker[-1] == ("degraded", "no images from any camera (camera_1, camera_2)")
    told = {"black": "dark", "frozen": "frozen", "gone": ""}[kind]
    for states in outcome.cameras:
        assert states[-1][0] == ("ready" if kind == "gone" else "degraded")
        assert told in states[-1][1] or kind == "black"


def test_a_camera_that_is_gone_and_comes_back_costs_no_gesture(config, good, times):
    streams = [good[0], [None if 10 <= n < 40 else image for n, image in enumerate(good[1])]]
    outcome = through_the_chain(config, streams, times)
    assert [state for state, _ in outcome.tracker] == ["ready", "degraded", "ready"]
    assert outcome.tracker[1][1].startswith("no images from camera_2")
    assert {one.views for one in outcome.estimates[-8:]} == {2}
    assert len(outcome.gestures) == 1


def test_images_of_the_wrong_size_never_reach_the_tracker(config, good, times):
    streams = [[image if n < 20 else image[::2, ::2].copy() for n, image in enumerate(view)] for view in good]
    outcome = through_the_chain(config, streams, times)
    assert outcome.gestures == []
    assert all("80 x 60 px, 160 x 120 expected" in states[-1][1] for states in outcome.cameras)
    assert outcome.tracker[-1][0] == "degraded"


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    folder = tmp_path_factory.mktemp("room")
    made = Room(folder)
    config = action_tracker.Config(cameras=folder / "cameras.yaml", person=folder / "person.yaml", table=TABLE)
    yield made, config, made.pointing(), made.empty()
    made.close()


def outcome_of(room, film):
    made, config = room[:2]
    return through_the_chain(config, made.noisy(film), np.arange(len(film[0])) / 15.0)


def unsure(outcome) -> bool:
    return any(one.lost or one.degraded for one in outcome.estimates)


@pytest.mark.slow
def test_a_room_without_a_person_points_at_nothing(room):
    assert outcome_of(room, [[gone] * 30 for gone in room[3]]).gestures == []


@pytest.mark.slow
@pytest.mark.parametrize("before_arrival", [12, 0, -1])
def test_a_person_who_leaves_is_lost_and_points_at_nothing(room, before_arrival):
    """Where a body hid the wall the picture changes, and hypotheses would gather there."""
    made, _, pointing, empty = room
    left = round(made.arrives_s * RATE_HZ) - before_arrival
    film = [[*view[:left], *[gone] * 40] for view, gone in zip(pointing, empty, strict=True)]
    outcome = outcome_of(room, film)
    assert outcome.gestures == []
    assert all(one.lost for one in outcome.estimates[left + 2 :])
    assert outcome.tracker[-1][0] == "degraded"
    assert "somebody came or left" in outcome.tracker[-1][1]


@pytest.mark.slow
def test_a_person_who_comes_back_is_found(room):
    pointing, empty = room[2:]
    film = [[*view[:15], *[gone] * 20, *view] for view, gone in zip(pointing, empty, strict=True)]
    outcome = outcome_of(room, film)
    assert [state for state, _ in outcome.tracker] == ["ready", "degraded", "ready"]
    assert len(outcome.gestures) == 1


@pytest.mark.slow
@pytest.mark.parametrize("movement", [waving, pytest.param(scratching, marks=pytest.mark.long)])
def test_what_is_not_in_the_vocabulary_is_lost_until_the_arm_rests_again(room, movement):
    made = room[0]
    outcome = outcome_of(room, made.moving(movement(made.rest)))
    assert outcome.gestures == []
    assert unsure(outcome)
    assert "degraded" in [state for state, _ in outcome.tracker]


@pytest.mark.slow
def test_a_second_person_who_waves_behind_changes_nothing(room):
    _, _, pointing, empty = room
    assert outcome_of(room, second_person([[view[0]] * 30 for view in pointing], empty)).gestures == []
    gestures = outcome_of(room, second_person(pointing, empty)).gestures
    assert len(gestures) == 1
    target = room[0].studio.performance.acts[0].targets[0]
    assert np.hypot(gestures[0].x - target[0], gestures[0].y - target[1]) < 0.06
