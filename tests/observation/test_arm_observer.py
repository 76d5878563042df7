"""The likelihood is largest at the true posture, for one view and several, and bad input is answered as promised."""

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.cameras.calibrated import CalibratedCamera
from paramove.documents.input_error import InputError
from paramove.observation import ArmObserver, ArmSizes, ObservationOptions
from tests.observation.scenes import cluttered, displaced, rendered_person
from tests.observation.test_silhouette import drawn
from tests.observation.views import camera_at, four_cameras, some_poses

SIZES = ArmSizes()
CAMERAS = four_cameras(fovy_deg=35.0)
TRUE = some_poses(1, seed=5)[0]
POSES = np.vstack([TRUE, displaced(TRUE, 300, 0.05), some_poses(50, seed=6)])


@pytest.fixture(scope="module")
def pictures():
    return rendered_person(TRUE, CAMERAS)


def likelihoods(images, cameras=CAMERAS, poses=POSES, **options):
    observer = ArmObserver(SIZES, cameras, ObservationOptions(**options), threads=1)
    observer.look(images)
    return observer.log_likelihoods(poses)


def hands_error(values, poses=POSES):
    """Distance of the likeliest posture's hand from the true one, m."""
    return np.linalg.norm(poses[values.argmax(), 6:] - TRUE[6:])


def test_the_true_posture_is_the_likeliest_in_every_view(pictures):
    for picture, camera in zip(pictures, CAMERAS, strict=True):
        assert likelihoods([picture], [camera]).argmax() == 0


def test_the_simple_likelihood_has_the_true_posture_among_the_likeliest(pictures):
    for picture, camera in zip(pictures, CAMERAS, strict=True):
        values = likelihoods([picture], [camera], likelihood="simple")
        assert (values > values[0]).sum() <= 6


def test_four_views_find_the_true_posture(pictures):
    values = likelihoods(pictures)
    assert values.argmax() == 0
    far = np.linalg.norm(POSES[:, 6:] - TRUE[6:], axis=1) > 0.1
    assert values[far].max() < values[0] - 3.0


def test_a_missing_view_leaves_the_likelihood_of_the_others(pictures):
    without = likelihoods([pictures[0], None, pictures[2], pictures[3]])
    three = [0, 2, 3]
    assert_allclose(
        without, likelihoods([pictures[i] for i in three], [CAMERAS[i] for i in three]), rtol=0.0, atol=1e-12
    )
    assert not np.allclose(without, likelihoods(pictures), rtol=0.0, atol=1e-3)


def test_views_add_with_a_wider_gamma(pictures):
    each = [likelihoods([p], [c]) for p, c in zip(pictures, CAMERAS, strict=True)]
    assert_allclose(likelihoods(pictures, view_exponent=0.0), np.sum(each, axis=0), rtol=1e-9, atol=1e-9)
    assert_allclose(likelihoods(pictures, view_exponent=0.5), np.mean(each, axis=0), rtol=1e-9, atol=1e-9)


def test_no_image_tells_nothing():
    assert_allclose(likelihoods([None] * 4), 0.0, rtol=0.0, atol=0.0)


def test_a_posture_does_not_depend_on_its_neighbours_nor_on_the_threads(pictures):
    observer = ArmObserver(SIZES, CAMERAS, threads=3)
    observer.look(pictures)
    together = observer.log_likelihoods(POSES)
    assert_allclose(together, likelihoods(pictures), rtol=0.0, atol=0.0)
    assert_allclose(observer.log_likelihoods(POSES[7:8]), together[7:8], rtol=0.0, atol=0.0)
    assert observer.log_likelihoods(np.zeros((0, 9))).shape == (0,)


def test_each_look_counts_alone(pictures):
    observer = ArmObserver(SIZES, CAMERAS[:1], threads=1)
    observer.look([pictures[0]])
    first = observer.log_likelihoods(POSES)
    observer.look([cluttered(drawn(POSES[9], CAMERAS[0]))])
    observer.look([pictures[0]])
    assert_allclose(observer.log_likelihoods(POSES), first, rtol=0.0, atol=0.0)


def test_darker_and_brighter_pictures_give_the_same_likelihood(pictures):
    darker = (pictures[0] * 0.6).astype(np.uint8)
    first, second = (likelihoods([p], CAMERAS[:1]) for p in (pictures[0], darker))
    assert np.corrcoef(first, second)[0, 1] > 0.98
    assert hands_error(second) < 0.04


def test_colours_in_either_order_are_alike(pictures):
    """But for channels with gradients of one size and different direction, of which the first is taken."""
    first, second = (likelihoods([p], CAMERAS[:1]) for p in (pictures[0], pictures[0][..., ::-1]))
    assert_allclose(np.median(np.abs(first - second)), 0.0, rtol=0.0, atol=0.01)
    assert_allclose(first, second, rtol=0.0, atol=1.0)


