"""`paramove calibrate`: from images in folders and videos to the file of cameras; what it says, and its exit codes."""

import cv2
import numpy as np
import pytest

from paramove.cameras.calibrated import read_cameras
from paramove.cameras.charuco_board import BoardFinder
from tests.cameras.board_scene import Sheet, blank, camera, held, looking, session
from tests.cli.conftest import call

SHEET = Sheet()
EYES = {
    "left": camera("left", looking((0.55, 0.30, 0.40), (0.12, 0.0, 0.0))),
    "right": camera("right", looking((0.50, -0.35, 0.42), (0.12, 0.0, 0.0)), focal=650.0, k1=0.05),
}


def save(folder, images):
    folder.mkdir()
    for name, image in images.items():
        assert cv2.imwrite(str(folder / f"{name}.png"), image)
    return folder


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Images of two cameras, and of one without a board in some of them."""
    folder = tmp_path_factory.mktemp("calibration")
    for number, (name, eye) in enumerate(EYES.items()):
        save(folder / name, session(eye, SHEET, count=10, seed=number) | {"empty": blank(eye)})
    return folder


def test_the_board_is_written(tmp_path):
    done = call("calibrate", "board", "--out", tmp_path / "board.pdf", "--paper", "a3", "--square", "4cm")
    assert done.exit_code == 0, done.output
    assert "board.pdf: squares of 40 mm on a3" in done.stdout
    assert "check its line of 100 mm" in done.stdout
    assert (tmp_path / "board.pdf").read_bytes().startswith(b"%PDF")


def test_markers_are_written(tmp_path):
    done = call("calibrate", "markers", "--out", tmp_path / "markers.pdf", "--side", "40mm")
    assert done.exit_code == 0, done.output
    assert "markers of 40mm for shoulder, elbow, wrist, index, two of each" in done.stdout
    assert (tmp_path / "markers.pdf").read_bytes().startswith(b"%PDF")
    done = call("calibrate", "markers", "--out", tmp_path / "other.pdf", "--side", "9mm")
    assert done.exit_code == 78
    assert "markers of 9 mm found; 4 of 10 to" in done.stderr


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        (("--square", "30"), 78, "--square '30': a length with its unit expected, such as 30mm"),
        (("--square", "90mm"), 78, "squares of 90 mm found; on a4 20 to 31 mm fit"),
        (("--paper", "foolscap"), 78, "paper 'foolscap': a4, a3, letter, tabloid expected"),
    ],
)
def test_boards_that_are_refused(tmp_path, words, code, told):
    done = call("calibrate", "board", "--out", tmp_path / "board.pdf", *words)
    assert (done.exit_code, done.stdout) == (code, "")
    assert told in done.stderr
    assert not (tmp_path / "board.pdf").exists()


def test_no_folder_to_write_in(tmp_path):
    done = call("calibrate", "board", "--out", tmp_path / "no" / "board.pdf")
    assert done.exit_code == 77
    assert "board.pdf: No such file or directory" in done.stderr


def test_two_cameras_in_one_frame(folders, tmp_path):
    out = tmp_path / "cameras.yaml"
    done = call("calibrate", "cameras", folders / "left", folders / "right", "--square", "30mm", "--out", out)
    assert done.exit_code == 0, done.output
    assert "left: 640 x 480 px, 11 views of 12 images" in done.stdout
    assert "px (good)" in done.stdout
    assert "to do better: 11 views were used; take 15 or more" in done.stdout
    assert "a point on the board that all see ±" in done.stdout
    assert "cameras.yaml: 2 cameras in the frame 'table'" in done.stdout
    for found, eye in zip(read_cameras(out), EYES.values(), strict=True):
        assert (found.name, found.width_px, found.height_px) == (eye.name, 640, 480)
        np.testing.assert_allclose(found.position, eye.position, rtol=0, atol=0.003)
        space = np.array([[0.1, 0.0, 0.0], [0.2, 0.1, 0.0], [0.1, -0.1, 0.1]])
        np.testing.assert_allclose(found.project(space), eye.project(space), rtol=0, atol=0.6)


def test_a_video_whose_end_shows_the_table(tmp_path):
    eye = EYES["left"]
    writer = cv2.VideoWriter(str(tmp_path / "left.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (640, 480))
    for number in range(9):
        image = SHEET.seen_by(eye, held(eye, number), seed=number)
        for _ in range(4):  # held still for 0.4 s
            writer.write(image)
    table = SHEET.seen_by(eye, seed=50)
    for _ in range(14):
        writer.write(table)
    writer.release()
    done = call("calibrate", "cameras", tmp_path / "left.avi", "--square", "30mm", "--out", tmp_path / "cameras.yaml")
    assert done.exit_code == 0, done.output
    (found,) = read_cameras(tmp_path / "cameras.yaml")
    assert found.name == "left"
    np.testing.assert_allclose(found.position, eye.position, rtol=0, atol=0.006)


def test_what_is_missing(folders, tmp_path):
    out = ("--square", "30mm", "--out", tmp_path / "cameras.yaml")
    (tmp_path / "bare").mkdir()
    for source, told in (
        (tmp_path / "nothing", "a folder with images, a video file or a camera's number expected"),
        (tmp_path / "bare", "no image in"),
    ):
        done = call("calibrate", "cameras", source, *out)
        assert (done.exit_code, done.stdout) == (66, "")
        assert told in done.stderr
    assert not (tmp_path / "cameras.yaml").exists()


def copied(folders, tmp_path, wanted):
    """A folder with those images of the left camera whose names are wanted."""
    images = {p.stem: cv2.imread(str(p)) for p in sorted((folders / "left").iterdir()) if wanted(p.stem)}
    return save(tmp_path / "some", images)


@pytest.mark.parametrize(
    ("wanted", "square", "told"),
    [
        (lambda name: name == "empty", "30mm", "some: board not found in any of 1 images"),
        (
            lambda name: name in ("view_01", "view_02", "table"),
            "30mm",
            "too few views: the board was found in 3 images",
        ),
        (lambda name: name.startswith("view"), "30mm", "the board on the table was not found: lay it down"),
        (lambda name: name != "empty", "60mm", "wrong size of the squares? --square is 60 mm"),
        (lambda name: True, "30", "--square '30': a length with its unit expected"),
    ],
    ids=["no board", "few", "no table", "square", "unit"],
)
def test_images_that_are_refused(folders, tmp_path, wanted, square, told):
    folder = copied(folders, tmp_path, wanted)
    done = call("calibrate", "cameras", folder, "--square", square, "--out", tmp_path / "cameras.yaml")
    assert done.exit_code == 78, done.output
    assert told in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert not (tmp_path / "cameras.yaml").exists()


def test_files_that_are_no_images(folders, tmp_path):
    folder = copied(folders, tmp_path, lambda name: name == "view_01")
    (folder / "broken.jpg").write_bytes(b"\xff\xd8 no image")
    (tmp_path / "text.avi").write_text("no video")
    for source, told in ((folder, "broken.jpg (11 bytes) cannot be read"), (tmp_path / "text.avi", "is no video")):
        done = call("calibrate", "cameras", source, "--square", "30mm", "--out", tmp_path / "cameras.yaml")
        assert done.exit_code == 78
        assert told in done.stderr


def test_one_camera_given_twice(folders, tmp_path):
    out = ("--square", "30mm", "--out", tmp_path / "cameras.yaml")
    done = call("calibrate", "cameras", folders / "left", folders / "left", *out)
    assert done.exit_code == 78
    assert "two sources are named 'left'" in done.stderr


def test_no_such_live_camera(tmp_path):
    done = call(
        "calibrate", "cameras", "/dev/no_camera", "--square", "30mm", "--out", tmp_path / "cameras.yaml", "--size", "hd"
    )
    assert done.exit_code == 78
    assert "--size 'hd': width and height in pixels expected, such as 1280x720" in done.stderr
    done = call("calibrate", "cameras", "/dev/no_camera", "--square", "30mm", "--out", tmp_path / "cameras.yaml")
    assert done.exit_code == 66
    assert "no camera /dev/no_camera" in done.stderr


def test_the_scene_shows_what_the_camera_sees():
    """The images of these tests are true: corners are found where the camera's own projection puts them."""
    from paramove.cameras.charuco_board import Board

    eye = EYES["left"]
    view = BoardFinder().find(SHEET.seen_by(eye))
    expected = eye.project(Board.printed(0.03).corners()[view.corner_ids])
    assert np.abs(np.mean(view.points - expected, axis=0)).max() < 0.05
