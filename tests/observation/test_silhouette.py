"""The projected arm's silhouette is MuJoCo's, and its contour is the silhouette's border, in order."""

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.documents.input_error import InputError
from paramove.observation import ArmObserver, ArmSizes, fitted_poses
from paramove.observation.contour_kernels import new_contour, trace
from paramove.observation.silhouette_kernels import Camera, draw_arm, new_canvas, project_ellipsoid, wipe
from tests.observation.views import camera_at, four_cameras, some_bent_poses, some_poses
from tests.sim.arm_silhouette import ArmSilhouette

SIZES = ArmSizes()
BODY = np.array([SIZES.forearm, SIZES.hand, 0.055, 0.042, 0.028, SIZES.hand_width, SIZES.hand_thickness])


def kernel_camera(camera):
    turn, shift = camera.camera_from_world[:3, :3].copy(), camera.camera_from_world[:3, 3].copy()
    nothing = np.zeros(0, np.uint8)
    return Camera(turn, shift, camera.matrix.copy(), camera.width_px, camera.height_px, nothing)


def drawn(pose, camera):
    canvas = new_canvas(camera.width_px, camera.height_px)
    draw_arm(pose, BODY, kernel_camera(camera), canvas)
    return canvas.mask.reshape(camera.height_px + 2, -1)[1:-1, 1:-1].astype(bool)


@pytest.mark.parametrize("fovy_deg", [45.0, 22.0])
@pytest.mark.parametrize("poses", [some_poses, some_bent_poses], ids=["straight", "bent wrists"])
def test_silhouettes_are_mujocos(fovy_deg, poses):
    cameras = four_cameras(fovy_deg=fovy_deg)
    theirs = ArmSilhouette(SIZES, cameras[0].matrix, 320, 240)
    overlaps = []
    for camera in cameras:
        for pose in poses(40, seed=1):
            wrist = pose[9:] if len(pose) > 9 else None
            expected, found = theirs.mask(pose[:9], camera.camera_from_world, wrist), drawn(pose, camera)
            overlaps.append((expected & found).sum() / max((expected | found).sum(), 1))
    theirs.close()
    assert np.median(overlaps) >= 0.985
    assert min(overlaps) >= 0.95


def test_a_sphere_is_seen_as_the_ellipse_of_its_points():
    centre, radius = np.array([0.3, -0.2, 0.9]), 0.12
    matrix = np.array([[300.0, 2.0, 160.0], [0.0, 320.0, 120.0], [0.0, 0.0, 1.0]])
    ellipse = np.empty(5)
    assert project_ellipsoid(centre, radius**2 * np.eye(3), matrix, ellipse)
    surface = np.random.default_rng(0).normal(size=(200_000, 3))
    points = centre + radius * surface / np.linalg.norm(surface, axis=1, keepdims=True)
    seen = points @ matrix.T
    pixels = seen[:, :2] / seen[:, 2:]
    for angle in np.linspace(0.0, np.pi, 7):
        way = np.array([np.cos(angle), np.sin(angle)])
        shape = np.array([[ellipse[2], ellipse[3]], [ellipse[3], ellipse[4]]])
        assert_allclose(ellipse[:2] @ way + np.sqrt(way @ shape @ way), (pixels @ way).max(), rtol=0.0, atol=0.05)


HANGING = fitted_poses([[-0.27, -0.18, 0.35, -0.27, -0.22, 0.09, -0.24, -0.25, -0.33]], SIZES)[0]
TABLE = np.array([(-0.2, -0.7), (0.7, -0.7), (0.7, 0.7), (-0.2, 0.7)])


def seen(pose, table):
    """Silhouette as the outline encloses it, from the front of a table."""
    camera = camera_at((1.2, -0.3, 1.2), (-0.1, -0.2, 0.1))
    outline = ArmObserver(SIZES, [camera], table=table, threads=1).outline(pose, 0)
    mask = np.zeros((240, 320), np.uint8)
    if len(outline):
        cv2.fillPoly(mask, [outline.round().astype(np.int32)], 1)
    pixels = camera.project(pose.reshape(3, 3)).round().astype(int).clip(0, 239)
    return mask.astype(bool), [bool(mask[y, x]) for x, y in pixels]


