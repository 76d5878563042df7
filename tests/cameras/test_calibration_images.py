"""Views out of a live camera and out of a moving board: which are taken, and when waiting ends."""

import itertools

import numpy as np
import pytest

from paramove.cameras import calibration_images
from paramove.cameras.calibration import CalibrationError
from paramove.cameras.calibration_images import LiveImages, ViewCollector
from paramove.cameras.charuco_board import BoardView
from tests.cameras.board_scene import Sheet, blank, camera, held, looking

EYE = camera("eye", looking((0.55, 0.30, 0.40), (0.12, 0.0, 0.0)))
RATE_HZ = 10.0


def timed(images, start_s=0.0):
    for number, image in enumerate(images):
        yield start_s + number / RATE_HZ, image


@pytest.fixture(scope="module")
def pictures():
    """Four of a held board, one of the board on the table, one without."""
    sheet = Sheet()
    return [*(sheet.seen_by(EYE, held(EYE, seed), seed=seed) for seed in range(4)), sheet.seen_by(EYE), blank(EYE)]


def view(shift=0.0):
    ids = np.arange(28, dtype=np.int32)
    return BoardView("view", ids, np.stack([20.0 * (ids % 7) + shift, 20.0 * (ids // 7)], axis=1), (640, 480), 0)


def test_only_still_and_new_views_are_kept():
    collector = ViewCollector()
    offered = [0.0, 1.0, 2.0, 60.0, 110.0, 111.0, 112.0, 3.0, 4.0]
    assert [collector.offer(view(shift)) for shift in offered] == [
        False,  # nothing to compare with
        True,
        False,  # as before
        False,  # moving
        False,
        True,
        False,
        False,
        False,  # seen before
    ]
    assert not collector.offer(None)
    assert not collector.offer(view(300.0)), "the first after a look without a board"
    assert collector.offer(view(300.0))
    assert len(collector.views) == 3


def test_a_live_camera_says_what_to_do(pictures, monkeypatch):
    monkeypatch.setattr(calibration_images, "GOOD_VIEWS", 4)
    said = []
    table, nothing = pictures[4:]
    first = [picture for picture in pictures[:4] for _ in range(5)]
    frames = timed([nothing, *first, nothing, *[table] * 15])
    live = LiveImages("camera0", frames, said.append)
    found = live.held()
    assert len(found.views) == 4
    assert [detail for detail in said if "view" in detail] == [f"camera0: view {n} of 4" for n in range(1, 5)]
    lying = live.table()
    assert len(lying.views) >= 5
    for one in lying.views:
        np.testing.assert_allclose(one.points, lying.views[0].points, rtol=0, atol=0.1)
    assert "waiting until the board lies still" in said[-1]


def test_waiting_ends(pictures, monkeypatch):
    monkeypatch.setattr(calibration_images, "TIMEOUT_S", 2.0)
    nothing = pictures[5]
    live = LiveImages("camera0", timed(itertools.repeat(nothing)), lambda detail: None)
    with pytest.raises(CalibrationError, match="no new view of the board for 2 s, 0 of 15 taken: more light"):
        live.held()
    with pytest.raises(CalibrationError, match="the board on the table was not detected lying still for 2 s"):
        live.table()


def test_a_board_in_motion_is_not_on_the_table(pictures, monkeypatch):
    monkeypatch.setattr(calibration_images, "TIMEOUT_S", 3.0)
    moving = itertools.cycle([picture for picture in pictures[:4] for _ in range(4)])
    live = LiveImages("camera0", timed(moving), lambda detail: None)
    with pytest.raises(CalibrationError, match="was not detected lying still for 3 s"):
        live.table()
