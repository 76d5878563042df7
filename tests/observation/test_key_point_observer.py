"""Postures compared with key points: outliers, exchanged sides, and the corrected posture."""

import numpy as np
import pytest

from paramove.documents import InputError
from paramove.observation import ArmSizes, BodyKeyPoints, KeyPointObserver, KeyPointOptions
from tests.observation.views import four_cameras, some_bent_poses, some_poses

SIZES = ArmSizes()
CAMERAS = four_cameras()
LEFT_PX = np.array([60.0, 5.0])
"""Where a picture has the left arm, from the right one."""


def arm_points(pose, sizes=SIZES):
    shoulder, elbow, tip = pose[:9].reshape(3, 3)
    wrist = pose[9:] if len(pose) == 12 else elbow + sizes.forearm / sizes.lower_arm * (tip - elbow)
    return np.stack([shoulder, elbow, wrist, 0.5 * (wrist + tip)])


def seen(pose, camera, deviation=2.0):
    """The key points of a posture without any noise."""
    points = arm_points(pose)
    right, ahead = camera.project(points), points @ camera.camera_from_world[2, :3]
    positions = np.stack([right, right + LEFT_PX])
    depths = np.tile(ahead - ahead[0], (2, 1))
    return BodyKeyPoints(positions, np.full((2, 4), deviation), depths, np.ones((2, 4)), 1.0)


def observer(cameras=CAMERAS[:1], **options):
    return KeyPointObserver(SIZES, cameras, KeyPointOptions(**options))


@pytest.mark.parametrize("make", [some_poses, some_bent_poses])
def test_the_true_posture_is_the_likeliest(make):
    poses = make(60)
    comparing = observer()
    for number in range(5):
        comparing.look([seen(poses[number], CAMERAS[0])])
        assert comparing.log_likelihoods(poses).argmax() == number


def test_more_cameras_count_as_a_product():
    poses = some_poses(20)
    both, views = observer(CAMERAS[:2]), [seen(poses[3], camera) for camera in CAMERAS[:2]]
    both.look(views)
    expected = np.zeros(20)
    for camera, view in zip(CAMERAS, views, strict=False):
        one = observer([camera])
        one.look([view])
        expected += one.log_likelihoods(poses)
    np.testing.assert_allclose(both.log_likelihoods(poses), expected, rtol=1e-12)


def test_without_key_points_nothing_is_known():
    comparing = observer()
    for points in (None, BodyKeyPoints.nobody()):
        comparing.look([points])
        assert comparing.has_points == (False,)
        np.testing.assert_array_equal(comparing.log_likelihoods(some_poses(3)), np.zeros(3))
        np.testing.assert_array_equal(comparing.corrected(some_poses(1)[0]), some_poses(1)[0])


def test_a_posture_that_is_no_number_is_impossible():
    comparing, poses = observer(), some_poses(3)
    comparing.look([seen(poses[0], CAMERAS[0])])
    poses[1, 4] = np.nan
    found = comparing.log_likelihoods(poses)
    assert found[1] == -np.inf
    assert np.isfinite(found[[0, 2]]).all()


def test_another_number_of_views_is_an_error():
    with pytest.raises(InputError, match="1 cameras"):
        observer().look([None, None])


@pytest.mark.parametrize("wrong", [{"outlier": 0.0}, {"exchanged": 0.6}, {"model": 0.0}, {"along": -1.0}])
def test_wrong_options_are_errors(wrong):
    with pytest.raises(InputError, match=next(iter(wrong))):
        KeyPointOptions(**wrong)


def test_exchanged_sides_are_found():
    poses = some_poses(60)
    comparing, points = observer(), seen(poses[7], CAMERAS[0])
    comparing.look([points])
    named = comparing.log_likelihoods(poses)[7]
    comparing.look([points.exchanged()])
    found = comparing.log_likelihoods(poses)
    assert found.argmax() == 7
    expected = np.log(0.06 / (1.0 - 0.06 - 0.02))
    assert found[7] - named == pytest.approx(expected, abs=0.05)


def test_points_of_something_else_say_little():
    poses = some_poses(60)
    comparing, points = observer(), seen(poses[7], CAMERAS[0])
    points.positions[...] += 4000.0
    comparing.look([points])
    assert np.ptp(comparing.log_likelihoods(poses)) < 1e-9
    np.testing.assert_allclose(comparing.corrected(poses[7]), poses[7], rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("point", [1, 2, 3])
def test_a_single_outlier_hardly_moves_the_arm(point):
    """It is farther off than a posture of the filter may be: 5 cm are about 9 px here."""
    comparing, pose = observer(), some_poses(1)[0]
    points = seen(pose, CAMERAS[0])
    points.positions[0, point] += [0.0, 60.0]
    comparing.look([points])
    np.testing.assert_allclose(comparing.corrected(pose), pose, rtol=0.0, atol=0.01)


def test_an_unsure_filter_is_corrected_by_more():
    """The hand jumped by 40 px: outliers, unless the hypotheses are as far apart."""
    comparing, pose = observer(), some_poses(1)[0]
    true = pose + np.repeat([0.0, 0.0, 1.0], 3) * np.tile([0.0, 0.2, 0.22], 3)
    comparing.look([seen(true, CAMERAS[0])])
    unsure = np.diag(np.repeat([0.0, 0.02, 0.15], 3) ** 2)
    kept, moved = comparing.corrected(pose), comparing.corrected(pose, unsure)
    pixels = CAMERAS[0].project(np.stack([one[6:9] for one in (true, kept, moved)]))
    assert np.linalg.norm(pixels[1] - pixels[0]) > 20.0
    assert np.linalg.norm(pixels[2] - pixels[0]) < 5.0


@pytest.mark.parametrize("views", [1, 2])
def test_the_corrected_posture_is_where_it_is_seen(views):
    rng = np.random.default_rng(2)
    comparing, true = observer(CAMERAS[:views], wrist=1e-4), some_poses(1)[0]
    estimated = true + 0.02 * rng.standard_normal(9)
    comparing.look([seen(true, camera) for camera in CAMERAS[:views]])
    corrected = comparing.corrected(estimated)
    for camera in CAMERAS[:views]:
        meant = camera.project(arm_points(true))
        before, after = (
            np.linalg.norm(camera.project(arm_points(pose)) - meant, axis=1).max() for pose in (estimated, corrected)
        )
        assert after < 2.0 < before
    if views == 2:
        assert np.linalg.norm(corrected - true) < 0.5 * np.linalg.norm(estimated - true)


def test_one_view_hardly_changes_the_distance_from_the_camera():
    comparing, true = observer(), some_poses(1)[0]
    ray = true[6:9] - CAMERAS[0].position
    ray /= np.linalg.norm(ray)
    estimated = true.copy()
    estimated[6:9] += 0.05 * ray
    comparing.look([seen(true, CAMERAS[0])])
    assert np.linalg.norm(comparing.corrected(estimated)[6:9] - estimated[6:9]) < 0.01


def test_an_arm_is_detected_near_its_posture_only():
    comparing, poses = observer(), some_poses(2)
    assert not comparing.detects(poses[0])
    points = seen(poses[0], CAMERAS[0])
    comparing.look([points])
    assert comparing.detects(poses[0])
    assert comparing.detects(poses[0] + 0.03)
    assert not comparing.detects(np.full(9, np.nan))
    points.positions[...] += 4000.0
    assert not comparing.detects(poses[0])
