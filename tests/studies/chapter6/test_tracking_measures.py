"""What is measured of a track."""

import numpy as np
import pytest

from studies.chapter6.goals import goals_of
from studies.chapter6.measures import Track
from studies.chapter6.summary import accuracy, dual, quantile, recognition, summarised
from tests.studies.chapter6.synthetic_tracks import CAMERA, act, detection, result


def off_between(first_s, last_s, by=(0.3, 0.0, 0.0)):
    return lambda times: np.where(((times >= first_s) & (times < last_s))[:, None], by, 0.0)


def by_name(goals):
    return {goal.what: goal for goal in goals}


def test_hand_errors_are_pooled_over_all_frames_of_all_tracks():
    long = result(acts=[act(), act(start_s=4.0)], error=(0.0, 0.02, 0.0))
    short = result(error=(0.01, 0.0, -0.03))
    tracks = [Track(long), Track(short)]
    share = len(tracks[1].times_s) / sum(len(track.times_s) for track in tracks)
    expected = [np.sqrt(share), 2.0 * np.sqrt(1.0 - share), 3.0 * np.sqrt(share)]
    np.testing.assert_allclose(accuracy(tracks)["hand_rms"], expected, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("views", "by", "last_s", "lost"),
    [
        ((0, 1, 2, 3), 0.16, 1.5, True),
        ((0, 1, 2, 3), 0.16, 1.375, False),  # three frames at 8 Hz are shorter than half a second
        ((0, 1, 2, 3), 0.14, 3.0, False),
        ((1,), 0.16, 3.0, False),
        ((1,), 0.26, 1.5, True),
        ((1, 3), 0.16, 1.5, True),
    ],
)
def test_a_performance_is_lost_when_the_hand_is_off_for_long_enough(views, by, last_s, lost):
    track = Track(result(views=views, error=off_between(1.0, last_s, (by, 0.0, 0.0))))
    assert track.is_lost(track.acts[0]) is lost


def test_a_hand_that_is_off_between_two_performances_loses_neither():
    track = Track(result(acts=[act(), act(start_s=5.0)], error=off_between(3.2, 4.9)))
    assert [track.is_lost(one) for one in track.acts] == [False, False]


def test_what_the_tracker_says_of_itself_is_counted_apart():
    stored = result(error=off_between(1.0, 2.0))
    stored["values"]["lost"][10] = 1
    found = accuracy([Track(stored), Track(result())])
    assert (found["performances"], found["lost"], found["said_lost"], found["lost_and_said"]) == (2, 1, 1, 1)


def test_the_detection_nearest_to_the_arrival_counts_and_a_missing_one_is_infinitely_far():
    one = act(targets=((0.2, 0.1, 0.07), (0.0, -0.2, 0.07)))  # arrives at 1.5 s and 3 s, leaves half a second later
    near = [
        detection(1, 1.1, (0.9, 0.1, 0.07)),
        detection(2, 1.6, (0.23, 0.1, 0.07)),
        detection(3, 0.9, one["targets"][0]),
    ]
    track = Track(result(acts=[one], detected=near))
    np.testing.assert_allclose(track.target_errors(), [0.03, np.inf], rtol=0.0, atol=1e-9)


def test_a_missing_detection_is_beyond_the_90_percent_quantile():
    errors = np.array([0.01] * 9 + [np.inf])
    assert quantile(errors, 0.9) == 0.01
    assert quantile(np.append(errors, np.inf), 0.9) == np.inf


def test_the_distance_of_a_recorded_persons_target_is_not_asked_for():
    target = (1.7, 0.1, 0.3)
    stored = result("recorded", acts=[act("recorded_pointing", targets=(target,))])
    shoulder = np.array(stored["truth"]["poses"][0][:3])
    stored["values"]["detected"][0]["place"] = (shoulder + 0.8 * (np.array(target) - shoulder)).tolist()
    track = Track(stored)
    assert track.target_errors()[0] < 1e-9
    track.kind = "pointing"
    assert track.target_errors()[0] > 0.3


def test_an_error_is_split_into_depth_and_what_lies_across():
    track = Track(result(views=(1,), error=(0.0, 0.0, 0.05)))
    along, across = track.sight_errors()
    np.testing.assert_allclose(along**2 + across**2, 0.05**2, rtol=1e-9)
    line = track.true_poses[:, -3:] - CAMERA
    np.testing.assert_allclose(along, 0.05 * line[:, 2] / np.linalg.norm(line, axis=1), rtol=1e-9)


def test_an_action_is_recognised_by_the_frame_of_the_grasp_at_the_latest():
    stored = result("box", acts=[act("table_to_box", grasp_s=1.7)])
    times = np.array(stored["values"]["times_s"])
    stored["values"]["actions"]["table_to_box"] = np.where(times > 1.7, 0.9, 0.3).tolist()
    assert recognition([Track(stored)])["right"] == 0
    stored["values"]["actions"]["table_to_box"] = np.where(times > 1.6, 0.9, 0.3).tolist()
    assert recognition([Track(stored)]) == {"of": 1, "right": 1, "share": 1.0}


