"""Lens and place of cameras that look at a printed board, and what is refused with which words."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from paramove.cameras.calibration import CalibrationError, Lens, calibrate_lens, check_square
from paramove.cameras.charuco_board import Board, BoardFinder
from paramove.cameras.placement import place_camera
from paramove.cameras.stereo import StereoRig
from tests.cameras.board_scene import Sheet, camera, held, looking, session

BOARD = Board.printed(0.045)
SHEET = Sheet("a3")
POSES = {
    "left": looking((0.75, 0.45, 0.55), (0.15, 0.0, 0.0)),
    "right": looking((0.70, -0.50, 0.60), (0.15, 0.0, 0.0), roll_deg=6.0),
    "above": looking((0.30, 0.10, 0.95), (0.15, 0.0, 0.0)),
}
LENSES = {"left": (-0.2, 0.06, 600.0), "right": (0.05, -0.02, 640.0), "above": (-0.1, 0.0, 680.0)}


def views_of(images):
    """The view of the board in each of the named images."""
    finder = BoardFinder()
    return [finder.find(image, name) for name, image in images]


def made(name):
    k1, k2, focal = LENSES[name]
    return camera(name, POSES[name], focal=focal, k1=k1, k2=k2)


@pytest.fixture(scope="module")
def seen():
    """Views of three cameras: {name: (camera, views held and on the table, views on the table)}."""
    found = {}
    for number, name in enumerate(POSES):
        eye = made(name)
        views = views_of(list(session(eye, SHEET, count=15, seed=number).items()))
        table = views_of([(f"table_{i}", SHEET.seen_by(eye, seed=200 + i)) for i in range(3)])
        assert None not in [*views, *table]
        found[name] = (eye, views, table)
    return found


@pytest.fixture(scope="module")
def placed(seen):
    """{name: (true camera, lens, placement)}."""
    result = {}
    for name, (eye, views, table) in seen.items():
        lens = calibrate_lens(name, views, BOARD)
        result[name] = (eye, lens, place_camera(lens, table, BOARD))
    return result


@pytest.mark.parametrize("name", POSES)
def test_the_lens_is_recovered(placed, name):
    eye, lens, _ = placed[name]
    focal = np.diag(lens.matrix)[:2]
    np.testing.assert_allclose(focal, np.diag(eye.matrix)[:2], rtol=0.003, atol=0)
    np.testing.assert_allclose(lens.matrix[:2, 2], eye.matrix[:2, 2], rtol=0, atol=1.5)
    np.testing.assert_allclose(lens.distortion[:2], eye.distortion[:2], rtol=0, atol=0.03)
    assert lens.error_px < 0.15
    assert lens.advice() == []
    assert abs(focal[0] - eye.matrix[0, 0]) < 5 * lens.focal_sd_px, "the stated uncertainty is honest"


@pytest.mark.parametrize("name", POSES)
def test_cameras_stand_where_they_stand_in_the_table_frame(placed, name):
    eye, _, placement = placed[name]
    turn = placement.camera.camera_from_world[:3, :3] @ eye.camera_from_world[:3, :3].T
    turned_deg = np.rad2deg(np.linalg.norm(cv2.Rodrigues(turn)[0]))
    assert turned_deg < min(0.2, 4 * placement.turn_sd_deg)
    assert np.linalg.norm(placement.camera.position - eye.position) < 0.002
    assert np.linalg.norm(placement.camera.position - eye.position) < 4 * placement.position_sd
    assert placement.error_px < 0.2


def test_cameras_share_one_frame_to_a_millimetre(placed):
    """What the true cameras see of places on and above the table, the found ones tell to a millimetre."""
    space = np.stack(np.meshgrid([0.0, 0.15, 0.3], [-0.2, 0.0, 0.2], [0.0, 0.15]), axis=-1).reshape(-1, 3)
    pixels = np.stack([eye.project(space) for eye, _, _ in placed.values()])
    rig = StereoRig([placement.camera for _, _, placement in placed.values()])
    found = rig.triangulate(pixels)
    assert found.known.all()
    assert np.linalg.norm(found.points - space, axis=1).max() < 0.001
    assert found.residuals_px.max() < 0.5


def test_thickness_lowers_the_table(seen, placed):
    """The same images of a board said to be 5 mm thick: the camera is 5 mm higher above the table."""
    _, _, table = seen["left"]
    _, lens, placement = placed["left"]
    thick = place_camera(lens, table, replace(BOARD, thickness=0.005))
    moved = thick.camera.position - placement.camera.position
    np.testing.assert_allclose(moved, [0.0, 0.0, 0.005], rtol=0, atol=1e-5)


def test_a_bad_view_is_left_out(seen):
    _, views, _ = seen["left"]
    draw = np.random.default_rng(0)
    shaken = replace(views[3], name="shaken", points=views[3].points + draw.normal(0, 4.0, views[3].points.shape))
    lens = calibrate_lens("left", [*views, shaken], BOARD)
    assert lens.left_out == ("shaken",)
    assert lens.error_px < 0.15


def test_blur_and_noise_are_told(seen):
    _, views, _ = seen["left"]
    draw = np.random.default_rng(0)
    rough = [replace(view, points=view.points + draw.normal(0, 0.6, view.points.shape)) for view in views]
    lens = calibrate_lens("left", rough[:9], BOARD)
    assert 0.5 < lens.error_px < 1.0
    told = " ".join(lens.advice())
    assert "usable, not good (good: < 0.5 px)" in told
    assert "blur" in told
    assert "9 views were used; take 15 or more" in told


def test_too_few_views(seen):
    _, views, _ = seen["left"]
    with pytest.raises(CalibrationError, match=r"left: too few views: the board was found in 3 images, at least 6"):
        calibrate_lens("left", views[:3], BOARD)


def test_parallel_views():
    eye = camera(pose=looking((0.8, 0.0, 0.5), (0.15, 0.0, 0.0)))
    images = [(str(n), SHEET.seen_by(eye, held(eye, n, tilt_deg=0.5), seed=n)) for n in range(8)]
    views = [view for view in views_of(images) if view is not None]
    assert len(views) >= 6
    with pytest.raises(CalibrationError, match=r"the board is parallel .* tilt the board by 30 to 45 deg"):
        calibrate_lens("left", views, BOARD)


def test_parallel_views_on_a_slant(seen):
    """Pushed about on the table, the board is at a slant, and always at the same one."""
    eye = made("left")
    images = []
    for number, (x, y) in enumerate([(0, 0), (0.1, 0), (0, 0.1), (0.1, 0.1), (0.05, -0.1), (0.12, 0.05), (0, -0.05)]):
        moved = np.eye(4)
        moved[:2, 3] = x, y
        images.append((str(number), SHEET.seen_by(eye, moved, seed=number)))
    with pytest.raises(CalibrationError, match="the board is parallel"):
        calibrate_lens("left", [view for view in views_of(images) if view is not None], BOARD)


def test_different_resolutions(seen, placed):
    _, views, table = seen["left"]
    other = replace(views[0], size=(1280, 720), name="big")
    with pytest.raises(CalibrationError, match=r"different resolutions: 640 x 480 px \(view_15|1280 x 720 px \(big\)"):
        calibrate_lens("left", [*views, other], BOARD)
    with pytest.raises(CalibrationError, match="table_9 has 1280 x 720 px, the lens was calibrated with 640 x 480 px"):
        place_camera(placed["left"][1], [replace(table[0], size=(1280, 720), name="table_9")], BOARD)


def test_wrong_squares_are_suspected(seen, placed):
    _, views, table = seen["left"]
    with pytest.raises(CalibrationError, match=r"wrong size .* 30 mm.* board printed with 45 mm: measure"):
        check_square(Board(0.03), views)
    assert "43.2 mm on a board printed for 45 mm" in check_square(Board(0.0432), views)[0]
    assert check_square(BOARD, views) == []
    assert check_square(Board(0.03), [replace(view, first_id=40) for view in views]) == []
    with pytest.raises(CalibrationError, match="different boards: that of squares of 30 mm in other and"):
        check_square(BOARD, [*views, replace(views[0], first_id=0, name="other")])
    with pytest.raises(CalibrationError, match=r"would be 0\.0\d m from the board; .* is a square really 4 mm wide"):
        place_camera(placed["left"][1], table, Board(0.004))


def test_a_board_that_was_moved_on_the_table(seen, placed):
    _, _, table = seen["left"]
    pushed = replace(table[1], name="table_1", points=table[1].points + np.array([9.0, 0.0]))
    with pytest.raises(
        CalibrationError, match="between table_0 and table_1 the board on the table or the camera moved by 9"
    ):
        place_camera(placed["left"][1], [table[0], pushed], BOARD)
    with pytest.raises(CalibrationError, match="the board on the table was not found: lay it down"):
        place_camera(placed["left"][1], [], BOARD)


def test_a_board_too_small_to_tell_its_tilt():
    """From afar both poses of a plane fit; the one that is taken must not be a guess."""
    eye = camera(pose=looking((3.2, 0.6, 3.2), (0.15, 0.0, 0.0)), k1=0.0, k2=0.0)
    lens = Lens("far", (640, 480), eye.matrix, eye.distortion, 0.1, np.zeros(0), 0.5, 0.5, 30.0, 1.0, ())
    board = Board(0.01, 40)
    view = BoardFinder().find(SHEET.seen_by(made("left")))
    which = view.corner_ids
    draw = np.random.default_rng(1)
    points = eye.project(board.corners()[which]) + draw.normal(0, 0.3, (len(which), 2))
    with pytest.raises(CalibrationError, match="too small to determine its tilt"):
        place_camera(lens, [replace(view, points=points, first_id=40)], board)