def test_the_lens_is_undone_and_the_size_adapted():
    """The same scene through a lens with distortion at twice the size gives nearly the same likelihoods."""
    large = camera_at((1.2, -1.2, 0.8), (0.3, 0.25, 0.15), width_px=640, height_px=480, fovy_deg=50.0)
    lens = np.array([-0.30, 0.08, 0.0, 0.0])
    bent = CalibratedCamera("bent", 640, 480, large.matrix, lens, large.camera_from_world)
    picture = rendered_person(TRUE, [large])[0]
    rows, columns = np.indices((480, 640), dtype=np.float32)
    captured = np.stack([columns, rows], axis=-1).reshape(-1, 1, 2)
    ideal = cv2.undistortPoints(captured, large.matrix, lens, P=large.matrix).reshape(480, 640, 2).astype(np.float32)
    through_lens = cv2.remap(picture, ideal[..., 0], ideal[..., 1], cv2.INTER_LINEAR)
    straight, corrected = likelihoods([picture], [large]), likelihoods([through_lens], [bent])
    ignored = likelihoods([through_lens], [large])
    assert corrected[0] > ignored[0] + 1.0
    assert abs(corrected[0] - straight[0]) < 1.0
    assert np.corrcoef(straight, corrected)[0, 1] > 0.98 > np.corrcoef(straight, ignored)[0, 1]


def test_postures_that_are_none_and_postures_out_of_sight(pictures):
    broken = POSES[:3].copy()
    broken[1, 4] = np.nan
    broken[2, 8] = np.inf
    values = likelihoods(pictures, poses=broken)
    assert values[1] == values[2] == -np.inf
    assert np.isfinite(values[0])
    away = POSES[:1] + np.tile([0.0, 40.0, 0.0], 3)
    out_of_sight = likelihoods(pictures[:1], CAMERAS[:1], poses=away)
    assert_allclose(out_of_sight, -1.0 / (2.0 * ObservationOptions().gamma ** 2), rtol=1e-12, atol=0.0)
    assert out_of_sight[0] <= likelihoods(pictures[:1], CAMERAS[:1]).min()


def test_wrong_images_are_refused_and_leave_no_image(pictures):
    observer = ArmObserver(SIZES, CAMERAS[:2], threads=1)
    observer.look(pictures[:2])
    for images, message in (
        (pictures[:1], "expected 2 images.*found 1"),
        ([pictures[0][:100], None], "gives 320 x 100 px, calibrated are 320 x 240 px"),
        ([pictures[0].astype(float), None], r"an image \(H, W, 3\) uint8 expected, found .* float64"),
        ([pictures[0][..., 0], None], r"an image \(H, W, 3\) uint8 expected, found \(240, 320\) uint8"),
    ):
        with pytest.raises(InputError, match=message):
            observer.look(images)
        assert observer.has_image == (False, False)
    with pytest.raises(InputError, match="at least one"):
        ArmObserver(SIZES, [])
    with pytest.raises(InputError, match=r"expected poses \(M, 9\)"):
        observer.log_likelihoods(np.zeros(9))


def test_a_black_view_is_told(pictures):
    observer = ArmObserver(SIZES, CAMERAS[:3], threads=1)
    observer.look([pictures[0], np.zeros_like(pictures[1]), None])
    sharp, black, missing = observer.sharpness
    assert sharp > 10.0 > 2.0 > black
    assert np.isnan(missing)


def test_the_outline_is_in_pixels_of_the_captured_image(pictures):
    camera = camera_at((1.2, -1.2, 0.8), (0.0, -0.15, 0.15), width_px=640, height_px=480, fovy_deg=35.0)
    bent = CalibratedCamera("b", 640, 480, camera.matrix, np.array([-0.2, 0.05, 0, 0]), camera.camera_from_world)
    for seen_by in (camera, bent):
        loop = ArmObserver(SIZES, [seen_by], threads=1).outline(TRUE, 0)
        joints = seen_by.project(TRUE.reshape(3, 3))
        assert (joints.min(axis=0) > loop.min(axis=0) - 1.0).all()
        assert (joints.max(axis=0) < loop.max(axis=0) + 1.0).all()
        assert np.linalg.norm(loop - joints[2], axis=1).min() < 3.0  # the fingertip is on the outline


def test_options_are_checked():
    for wrong in ({"likelihood": "best"}, {"gamma": 0.0}, {"width_px": 5000}, {"key_point_px": 9.0}):
        with pytest.raises(InputError):
            ObservationOptions(**wrong)
