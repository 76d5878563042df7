"""A movement of the arm from the key points of one and of two cameras."""

from dataclasses import replace

import numpy as np
import pytest

from paramove.demonstrations import RESTING_SHOULDER
from paramove.documents import InputError
from paramove.observation import ArmSizes, reconstructed
from studies.teaching.experiment import cameras
from studies.teaching.simulated_person import RATE_HZ, SIZES, key_points, movement

TARGET = np.array([0.2, 0.05, 0.0])


@pytest.fixture(scope="module")
def poses():
    """A rest, a movement to the target, and the touch."""
    whole = movement(TARGET, np.random.default_rng(1))
    arrived = int(np.linalg.norm(whole[:, 6:9] - TARGET, axis=1).argmin())
    return whole[: arrived + 10]


def shown(poses, count, seed=0):
    rng = np.random.default_rng(seed)
    return [key_points(poses, camera, rng) for camera in cameras(count)]


def times(poses):
    return np.arange(len(poses)) / RATE_HZ


def test_two_cameras_need_no_measures(poses):
    found = reconstructed(cameras(2), times(poses), shown(poses, 2))
    off = np.linalg.norm(found.fingertip - poses[:, 6:9], axis=1)
    assert np.median(off) < 0.06
    lengths = np.median(found.lengths, axis=0)
    np.testing.assert_allclose(lengths, [SIZES.upper_arm, SIZES.forearm, 0.5 * SIZES.hand], rtol=0.0, atol=0.03)


def test_a_touched_position_holds_the_end(poses):
    at = times(poses)[-1] - 0.3
    found = reconstructed(cameras(2), times(poses), shown(poses, 2), touched=(TARGET, at))
    assert np.linalg.norm(found.fingertip[times(poses) >= at] - TARGET, axis=1).max() < 0.005


def test_one_camera_with_measures(poses):
    at = times(poses)[-1] - 0.3
    found = reconstructed(
        cameras(1), times(poses), shown(poses, 1), sizes=SIZES, shoulder=RESTING_SHOULDER, touched=(TARGET, at)
    )
    assert np.median(np.linalg.norm(found.fingertip - poses[:, 6:9], axis=1)) < 0.25, "the network's depth is off"
    np.testing.assert_allclose(found.lengths[:, 0], SIZES.upper_arm, rtol=0.0, atol=0.03)


def test_a_constant_error_of_depths_is_found(poses):
    """Where the hand is at the end is known, and where it hangs at the start."""
    at, tracks = times(poses)[-1] - 0.3, shown(poses, 1)
    known = {"sizes": SIZES, "shoulder": RESTING_SHOULDER, "touched": (TARGET, at), "hangs_until_s": 0.5}
    clean = reconstructed(cameras(1), times(poses), tracks, **known)
    for one in tracks[0]:
        one.depths[:, 1:] += 0.15
    found = reconstructed(cameras(1), times(poses), tracks, **known)
    assert np.median(np.linalg.norm(found.fingertip - clean.fingertip, axis=1)) < 0.06, "of 15 cm"


def test_exchanged_sides_are_found(poses):
    tracks = shown(poses, 2)
    clean = reconstructed(cameras(2), times(poses), tracks)
    swapped = np.random.default_rng(3).random(len(poses)) < 0.25
    tracks[0] = [one.exchanged() if swap else one for one, swap in zip(tracks[0], swapped, strict=True)]
    found = reconstructed(cameras(2), times(poses), tracks)
    clear = clean.sides[0] < 2
    assert (found.sides[0] == np.where(swapped, 1 - clean.sides[0], clean.sides[0]))[clear].mean() > 0.9
    assert np.median(np.linalg.norm(found.fingertip - clean.fingertip, axis=1)) < 0.02


def test_a_lens_that_distorts_changes_little(poses):
    lenses = [replace(one, distortion=np.array([-0.25, 0.06, 0.001, -0.001, 0.0])) for one in cameras(2)]
    rng = np.random.default_rng(0)
    found = reconstructed(lenses, times(poses), [key_points(poses, lens, rng) for lens in lenses])
    plain = reconstructed(cameras(2), times(poses), shown(poses, 2))
    assert np.median(np.linalg.norm(found.fingertip - plain.fingertip, axis=1)) < 0.02


def test_images_may_be_missing(poses):
    tracks = shown(poses, 2)
    tracks[1] = [None if number % 3 else one for number, one in enumerate(tracks[1])]
    found = reconstructed(cameras(2), times(poses), tracks)
    assert (found.sides[1] == -1).sum() == sum(number % 3 > 0 for number in range(len(poses)))
    assert np.median(np.linalg.norm(found.fingertip - poses[:, 6:9], axis=1)) < 0.06


@pytest.mark.parametrize(
    ("given", "message"),
    [({}, "one camera"), ({"sizes": ArmSizes()}, "one camera"), ({"short": True}, "three or more")],
)
def test_what_is_not_enough_is_an_error(poses, given, message):
    few = poses[:2] if given.pop("short", False) else poses
    with pytest.raises(InputError, match=message):
        reconstructed(cameras(1), times(few), shown(few, 1), **given)
