"""Points in space from calibrated cameras: exact without noise, as uncertain as stated with it, refused when blind."""

import numpy as np
import pytest

from paramove.cameras import stereo
from paramove.cameras.stereo import StereoError, StereoRig
from tests.cameras.board_scene import camera, looking

LEFT = camera("left", looking((1.0, 0.4, 0.5), (0.2, 0.0, 0.1)), k1=-0.2)
RIGHT = camera("right", looking((0.9, -0.5, 0.6), (0.2, 0.0, 0.1)), k1=0.1)
ABOVE = camera("above", looking((0.3, 0.1, 1.4), (0.2, 0.0, 0.1)), k1=-0.05)
SPACE = np.random.default_rng(0).uniform((0.0, -0.2, 0.0), (0.4, 0.2, 0.3), (200, 3))


def seen(cameras, points=SPACE):
    return np.stack([eye.project(points) for eye in cameras])


@pytest.mark.parametrize("cameras", [(LEFT, RIGHT), (LEFT, RIGHT, ABOVE)], ids=len)
def test_exact_without_noise(cameras):
    found = StereoRig(cameras).triangulate(seen(cameras))
    np.testing.assert_allclose(found.points, SPACE, rtol=0, atol=1e-7)
    np.testing.assert_allclose(found.residuals_px, 0.0, rtol=0, atol=1e-4)
    assert found.known.all()
    assert (found.angles_deg > 20).all()


@pytest.mark.parametrize("cameras", [(LEFT, RIGHT), (LEFT, RIGHT, ABOVE)], ids=len)
def test_errors_are_as_large_as_stated(cameras):
    """Squared Mahalanobis distances of 3-D errors have mean 3."""
    draw = np.random.default_rng(1)
    pixels = seen(cameras)
    found = StereoRig(cameras).triangulate(pixels + draw.normal(0, 0.4, pixels.shape), sigma_px=0.4)
    errors = found.points - SPACE
    squared = np.einsum("ni,nij,nj->n", errors, np.linalg.inv(found.covariances), errors)
    assert 2.5 < squared.mean() < 3.5
    assert 0.8 < np.sqrt(np.mean(np.sum(errors**2, axis=1)) / np.mean(found.deviations**2)) < 1.2
    assert np.median(found.deviations) < 0.0015


def test_refined_points_fit_best(monkeypatch):
    """No place near by fits better. The linear solution is worse: a near and a far camera are weighed wrongly."""
    eyes = [camera("near", looking((0.7, 0.3, 0.3), (0.2, 0.0, 0.1)), k1=0.0, k2=0.0)]
    eyes.append(camera("far", looking((3.0, -1.5, 1.5), (0.2, 0.0, 0.1)), k1=0.0, k2=0.0))
    eyes = [type(eye)(eye.name, 640, 480, eye.matrix, np.zeros(0), eye.camera_from_world) for eye in eyes]
    noisy = seen(eyes) + np.random.default_rng(2).normal(0, 1.0, (2, len(SPACE), 2))

    def misfit(points):
        return np.sum((seen(eyes, points) - noisy) ** 2, axis=(0, 2))

    found = StereoRig(eyes).triangulate(noisy)
    for step in 1e-4 * np.vstack([np.eye(3), -np.eye(3)]):
        assert (misfit(found.points) < misfit(found.points + step)).all()
    np.testing.assert_allclose(found.residuals_px**2, misfit(found.points) / 2, rtol=1e-6, atol=0)
    monkeypatch.setattr(stereo, "STEPS", 0)
    linear = StereoRig(eyes).triangulate(noisy)
    assert (misfit(linear.points) > misfit(found.points)).all()
    assert np.median(misfit(linear.points) / misfit(found.points)) > 1.01


def test_points_of_one_view_are_left_out():
    pixels = seen((LEFT, RIGHT, ABOVE))
    pixels[0, :50] = np.nan
    pixels[1, :20] = np.nan
    found = StereoRig((LEFT, RIGHT, ABOVE)).triangulate(pixels)
    assert not found.known[:20].any()
    assert np.isnan(found.deviations[:20]).all()
    assert found.known[20:].all()
    np.testing.assert_allclose(found.points[20:], SPACE[20:], rtol=0, atol=1e-7)


def test_points_behind_a_camera_and_parallel_rays_are_left_out():
    beside = camera("beside", looking((1.0, 0.7, 0.5), (0.2, 0.3, 0.1)), k1=-0.2)
    exchanged = StereoRig((LEFT, beside)).triangulate(seen((beside, LEFT)))
    assert not exchanged.known.any(), "the rays meet behind the cameras"
    near = camera("near", looking((1.0, 0.412, 0.5), (0.2, 0.012, 0.1)), k1=-0.2)
    afar = np.array([[-3.0, 0.0, 0.0], [0.2, 0.0, 0.1]])
    found = StereoRig((LEFT, near)).triangulate(seen((LEFT, near), afar))
    assert found.angles_deg.max() < 1.0
    assert not found.known.any()


def test_cameras_at_one_place_are_refused():
    turned = camera("turned", looking((1.0, 0.4, 0.503), (0.0, 0.0, 0.1)))
    with pytest.raises(StereoError, match=r"left, turned stand 3\.0 mm apart.* Was one camera calibrated twice\?"):
        StereoRig((LEFT, turned))
    with pytest.raises(StereoError, match=r"1 camera found: .* need at least two"):
        StereoRig((LEFT,))


def test_wrong_shapes_are_refused():
    with pytest.raises(StereoError, match=r"shape \(2, 5\) found, \(2, N, 2\) expected"):
        StereoRig((LEFT, RIGHT)).triangulate(np.zeros((2, 5)))


def test_no_points():
    found = StereoRig((LEFT, RIGHT)).triangulate(np.zeros((2, 0, 2)))
    assert found.points.shape == (0, 3)
    assert found.known.shape == (0,)


def test_lenses_without_distortion():
    cameras = [camera(eye.name, eye.camera_from_world, k1=0.0, k2=0.0) for eye in (LEFT, RIGHT)]
    straight = [type(eye)(eye.name, 640, 480, eye.matrix, np.zeros(0), eye.camera_from_world) for eye in cameras]
    np.testing.assert_allclose(StereoRig(straight).triangulate(seen(straight)).points, SPACE, rtol=0, atol=1e-7)
