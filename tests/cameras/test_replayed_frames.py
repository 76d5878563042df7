"""Folders of pictures and recordings are played at their own pace, and told when they are none."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from paramove.cameras.frame_sources import FrameSource, open_source
from paramove.cameras.frames import EndOfFrames, Frame, FrameError, encode
from paramove.documents.input_error import InputError
from paramove.msgs.gesture_pb2 import Gesture
from paramove.recording.writer import RecordingWriter

MS = 1_000_000
TOPIC = "camera_1/image"


def picture(level: int) -> np.ndarray:
    return np.full((12, 16, 3), level, np.uint8)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for number in range(3):
        cv2.imwrite(str(tmp_path / f"{number:05d}.png"), picture(10 * number))
    (tmp_path / "notes.txt").write_text("no picture")
    return tmp_path


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    path = tmp_path / "recording.mcap"
    with RecordingWriter(path, "test") as writer:
        for number, at_ms in enumerate((1000, 1100, 1250)):
            frame = Frame(picture(10 * number), at_ms * MS, number)
            writer.write(TOPIC, encode(frame), at_ms * MS, at_ms * MS, number)
        writer.write("gestures", Gesture(), 1250 * MS, 1250 * MS, 1)
    return path


def levels(source: FrameSource, *times_ms: int) -> list[int | None]:
    """Grey level of the frame given at each time."""
    frames = [source.frame(at * MS) for at in times_ms]
    return [None if frame is None else round(float(frame.image_bgr.mean()), -1) for frame in frames]


def test_pictures_come_at_their_rate_and_late_ones_are_left_out(folder: Path) -> None:
    source = open_source(f"folder:{folder}@10", 16, 12)
    assert levels(source, 5000, 5050, 5200) == [0, None, 20]
    with pytest.raises(EndOfFrames, match="ended after 3 pictures"):
        source.frame(5300 * MS)


def test_a_broken_picture_is_told_and_the_next_one_is_played(folder: Path) -> None:
    (folder / "00001.png").write_bytes(b"broken")
    source = open_source(f"folder:{folder}@10", 16, 12)
    assert levels(source, 0) == [0]
    with pytest.raises(FrameError, match=r"00001\.png .* is no PNG"):
        source.frame(100 * MS)
    assert levels(source, 200) == [20]


def test_recorded_images_come_at_the_times_of_their_capture(recording: Path) -> None:
    source = open_source(f"recording:{recording}#{TOPIC}", 16, 12)
    assert levels(source, 7000, 7050, 7100, 7200, 7250) == [0, None, 10, None, 20]
    with pytest.raises(EndOfFrames, match="ended after 3 images"):
        source.frame(7400 * MS)
    source.close()


@pytest.mark.parametrize(
    ("source", "told"),
    [
        ("folder:{}", "folder:PATH@RATE expected"),
        ("folder:{}/none@10", "there is no such folder"),
        ("folder:{}@0", "0.1 to 1000 pictures per second"),
        ("recording:{}/none.mcap#camera_1/image", "no such recording"),
        ("recording:{}/recording.mcap#camera_2/image", "no images on camera_2/image"),
        ("recording:{}/recording.mcap#gestures", "no images on gestures"),
        ("recording:{}/recording.mcap", "recording:PATH#TOPIC"),
    ],
)
def test_what_cannot_be_played_is_told(recording: Path, folder: Path, source: str, told: str) -> None:
    with pytest.raises(InputError, match=told):
        open_source(source.format(folder), 16, 12)
