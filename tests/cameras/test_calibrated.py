"""Calibrated cameras project as OpenCV does, undo the lens, and come back from their files and messages."""

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.cameras.calibrated import CalibratedCamera, read_cameras, write_cameras
from paramove.documents.input_error import InputError
from tests.observation.views import camera_at

LENS = np.array([-0.25, 0.08, 0.001, -0.002, 0.01])


def lens_camera(lens=LENS):
    camera = camera_at((1.4, -0.6, 0.7), (0.0, -0.1, 0.2), width_px=640, height_px=480)
    return CalibratedCamera("left", 640, 480, camera.matrix, lens, camera.camera_from_world)


def points(count=50):
    return np.random.default_rng(0).uniform([-0.3, -0.5, 0.0], [0.4, 0.3, 0.5], (count, 3))


def test_projection_is_opencvs():
    camera = lens_camera()
    turn, _ = cv2.Rodrigues(camera.camera_from_world[:3, :3])
    shift = camera.camera_from_world[:3, 3]
    theirs, _ = cv2.projectPoints(points(), turn, shift, camera.matrix, camera.distortion)
    assert_allclose(camera.project(points()), theirs[:, 0], rtol=0.0, atol=1e-6)
    theirs, _ = cv2.projectPoints(points(), turn, shift, camera.matrix, None)
    assert_allclose(camera.project(points(), distorted=False), theirs[:, 0], rtol=0.0, atol=1e-6)


def test_what_is_behind_the_camera_is_nowhere():
    camera = lens_camera()
    behind = 2.0 * camera.position - np.array([0.0, -0.1, 0.2])
    assert np.isnan(camera.project(behind)).all()


def test_a_point_of_the_captured_image_is_where_the_undistorted_image_shows_it():
    camera = lens_camera()
    place = np.array([0.25, -0.45, 0.02])
    captured, ideal = camera.project(place), camera.project(place, distorted=False)
    assert np.linalg.norm(captured - ideal) > 2.0
    image = np.zeros((480, 640, 3), np.uint8)
    cv2.circle(image, tuple(np.round(captured * 16).astype(int).tolist()), 5 * 16, (255, 255, 255), -1, cv2.LINE_AA, 4)
    shown = camera.undistort(image)[..., 0].astype(float)
    rows, columns = np.indices(shown.shape)
    centre = np.array([(shown * columns).sum(), (shown * rows).sum()]) / shown.sum()
    assert_allclose(centre, ideal, rtol=0.0, atol=0.25)


def test_resizing_keeps_the_borders_of_the_picture():
    camera = lens_camera(np.zeros(0))
    small = camera.resized(320, 240)
    assert_allclose(small.project(points()) + 0.5, (camera.project(points()) + 0.5) / 2.0, rtol=0.0, atol=1e-9)
    assert_allclose(small.resized(640, 480).matrix, camera.matrix, rtol=1e-12, atol=1e-9)


def test_cameras_come_back_from_their_file(tmp_path):
    written = (lens_camera(), camera_at((0.5, 1.0, 0.9), (0.1, 0.0, 0.1)))
    write_cameras(tmp_path / "cameras.yaml", written)
    for before, after in zip(written, read_cameras(tmp_path / "cameras.yaml"), strict=True):
        assert (before.name, before.width_px, before.height_px) == (after.name, after.width_px, after.height_px)
        for name in ("matrix", "distortion", "camera_from_world"):
            assert_allclose(getattr(after, name), getattr(before, name), rtol=1e-15, atol=0.0)


def test_a_wrong_file_is_refused_with_what_would_help(tmp_path):
    with pytest.raises(InputError, match="paramove calibrate cameras"):
        read_cameras(tmp_path / "none.yaml")
    for text, message in (
        ("cameras: [", "in YAML"),
        ("cameras: 3", "a list 'cameras'"),
        ("cameras: [{name: a}]", "the keys name, width_px"),
    ):
        (tmp_path / "wrong.yaml").write_text(text)
        with pytest.raises(InputError, match=message):
            read_cameras(tmp_path / "wrong.yaml")
    write_cameras(tmp_path / "cameras.yaml", [lens_camera()])
    text = (tmp_path / "cameras.yaml").read_text()
    (tmp_path / "wrong.yaml").write_text(text.replace("width_px: 640", "width_px: wide"))
    with pytest.raises(InputError, match="camera 0"):
        read_cameras(tmp_path / "wrong.yaml")


def test_a_wrong_camera_is_refused():
    camera = lens_camera()
    with pytest.raises(InputError, match="not a rotation"):
        CalibratedCamera("a", 640, 480, camera.matrix, LENS, np.diag([1.0, 1.0, 2.0, 1.0]))
    with pytest.raises(InputError, match="distortion of shape"):
        CalibratedCamera("a", 640, 480, camera.matrix, np.zeros(3), camera.camera_from_world)
    with pytest.raises(InputError, match="gives 320 x 240 px, calibrated are 640 x 480 px"):
        camera.undistort(np.zeros((240, 320, 3), np.uint8))
