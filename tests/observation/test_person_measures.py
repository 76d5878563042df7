"""A simulated person measured from key points of one camera."""

from dataclasses import replace

import numpy as np
import pytest

from paramove.demonstrations import RESTING_SHOULDER
from paramove.documents import InputError
from paramove.observation import BodyKeyPoints, KeyPointOptions, PersonSetUp, measured_arm
from studies.teaching.experiment import cameras
from studies.teaching.simulated_person import SIZES, key_points, movement

CAMERA = cameras(1)[0]
EXACT = KeyPointOptions(outlier=1e-9, exchanged=1e-9, other=1e-9, elbow_depth=1e-6, hand_depth=1e-6)
DISTANCE = float(CAMERA.camera_from_world[2, :3] @ RESTING_SHOULDER + CAMERA.camera_from_world[2, 3])


@pytest.fixture(scope="module")
def poses():
    """A rest, and movements to three sides."""
    rng = np.random.default_rng(2)
    return np.concatenate([movement(target, rng) for target in ([0.2, 0.2, 0.0], [0.2, -0.5, 0.1], [0.3, 0.0, 0.4])])


def seen(poses, seed=0, options=EXACT):
    return key_points(poses, CAMERA, np.random.default_rng(seed), options)


def test_lengths_and_shoulder_follow_from_the_distance(poses):
    found = measured_arm(CAMERA, seen(poses), distance=DISTANCE)
    assert found.upper_arm == pytest.approx(SIZES.upper_arm, abs=2.0 * found.length_deviation)
    assert found.forearm == pytest.approx(SIZES.forearm, abs=2.0 * found.length_deviation)
    assert 0.01 < found.length_deviation < 0.03
    np.testing.assert_allclose(found.shoulder, RESTING_SHOULDER, rtol=0.0, atol=0.04)
    assert found.resting[8] < RESTING_SHOULDER[2] - 0.4, "the arm hangs"


def test_a_resting_arm_hangs_whatever_the_network_s_depth(poses):
    points, exact = seen(poses), measured_arm(CAMERA, seen(poses), distance=DISTANCE).resting
    for one in points:
        one.depths[0, 1] += 0.08
        one.depths[0, 2:] += 0.16
    resting = measured_arm(CAMERA, points, distance=DISTANCE).resting
    assert np.linalg.norm(resting[3:6] - exact[3:6]) < 0.04, "of 8 cm"
    assert np.linalg.norm(resting[6:9] - exact[6:9]) < 0.12, "of 16 cm"


def test_a_taller_person_is_farther_away(poses):
    near, far = (measured_arm(CAMERA, seen(poses), height=height) for height in (1.6, 1.9))
    ratio = np.linalg.norm(far.shoulder - CAMERA.position) / np.linalg.norm(near.shoulder - CAMERA.position)
    assert ratio == pytest.approx(1.9 / 1.6, rel=0.05)
    assert far.upper_arm > near.upper_arm


def test_nothing_known_is_a_mean_adult_and_uncertain(poses):
    found, known = measured_arm(CAMERA, seen(poses)), measured_arm(CAMERA, seen(poses), distance=DISTANCE)
    assert found.distance_deviation > 2.0 * known.distance_deviation
    np.testing.assert_allclose(found.shoulder, RESTING_SHOULDER, rtol=0.0, atol=3.0 * found.distance_deviation)


def test_the_network_s_belief_of_the_size_does_not_matter(poses):
    size = CAMERA.matrix[0, 0] / DISTANCE
    points = [
        BodyKeyPoints(one.positions, one.deviations, one.depths / 1.3, one.certainties, 1.0, 1.3 * size)
        for one in seen(poses)
    ]
    found, plain = measured_arm(CAMERA, points, distance=DISTANCE), measured_arm(CAMERA, seen(poses), distance=DISTANCE)
    np.testing.assert_allclose(found.resting, plain.resting, rtol=0.0, atol=1e-9)


def test_a_lens_that_distorts_changes_nothing(poses):
    lens = replace(CAMERA, distortion=np.array([-0.25, 0.06, 0.001, -0.001, 0.0]))
    through = measured_arm(lens, key_points(poses, lens, np.random.default_rng(0), EXACT), distance=DISTANCE)
    plain = measured_arm(CAMERA, seen(poses), distance=DISTANCE)
    np.testing.assert_allclose(through.resting, plain.resting, rtol=0.0, atol=0.01)
    assert through.upper_arm == pytest.approx(plain.upper_arm, abs=0.005)


def test_too_few_images_and_impossible_lengths_are_errors(poses):
    with pytest.raises(InputError, match="15 images"):
        measured_arm(CAMERA, [*seen(poses)[:15], BodyKeyPoints.nobody()], distance=DISTANCE)
    with pytest.raises(InputError, match="is the distance right"):
        measured_arm(CAMERA, seen(poses), distance=4.0 * DISTANCE)
    with pytest.raises(InputError, match="is the distance right"):
        measured_arm(CAMERA, seen(poses), distance=1.6 * DISTANCE)
    for wrong in ({"distance": 0.0}, {"height": 0.0}, {"height": 175.0}):
        with pytest.raises(InputError, match=next(iter(wrong))):
            PersonSetUp(CAMERA, **wrong)


def test_a_person_follows_the_prompts(poses):
    set_up, said = PersonSetUp(CAMERA, distance=DISTANCE), []
    assert "hang still" in set_up.prompt
    for points in seen(poses, options=KeyPointOptions(exchanged=0.02)):
        said.append(set_up.see(points))
        if set_up.arm is not None:
            break
    assert "the resting arm is detected" in said
    assert set_up.arm is not None
    np.testing.assert_allclose(set_up.arm.shoulder, RESTING_SHOULDER, rtol=0.0, atol=0.08)


def test_an_arm_that_does_not_move_is_asked_to(poses):
    set_up = PersonSetUp(CAMERA, distance=DISTANCE)
    said = [set_up.see(points) for points in seen(np.repeat(poses[:1], 120, axis=0))]
    assert "hardly moved" in "".join(said)
    assert set_up.arm is None
    assert set_up.see(BodyKeyPoints.nobody()) == ""
