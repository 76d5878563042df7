"""A simulated camera behind a socket, received as a camera node receives a device."""

from __future__ import annotations

import numpy as np
import pytest

from paramove.bus import topics
from paramove.cameras.camera_socket import CameraSocket, short_name
from paramove.cameras.frame_sources import SourceError, open_source
from sim.camera import raw_image
from sim.offered_camera import OfferedCamera
from tests.supervision.conftest import until

LONG = "a_folder_whose_name_is_far_too_long_for_the_path_of_a_socket" * 2


class Red:
    """A camera that sees a red wall, brighter from image to image."""

    def __init__(self) -> None:
        self.level, self.closed = 0, False

    def images(self, data, tick, now_ns):
        self.level = 20 + self.level % 200
        picture = np.zeros((4, 6, 3), dtype=np.uint8)
        picture[:, :, 0] = self.level
        yield topics.CAMERA_IMAGE_RAW, raw_image(picture, "camera_optical", now_ns)

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def offered(tmp_path):
    camera = OfferedCamera(Red(), tmp_path / LONG / "camera")
    yield camera
    camera.close()


def test_the_latest_who_came_gets_every_image_from_then_on(offered, tmp_path):
    assert list(offered.images(None, 1, 1)) == []  # nobody is there, and nothing is published
    for first in (40, 80):  # the first picture, of 20, was seen by nobody
        capture = CameraSocket(tmp_path / LONG / "camera")
        for level in (first, first + 20):
            list(offered.images(None, 1, 1))
            assert capture.grab()
            sound, image = capture.retrieve()
            assert sound
            assert image.shape == (4, 6, 3)
            np.testing.assert_allclose(image[2, 3], (0, 0, level), rtol=0, atol=3)  # BGR
        capture.release()


def test_a_device_that_is_a_socket_gives_frames(offered, tmp_path):
    source = open_source("device:camera", 6, 4, tmp_path / LONG)
    frames = []

    def received() -> bool:
        list(offered.images(None, 1, 1))
        frames.append(source.frame(1))
        return frames[-1] is not None

    until(received, "a frame")
    source.close()
    assert frames[-1].image_bgr.shape == (4, 6, 3)


def test_the_end_of_the_other_program_is_the_end_of_the_images(offered, tmp_path):
    capture = CameraSocket(tmp_path / LONG / "camera")
    list(offered.images(None, 1, 1))
    offered.close()
    assert capture.grab()
    assert not capture.grab()
    capture.release()
    with pytest.raises(SourceError):
        open_source("device:camera", 6, 4, tmp_path / LONG)


def test_a_length_that_no_image_has_is_the_end(offered, tmp_path):
    capture = CameraSocket(tmp_path / LONG / "camera")
    list(offered.images(None, 1, 1))
    capture.grab()
    offered._client.sendall((2**31).to_bytes(4, "big"))
    assert not capture.grab()
    capture.release()


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with pytest.raises(FileNotFoundError), short_name(tmp_path / "nowhere" / "camera"):
        pass