def complex_track(redirecting=(6.5, 7.6)):
    """A simple and a dual pointing, each target detected on arrival; when redirecting is more than half-way."""
    targets = ((0.2, 0.1, 0.07), (0.0, -0.2, 0.07))
    acts = [act("point_withdraw", 0.5), act("point_redirect_withdraw", 5.0, targets)]
    said = [
        detection(1, 1.5, targets[0], ["point", "redirect"]),
        detection(2, 6.0, targets[0], ["point"]),
        detection(3, 7.5, (0.0, -0.2, 0.17), ["withdraw"]),
    ]
    stored = result("complex", acts=acts, detected=said)
    times = np.array(stored["values"]["times_s"])
    late = ((times >= redirecting[0]) & (times <= redirecting[1]))[:, None] * (np.arange(20) >= 10) * 0.09
    stored["values"]["tau"]["redirect"] = late.tolist()
    return Track(stored)


def test_a_dual_pointing_is_one_with_a_target_that_was_reached_by_redirecting():
    found = dual([complex_track()])
    assert (found["of"], found["right"], found["dual"], found["share by the posterior"]) == (2, 2, 1, 1.0)
    assert found["share by the name"] == 0.5, "the grammar had gone on to withdrawing"
    np.testing.assert_allclose([found["first_median"], found["second_median"]], [0.0, 10.0], rtol=0.0, atol=1e-9)


def test_redirecting_without_a_target_is_no_dual_pointing():
    found = dual([complex_track(redirecting=(6.2, 6.9))])  # the next target is reported 0.6 s later
    assert (found["right"], found["share by the posterior"]) == (1, 1.0)
    assert dual([complex_track(redirecting=(1.2, 1.4))])["right"] == 0, "the simple one is taken for dual as well"


def test_the_median_filter_takes_single_outliers_away():
    def spike(times):
        return np.where((np.arange(len(times)) == 40)[:, None], (0.5, 0.0, 0.0), 0.0)

    found = summarised([Track(result("pointing_50fps", views=(2,), error=spike, rate_hz=50.0))])["table 6.1"]
    assert found["estimate: max"][0] == pytest.approx(50.0)
    assert found["median: max"][0] < 3.0


def test_goals_are_met_by_exact_tracks_and_missed_by_bad_ones():
    def all_of(error, detected=None):
        kinds = ("pointing", "pouring", "pointing_far", "recorded")
        return [
            Track(result(kind, number, views, error=error, detected=detected))
            for kind in kinds
            for number in range(25)
            for views in ((0, 1, 2, 3), (0,))
        ]

    good, bad = by_name(goals_of(all_of(None))), by_name(goals_of(all_of(off_between(0.5, 3.0), [])))
    judged = {what for what, goal in good.items() if goal.met is not None}
    assert len(judged) >= 16
    assert {what for what, goal in bad.items() if goal.met is not None} == judged
    assert all(good[what].met for what in judged)
    assert not any(bad[what].met for what in judged)
    assert bad["lost, four views"].measured == "100.0 %"
    assert bad["four views: target on the table, 90 %"].measured == "not detected"


def test_a_share_of_2_percent_is_not_judged_by_few_performances():
    goals = by_name(goals_of([Track(result(number=number)) for number in range(99)]))
    assert goals["lost, four views"].met is None
    assert "only 99 performances" in goals["lost, four views"].of


def test_the_clips_are_hard_if_the_simple_likelihood_loses_a_tenth():
    kept = [Track(result(number=number, likelihood="simple")) for number in range(9)]
    lost = Track(result(number=9, likelihood="simple", error=off_between(1.0, 2.0)))
    what = "the clips are hard: the simple likelihood loses"
    assert by_name(goals_of(kept))[what].met is False
    assert by_name(goals_of([*kept, lost]))[what].met is True


def test_directions_are_compared_as_seen_from_the_shoulder():
    stored = result(detected=[])
    assert Track(stored).target_angles() == [np.inf]
    shoulder, true = np.array(stored["truth"]["poses"][0][:3]), np.array((0.2, 0.1, 0.07))
    line = true - shoulder
    aside = np.cross(line, (0.0, 0.0, 1.0))
    place = shoulder + 3.0 * (line + np.tan(0.1) * np.linalg.norm(line) * aside / np.linalg.norm(aside))
    assert Track(result(detected=[detection(1, 1.5, place)])).target_angles() == [pytest.approx(0.1)]


def test_every_track_is_told_with_its_performances():
    (found,) = summarised([Track(result(number=5, views=(2,), error=off_between(1.0, 2.0)))])["tracks"]
    assert (found["clip"], found["views"], found["held_out"]) == ("pointing_05", [3], True)
    assert (found["lost"], found["off_s"], found["said_lost"]) == ([True], [1.0], [False])


def test_what_a_model_infers_from_true_poses_counts_once_per_clip():
    off = act(targets=((0.2, 0.1, 0.07),)) | {"from_true_poses": [0.2, 0.13, 0.03]}
    tracks = [Track(result(views=views, acts=[off])) for views in ((0, 1, 2, 3), (0,), (1,))]
    found = summarised(tracks)["models"]["pointing"]
    assert found == {"of": 1, "median": pytest.approx(5.0), "p90": pytest.approx(5.0)}
