"""Detection of targets on beliefs made by hand (thesis 6.7.1.2, corrected)."""

import numpy as np
import pytest

from paramove.action_space.estimates import ThetaEstimate
from paramove.action_space.target_detection import DetectionOptions, TargetDetector
from paramove.documents.input_error import InputError
from paramove.hmm import minimum_jerk

GOAL = np.array([0.4, 0.1, 0.07])
BASE = np.array([0.0, -0.3, -0.3])


def hand_at(times, rest_s=0.4, out_s=1.2, begin_s=0.5):
    """Share of the way to the goal: out, rest, back."""
    arrive, leave = begin_s + out_s, begin_s + out_s + rest_s
    return minimum_jerk(times, begin_s, arrive) * (1.0 - minimum_jerk(times, leave, leave + out_s))


def estimate(deviation, theta=(0.3, 0.6)):
    return ThetaEstimate(np.asarray(theta, dtype=np.float64), deviation**2 * np.eye(2))


def detections(rate_hz, *, rest_s=0.4, deviation=0.05, noise_m=0.0, contact_everywhere=False, seed=0):
    """One performance; what the detector says after each frame."""
    rng = np.random.default_rng(seed)
    times = np.arange(0.0, 4.2, 1.0 / rate_hz)
    share = hand_at(times, rest_s)
    detector, found = TargetDetector(), []
    for time_s, one in zip(times, share, strict=True):
        hand = BASE + one * (GOAL - BASE) + noise_m * rng.standard_normal(3)
        contact = 1.0 if contact_everywhere or one > 0.9 else 0.0
        uncertain = max(deviation, 0.3 * (1.0 - one))
        found.append(detector.update(float(time_s), hand, contact, "point", estimate(uncertain), GOAL))
    return times, found


@pytest.mark.parametrize("rate_hz", [8.0, 15.0, 50.0])
@pytest.mark.parametrize("noise_m", [0.0, 0.004])
def test_one_target_is_detected_when_the_hand_arrives(rate_hz, noise_m):
    for seed in range(5):
        times, found = detections(rate_hz, noise_m=noise_m, seed=seed)
        assert found[-1] is not None
        assert found[-1].number == 1
        assert found[-1].time_s == pytest.approx(1.7, abs=0.3)
        first = times[[one is not None for one in found]][0]
        assert first < 2.2, "while the hand still rests"
        np.testing.assert_allclose(found[-1].theta, [0.3, 0.6], atol=1e-12)
        np.testing.assert_allclose(found[-1].place, GOAL, atol=1e-12)


@pytest.mark.parametrize("rate_hz", [8.0, 50.0])
def test_a_hand_that_hardly_rests_has_reached_its_target(rate_hz):
    _, found = detections(rate_hz, rest_s=0.0)
    assert found[-1] is not None
    assert found[-1].number == 1


def test_nothing_is_detected_while_theta_is_unknown():
    _, found = detections(15.0, deviation=0.25)
    assert found[-1] is None


def test_the_base_pose_is_no_target():
    """Without the condition on the progress the way back to the base pose would end at a second target."""
    _, found = detections(15.0)
    assert found[-1].number == 1
    rng_free = TargetDetector()
    times = np.arange(0.0, 4.2, 1.0 / 15.0)
    for time_s, one in zip(times, hand_at(times), strict=True):
        last = rng_free.update(float(time_s), BASE + one * (GOAL - BASE), 1.0, "point", estimate(0.05), GOAL)
    assert last.number == 2


def test_a_resting_hand_makes_its_target_more_certain():
    detector = TargetDetector()
    for frame in range(40):
        time_s = frame / 15.0
        share = float(minimum_jerk(np.array([time_s]), 0.2, 1.2)[0])
        theta = (0.3 + 0.2 * (-1.0) ** frame, 0.6)
        found = detector.update(time_s, BASE + share * (GOAL - BASE), 1.0, "point", estimate(0.1, theta), GOAL)
    assert found.number == 1
    np.testing.assert_allclose(found.theta, [0.3, 0.6], atol=0.02)


