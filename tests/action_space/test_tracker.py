"""The whole tracker on poses of the synthetic demonstrator, seen by a noisy sensor in the world."""

import numpy as np
import pytest

from paramove.action_space.grammar import Grammar
from paramove.action_space.particle_filter import FilterOptions
from paramove.action_space.person import PersonPlacement
from paramove.action_space.propagation import PropagationOptions
from paramove.action_space.tracker import ActionTracker, TrackerOptions
from paramove.action_space.vocabulary import Vocabulary
from paramove.demonstrations import table_place
from paramove.documents.input_error import InputError
from paramove.observation import HAND
from tests.action_space.performances import arm_poses, gaussian, performed

PLACES = np.array([[0.25, 0.7], [0.8, 0.3]])
THESIS = TrackerOptions(filter=FilterOptions.thesis(), propagation=PropagationOptions.thesis())


def tracker(action, options=None, placement=None, seed=1):
    return ActionTracker(Vocabulary([action]), Grammar.loop(action.name), placement, options, seed)


def track(made, times, poses, until_s=np.inf):
    return [
        made.update(float(time_s), gaussian(made.placement.in_world(pose)))
        for time_s, pose in zip(times, poses, strict=True)
        if time_s <= until_s
    ]


@pytest.mark.parametrize("rate_hz", [8.0, 50.0])
@pytest.mark.parametrize("scale", [0.9, 1.0, 1.1])
def test_persons_of_any_size_are_followed_to_their_targets(pointing, rate_hz, scale):
    placement = PersonPlacement((0.1, 0.3, 0.5), scale)
    times, poses = performed(PLACES, np.random.default_rng(7), rate_hz)
    made = tracker(pointing, placement=placement)
    estimates = track(made, times, poses)
    hands = np.stack([estimate.pose[-3:] for estimate in estimates]) - placement.in_world(poses)[:, -3:]
    assert np.sqrt((hands**2).mean(axis=0)).max() < 0.025
    targets = {estimate.target.number: estimate.target for estimate in estimates if estimate.target is not None}
    assert sorted(targets) == [1, 2]
    for number, place in enumerate(PLACES, start=1):
        assert np.linalg.norm(targets[number].place - placement.in_world(table_place(place))) < 0.04
    assert not any(estimate.lost or estimate.degraded or estimate.detail for estimate in estimates)


@pytest.mark.parametrize("rate_hz", [8.0, 50.0])
def test_the_way_of_the_thesis_is_there(pointing, rate_hz):
    times, poses = performed(PLACES[:1], np.random.default_rng(7), rate_hz)
    target = track(tracker(pointing, THESIS), times, poses)[-1].target
    assert np.linalg.norm(target.place - table_place(PLACES[0])) < 0.05


def test_estimates_are_complete_and_consistent(pointing):
    times, poses = performed(PLACES[:1], np.random.default_rng(7), 15.0)
    estimate = track(tracker(pointing), times, poses, until_s=0.5 + 0.5 * 3.2)[-1]
    assert estimate.actions == {"pointing": pytest.approx(1.0)}
    assert estimate.action == "pointing"
    assert estimate.tau_histogram.shape == (1, 20)
    assert estimate.tau_histogram.sum() == pytest.approx(1.0)
    assert estimate.contact > 0.9
    assert 1.0 <= estimate.effective_sample_size <= 400.0
    assert estimate.theta["pointing"].deviation < 0.1
    assert np.linalg.eigvalsh(estimate.covariance).min() >= -1e-12
    assert np.isfinite(estimate.log_likelihood)
    np.testing.assert_allclose(estimate.targets["pointing"], table_place(estimate.theta["pointing"].mean))


def test_the_same_seed_gives_the_same_estimates(pointing):
    times, poses = performed(PLACES[:1], np.random.default_rng(7), 8.0)
    first, again, other = (track(tracker(pointing, seed=seed), times, poses)[-1] for seed in (3, 3, 4))
    np.testing.assert_array_equal(first.pose, again.pose)
    np.testing.assert_array_equal(first.tau_histogram, again.tau_histogram)
    assert (first.pose != other.pose).any()


def test_the_action_is_recognised(pointing, reaching):
    """A choice of two actions: only the hand's shape and height differ, and both begin alike."""
    times, poses = performed(PLACES[:1], np.random.default_rng(7), 15.0)
    vocabulary = Vocabulary([pointing, reaching])
    made = ActionTracker(vocabulary, Grammar.choice(["pointing", "reaching"]), seed=1)
    estimates = [made.update(float(t), gaussian(pose, 0.015)) for t, pose in zip(times, poses, strict=True)]
    assert 0.2 < estimates[3].actions["pointing"] < 0.8, "nothing is known in the base pose"
    middle = estimates[np.searchsorted(times, 0.5 + 0.5 * 3.2)]
    assert middle.actions["pointing"] > 0.9