def test_a_table_hides_what_hangs_below_it():
    whole, ends = seen(HANGING, None)
    assert ends == [True, True, True]
    left, ends = seen(HANGING, TABLE)
    assert ends == [True, True, False]
    assert 0.3 * whole.sum() < left.sum() < 0.9 * whole.sum()
    assert not (left & ~whole).any()


def test_a_table_hides_neither_an_arm_above_nor_one_beside_it():
    above = some_poses(1, seed=4)[0]
    above[8] = max(above[8], 0.01)
    np.testing.assert_array_equal(seen(above, TABLE)[0], seen(above, None)[0])
    np.testing.assert_array_equal(seen(HANGING, np.add(TABLE, 3.0))[0], seen(HANGING, None)[0])


def test_an_arm_that_the_table_hides_wholly_is_out_of_sight():
    below = HANGING - np.tile([0.0, 0.0, 0.8], 3) + np.tile([0.4, 0.0, 0.0], 3)
    assert not seen(below, TABLE)[0].any()


@pytest.mark.parametrize("table", [[(0.0, 0.0), (1.0, 0.0)], [0.0, 1.0, 2.0]])
def test_a_table_that_is_none_is_refused(table):
    with pytest.raises(InputError, match="three or more corners"):
        ArmObserver(SIZES, four_cameras(), table=table)


def test_the_canvas_is_empty_again_after_each_arm():
    camera = four_cameras()[0]
    canvas = new_canvas(320, 240)
    for pose in some_poses(20):
        top, bottom, _ = draw_arm(pose, BODY, kernel_camera(camera), canvas)
        assert canvas.mask.any()
        wipe(top, bottom, 320, canvas)
        assert not canvas.mask.any()
    assert (canvas.right == -1).all()


def traced(mask):
    height, width = mask.shape
    padded = np.zeros((height + 2, width + 2), np.uint8)
    padded[1:-1, 1:-1] = mask
    contour = new_contour(width, height)
    count = trace(padded.reshape(-1), width, int(np.nonzero(mask.any(axis=1))[0][0]), 0, contour)
    return np.stack([contour.x[:count], contour.y[:count]], axis=1)


def test_the_contour_is_a_closed_loop_of_the_border_pixels():
    camera = four_cameras(fovy_deg=25.0)[1]
    for pose in some_poses(30, seed=2):
        mask = drawn(pose, camera)
        loop = traced(mask)
        assert np.abs(np.diff(np.vstack([loop, loop[:1]]), axis=0)).max() == 1
        expected, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        assert len(expected) == 1
        assert {tuple(p) for p in loop} == {tuple(p) for p in expected[0][:, 0]}


def test_the_contour_turns_counterclockwise_and_passes_its_start_on_the_way():
    mask = np.zeros((20, 20), np.uint8)
    mask[5:15, 5:15] = 1
    loop = traced(mask).astype(float)
    after = np.roll(loop, -1, axis=0)
    assert (loop[:, 0] * after[:, 1] - loop[:, 1] * after[:, 0]).sum() < 0.0  # y points down
    fork = np.zeros((20, 20), np.uint8)
    for i in range(8):  # two legs that meet in the first pixel alone
        fork[2 + i, 9 - i] = fork[2 + i, 9 + i] = 1
    assert {tuple(p) for p in traced(fork)} == {(x, y) for y, x in zip(*np.nonzero(fork), strict=True)}


def test_arms_that_the_image_cuts_and_arms_out_of_sight():
    pose = some_poses(1)[0]
    hand = pose[6:]
    cut = camera_at((1.0, -0.9, 0.6), hand + np.array([0.0, 0.0, 0.02]), fovy_deg=12.0)
    mask = drawn(pose, cut)
    assert mask[:, 0].any() or mask[0].any() or mask[:, -1].any() or mask[-1].any()
    assert len(ArmObserver(SIZES, [cut], threads=1).outline(pose, 0)) > 20
    behind = camera_at((1.0, -0.9, 0.6), (2.0, -1.6, 0.9))
    beside = camera_at((1.0, -0.9, 0.6), (1.0, 2.0, 0.3))
    for camera in (behind, beside):
        assert not drawn(pose, camera).any()
        assert ArmObserver(SIZES, [camera], threads=1).outline(pose, 0).shape == (0, 2)


def test_a_part_at_the_lens_is_out_of_sight():
    pose = some_poses(1)[0]
    camera = camera_at(pose[3:6] + np.array([0.0, 0.0, 0.01]), (1.0, 0.0, 0.3))
    assert not drawn(pose, camera).any()