@pytest.mark.parametrize("rate_hz", [8.0, 50.0])
@pytest.mark.parametrize("apart_m", [0.15, 0.4, 0.7])
def test_two_targets_one_after_the_other(rate_hz, apart_m):
    detector, numbers, rng = TargetDetector(), [], np.random.default_rng(0)
    second = GOAL + np.array([0.0, -apart_m, 0.0])
    for time_s in np.arange(0.0, 3.0, 1.0 / rate_hz):
        first, over = (float(minimum_jerk(np.array([time_s]), *span)[0]) for span in ((0.1, 1.0), (1.4, 2.3)))
        hand = BASE + first * (GOAL - BASE) + over * (second - GOAL) + 0.002 * rng.standard_normal(3)
        theta = estimate(0.05, (0.3, 0.6) if over < 0.5 else (0.8, 0.6))
        found = detector.update(float(time_s), hand, 1.0 if first > 0.9 else 0.0, "point", theta, hand)
        numbers.append(0 if found is None else found.number)
    assert numbers[-1] == 2
    assert np.linalg.norm(found.place - second) < 0.03
    np.testing.assert_allclose(found.theta, [0.8, 0.6], atol=1e-9)


def test_a_hand_that_only_trembles_stays_at_its_target():
    """As an estimate of depth from one view does."""
    detector = TargetDetector()
    for frame in range(90):
        time_s = frame / 15.0
        share = float(minimum_jerk(np.array([time_s]), 0.2, 1.2)[0])
        tremble = 0.09 * float(minimum_jerk(np.array([time_s]), 2.0, 2.4)[0]) * np.array([1.0, 0.0, 0.0])
        place = GOAL + 0.5 * tremble
        found = detector.update(time_s, BASE + share * (GOAL - BASE) + tremble, 1.0, "point", estimate(0.1), place)
    assert found.number == 1


def test_a_hand_that_comes_back_from_nearby_has_the_target_since_it_first_arrived():
    """As one that pours beside the place of the glass, and puts the glass back."""
    detector, times = TargetDetector(), set()
    for time_s in np.arange(0.0, 5.0, 1.0 / 15.0):
        moved = [float(minimum_jerk(np.array([time_s]), *span)[0]) for span in ((0.1, 1.0), (1.5, 2.1), (2.9, 3.5))]
        hand = BASE + moved[0] * (GOAL - BASE) + 0.2 * (moved[1] - moved[2]) * np.array([0.0, 0.0, 1.0])
        contact = 1.0 if moved[0] > 0.9 and moved[1] - moved[2] < 0.1 else 0.0
        found = detector.update(float(time_s), hand, contact, "pour", estimate(0.05), GOAL)
        times |= set() if found is None else {(found.number, found.time_s)}
    assert len(times) == 1
    assert times.pop()[1] == pytest.approx(1.0, abs=0.2)


def test_the_same_place_pointed_at_twice_is_two_targets():
    detector = TargetDetector()
    for frame in range(120):
        time_s = frame / 15.0
        share = float(hand_at(np.array([time_s]))[0] + hand_at(np.array([time_s - 4.0]))[0])
        contact = 1.0 if share > 0.9 else 0.0
        found = detector.update(time_s, BASE + share * (GOAL - BASE), contact, "point", estimate(0.05), GOAL)
    assert found.number == 2


def test_a_lost_approach_is_forgotten():
    detector = TargetDetector()
    for frame in range(10):
        detector.update(frame / 15.0, BASE + 0.05 * frame * (GOAL - BASE), 0.0, "point", estimate(0.3), GOAL)
    detector.forget()
    assert detector.update(1.0, GOAL, 1.0, "point", estimate(0.01), GOAL) is None


def test_options_are_checked():
    with pytest.raises(InputError, match="still_speed < approach_speed"):
        DetectionOptions(still_speed=0.5, approach_speed=0.3)
    with pytest.raises(InputError, match="window_s is positive"):
        DetectionOptions(window_s=0.0)


def test_a_small_arm_is_detected_alike_if_distances_are_scaled():
    """The hand of a figure as large as a small robot goes slower and less far."""
    scale = 0.42
    times = np.arange(0.0, 4.2, 1.0 / 15.0)
    large, small = TargetDetector(), TargetDetector(DetectionOptions().scaled(scale))
    for time_s, share in zip(times, hand_at(times), strict=True):
        hand, contact = BASE + share * (GOAL - BASE), float(share > 0.9)
        uncertain = estimate(max(0.05, 0.3 * (1.0 - share)))
        first = large.update(float(time_s), hand, contact, "point", uncertain, GOAL)
        second = small.update(float(time_s), scale * hand, contact, "point", uncertain, scale * GOAL)
        assert (first is None) == (second is None)
    assert first is not None
    assert second.time_s == first.time_s