def test_a_sharp_likelihood_is_flattened(pointing):
    times, poses = performed(PLACES[:1], np.random.default_rng(7), 8.0)
    made, estimates = tracker(pointing), []
    for time_s, pose in zip(times, poses, strict=True):
        estimates.append(made.update(float(time_s), gaussian(pose, 0.003)))
    assert min(estimate.temper for estimate in estimates) < 0.5
    assert min(estimate.effective_sample_size for estimate in estimates[1:]) > 35.0
    assert np.linalg.norm(estimates[-1].target.place - table_place(PLACES[0])) < 0.04


def test_an_arm_that_jumps_is_lost_and_found_again(pointing):
    times, poses = performed(PLACES, np.random.default_rng(7), 15.0)
    poses = poses.copy()
    gone = (times > 1.2) & (times < 3.4)
    poses[gone] += 0.4  # something else is taken for the arm
    estimates = track(tracker(pointing), times, poses)
    lost = np.array([estimate.lost for estimate in estimates])
    assert lost[(times > 2.2) & (times < 3.3)].all()
    assert not lost[times < 1.2].any()
    assert not lost[times > 4.6].any()
    detail = estimates[int(np.flatnonzero(lost)[3])].detail
    assert "lost" in detail
    assert "no target is detected" in detail
    last = estimates[-1].target
    assert np.linalg.norm(last.place - table_place(PLACES[1])) < 0.04, "the second performance is followed again"


@pytest.mark.parametrize("blind", [lambda poses: None, lambda poses: np.full(len(poses), -3.0)])
def test_without_a_view_the_pose_is_predicted_and_becomes_less_certain(pointing, blind):
    times, poses = performed(PLACES[:1], np.random.default_rng(7), 15.0)
    made = tracker(pointing)
    before = track(made, times, poses, until_s=1.2)[-1]
    for frame in range(1, 8):
        estimate = made.update(before.time_s + frame / 15.0, blind)
        assert estimate.degraded
        assert np.isfinite(estimate.pose).all()
    assert "no usable view for 0.4 s" in estimate.detail
    assert np.trace(estimate.covariance[HAND, HAND]) > 1.5 * np.trace(before.covariance[HAND, HAND])
    # It moves on by itself: nearer to where the hand is by then than to where it was.
    now = poses[np.searchsorted(times, estimate.time_s) - 1, -3:]
    assert np.linalg.norm(estimate.pose[-3:] - now) < np.linalg.norm(before.pose[-3:] - now)
    seen = made.update(estimate.time_s + 1.0 / 15.0, gaussian(now_pose(poses, times, estimate.time_s), 0.04))
    assert not seen.degraded
    assert seen.detail == ""


def now_pose(poses, times, time_s):
    return poses[np.searchsorted(times, time_s)]


def test_particles_that_cannot_be_measured_have_no_weight(pointing):
    made = tracker(pointing)
    pose = pointing.poses([0.5, 0.5], 0.0)[0]

    def measure(poses):
        values = gaussian(pose)(poses)
        values[::2] = np.nan
        return values

    estimate = made.update(0.0, measure)
    assert not estimate.degraded
    assert (made.filter.particles.weights[::2] == 0.0).all()
    assert made.update(0.1, lambda poses: np.full(len(poses), np.nan)).degraded
    assert made.update(0.2, lambda poses: np.full(len(poses), -np.inf)).degraded


def test_late_and_missing_frames(pointing):
    times, poses = performed(PLACES[:1], np.random.default_rng(7), 15.0)
    made = tracker(pointing)
    last = track(made, times, poses, until_s=1.2)[-1]
    late = made.update(last.time_s - 0.1, gaussian(poses[0]))
    assert "0.100 s older" in late.detail
    np.testing.assert_array_equal(late.pose, last.pose)
    # After a long gap the arm may be anywhere, also where the action is half done.
    far = arm_poses(poses)[len(poses) // 2]
    for frame in range(8):
        estimate = made.update(last.time_s + 5.0 + frame / 15.0, gaussian(far))
    assert np.linalg.norm(estimate.pose[-3:] - far[-3:]) < 0.05


def test_a_wrong_number_of_likelihoods_is_an_error(pointing):
    with pytest.raises(InputError, match="one log-likelihood for each of 400 poses"):
        tracker(pointing).update(0.0, lambda poses: np.zeros(3))
