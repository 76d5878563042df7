"""Performances: other persons than the demonstrator, honest labels, a third held out."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

from paramove.demonstrations.recorded_people import RecordingsError
from paramove.demonstrations.synthetic import RESTING_SHOULDER
from paramove.observation.arm_body import ArmSizes
from sim.persons.clips import FORMAT_VERSION
from sim.persons.performances import KINDS, REST, kind_named, perform, recording_of, split_of
from sim.persons.performers import draw_performer
from sim.persons.recorded import (
    direction_coordinates,
    direction_place,
    recorded_demonstrations,
    recorded_pointing,
)
from studies.chapter6.vocabularies import BY_OTHERS, knowledge_of

FROZEN = Path(__file__).resolve().parents[3] / "sim" / "performances_manifest.yaml"
MADE_UP = [kind.name for kind in KINDS if kind.name != "recorded"]
LENGTHS = ("upper_arm", "forearm", "hand")


def recordings():
    try:
        return recorded_pointing()
    except RecordingsError as error:
        pytest.skip(f"no recordings: {error}")


def test_there_are_enough_performances():
    acts = Counter({kind.name: kind.clips * (2 if kind.name in ("box", "complex") else 1) for kind in KINDS})
    assert min(acts.values()) >= 20
    assert acts.total() >= 100


def test_a_third_of_every_kind_is_held_out():
    for kind in KINDS:
        splits = Counter(split_of(number) for number in range(kind.clips))
        assert splits["held_out"] * 3 == kind.clips


def test_every_view_is_held_out_where_views_rotate():
    (rotating,) = (kind for kind in KINDS if kind.one_view)
    held = Counter(number % 4 for number in range(rotating.clips) if split_of(number) == "held_out")
    assert set(held.values()) == {2}


def test_persons_are_not_the_demonstrator():
    default = ArmSizes()
    drawn = [draw_performer(np.random.default_rng(seed)) for seed in range(200)]
    for name in LENGTHS:
        relative = np.array([getattr(person.sizes, name) for person in drawn]) / getattr(default, name)
        assert np.abs(relative - 1.0).max() <= 0.10
        assert relative.std() > 0.03
        error = np.array([getattr(person.measured, name) / getattr(person.sizes, name) for person in drawn]) - 1.0
        assert 0.02 < np.abs(error).max() <= 0.03 + 1e-12
    seats = np.array([person.shoulder - RESTING_SHOULDER for person in drawn])
    assert np.abs(seats[:, :2]).max() <= 0.03 + 1e-12
    assert np.abs([person.measured_shoulder - person.shoulder for person in drawn]).max() <= 0.005 + 1e-12
    tempo = np.array([person.demonstrator.timing.duration for person in drawn]) / 3.2
    assert tempo.min() > 0.74
    assert tempo.max() < 1.31
    assert tempo.std() > 0.1


@pytest.mark.parametrize("name", MADE_UP)
def test_performances_are_an_arms_and_go_where_they_say(name):
    for number in (0, 1):
        one = perform(kind_named(name), number)
        points, sizes = one.motion.points, one.person.sizes
        upper = np.linalg.norm(points[:, 2] - points[:, 1], axis=1)
        np.testing.assert_allclose(upper, sizes.upper_arm, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(
            np.linalg.norm(points[:, 3] - points[:, 2], axis=1), sizes.forearm, rtol=0, atol=0.015
        )
        assert np.linalg.norm(np.diff(points, axis=0), axis=2).max() * 60 < 5.0, "no jumps"
        assert len(one.labels) == len(points)
        assert one.labels[0] == one.labels[-1] == REST
        for act in one.acts:
            assert act.start_s < act.arrives_s[0] < act.leaves_s[-1] < act.end_s
            assert act.theta.shape == (len(act.targets), 2)
            for target, arrives, leaves in zip(act.targets, act.arrives_s, act.leaves_s, strict=True):
                at = round(30 * (arrives + leaves))
                grips = name in ("box", "pouring")
                place = one.motion.grip[at] if grips else points[at, 5]
                if name == "pointing_far":
                    assert np.linalg.norm(place - one.person.shoulder) > 0.5
                else:
                    assert np.linalg.norm(place - target) < 0.03


def test_the_same_number_gives_the_same_performance():
    kind = kind_named("complex")
    first, again, other = perform(kind, 3), perform(kind, 3), perform(kind, 4)
    np.testing.assert_array_equal(first.motion.points, again.motion.points)
    assert len(first.motion.points) != len(other.motion.points) or not np.allclose(
        first.motion.points, other.motion.points, rtol=0.0, atol=1e-3
    )


def test_both_actions_with_the_box_are_performed_about_equally_often():
    kind = kind_named("box")
    counts = Counter(act.action for number in range(kind.clips) for act in perform(kind, number).acts)
    assert min(counts.values()) >= 13


def test_grasping_is_told_and_the_object_follows():
    one = perform(kind_named("box"), 2)
    for number, act in enumerate(one.acts):
        assert act.start_s < act.grasp_s < act.end_s
        track = one.objects[number]
        grasped, placed = round(60 * act.grasp_s), round(60 * act.end_s)
        np.testing.assert_array_equal(track[0], track[grasped])
        assert np.linalg.norm(track[placed] - track[0]) > 0.1
        np.testing.assert_array_equal(track[placed], track[-1])


def test_simple_and_dual_pointing_alternate_and_are_labelled():
    kind = kind_named("complex")
    for number in range(4):
        one = perform(kind, number)
        assert sorted(act.action for act in one.acts) == ["point_redirect_withdraw", "point_withdraw"]
        assert set(one.labels) == {REST, "point", "redirect", "withdraw"}
        (dual,) = (act for act in one.acts if len(act.theta) == 2)
        assert np.linalg.norm(dual.targets[0] - dual.targets[1]) >= 0.20
        crossing = np.flatnonzero(one.labels == "redirect") / 60
        assert dual.arrives_s[0] < crossing[0] < dual.leaves_s[0] + 1e-9
        assert dual.arrives_s[1] < crossing[-1] < dual.leaves_s[1] + 1e-9


def test_unknown_kind_is_refused():
    with pytest.raises(ValueError, match="pointing_far"):
        kind_named("waving")


def test_directions_and_their_coordinates():
    theta = np.array([[0.1, 0.2], [0.9, 0.7]])
    line = direction_place(theta) - RESTING_SHOULDER
    angles = np.stack([np.arctan2(line[:, 1], line[:, 0]), np.arcsin(line[:, 2] / 2.0)], axis=1)
    np.testing.assert_allclose(direction_coordinates(angles), theta, rtol=0.0, atol=1e-12)


def test_recorded_people_have_arms_of_one_length():
    for one in recordings()[::20]:
        points = one.poses.reshape(-1, 3, 3)
        np.testing.assert_allclose(
            np.linalg.norm(points[:, 1] - points[:, 0], axis=1), one.sizes.upper_arm, rtol=0.0, atol=1e-9
        )
        forearm = np.linalg.norm(one.wrist - points[:, 1], axis=1)
        np.testing.assert_allclose(forearm, one.sizes.forearm, rtol=0.0, atol=0.02)
        assert 0.9 < one.sizes.upper_arm / ArmSizes().upper_arm < 1.1
        stretched = points[one.segment[1] - 1]
        pointed = stretched[2] - RESTING_SHOULDER
        target = direction_place(one.theta) - RESTING_SHOULDER
        assert pointed @ target / np.linalg.norm(pointed) / np.linalg.norm(target) > np.cos(np.deg2rad(35.0))


def test_recorded_performances_are_of_all_persons_and_held_out_alike():
    recordings()
    kind = kind_named("recorded")
    heights = Counter(round(perform(kind, number).person.scale, 3) for number in range(kind.clips))
    held = Counter(round(perform(kind, number).person.scale, 3) for number in range(2, kind.clips, 3))
    assert set(heights.values()) == {9}
    assert set(held.values()) == {3}


def test_a_recorded_person_is_not_in_the_training_set():
    everybody = recordings()
    shown = recorded_demonstrations(without_subject=2)
    assert len(shown.sequences) == sum(one.subject != 2 for one in everybody)
    assert shown.theta.shape == (len(shown.sequences), 2)


def test_one_can_tell_which_recording_a_clip_plays():
    recordings()
    for number in (0, 4, 8):
        played, source = perform(kind_named("recorded"), number), recording_of(number)
        np.testing.assert_array_equal(played.acts[0].theta[0], source.theta)
        assert played.person.scale == source.height
        own = recorded_demonstrations(of_subject=source.subject, without_target=source.target_id)
        assert 80 < len(own.sequences) < 135
        assert np.abs(own.theta - source.theta).max(axis=1).min() > 0.01


def test_the_model_of_a_recorded_person_knows_neither_the_direction_nor_by_others_the_person():
    recordings()
    source = recording_of(0)
    told = [knowledge_of(kind, 0).vocabulary.actions[0].model.description.source for kind in ("recorded", BY_OTHERS)]
    assert f"person {source.subject} without target {source.target_id}," in told[0]
    assert f"without person {source.subject}," in told[1]


def test_the_frozen_manifest_lists_all_clips():
    """Whoever changes the clips renders them and commits the new manifest."""
    frozen = YAML(typ="safe").load(FROZEN.read_text(encoding="utf-8"))
    assert frozen["version"] == FORMAT_VERSION
    expected = [(f"{kind.name}_{number:02d}", split_of(number)) for kind in KINDS for number in range(kind.clips)]
    assert [(one["name"], one["split"]) for one in frozen["clips"]] == expected
    for kind in KINDS[:3]:
        (listed,) = (one for one in frozen["clips"] if one["name"] == f"{kind.name}_07")
        length = (len(perform(kind, 7).motion.points) - 1) / 60.0
        assert listed["frames"] == int(length * kind.rate_hz) + 1
