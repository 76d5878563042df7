import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from paramove.cameras.frame_sources import DeviceFrames, FileFrames, FrameSource, SourceError, TopicFrames, open_source
from paramove.cameras.frames import EndOfFrames, Frame, FrameError, encode
from paramove.documents.input_error import InputError
from paramove.msgs.gesture_pb2 import Gesture
from paramove.recording.writer import RecordingWriter
from tests.diagnosis.conftest import HOLD

SECOND = 1_000_000_000
MS = 1_000_000
TOPIC = "camera_1/image"


class FakeCapture:
    """A device that gives a frame whenever `press` is called and nothing once unplugged."""

    def __init__(self, path: str) -> None:
        self.path = path
        self.asked: dict[int, float] = {}
        self.released = threading.Event()
        self.taken = threading.Semaphore(0)
        self._pressed = threading.Semaphore(0)
        self._unplugged = False
        self._level = 0

    def press(self) -> None:
        self._pressed.release()
        assert self.taken.acquire(timeout=60)

    def unplug(self) -> None:
        self._unplugged = True
        self._pressed.release()

    def isOpened(self) -> bool:  # noqa: N802
        return True

    def grab(self) -> bool:
        if self._level:
            self.taken.release()  # the frame before has been stored by now
        assert self._pressed.acquire(timeout=60)
        return not self._unplugged

    def retrieve(self) -> tuple[bool, Any]:
        self._level += 1
        return True, np.full((4, 6, 3), self._level, np.uint8)

    def get(self, prop: int) -> float:
        return 0.0

    def set(self, prop: int, value: float) -> bool:
        self.asked[prop] = value
        return True

    def release(self) -> None:
        self.released.set()


def _devices() -> tuple[list[FakeCapture], Callable[[str], FakeCapture]]:
    opened: list[FakeCapture] = []

    def open_capture(path: str) -> FakeCapture:
        opened.append(FakeCapture(path))
        return opened[-1]

    return opened, open_capture


def test_a_device_gives_its_newest_frame_once() -> None:
    opened, open_capture = _devices()
    source = DeviceFrames("0", 6, 4, open_capture=open_capture)
    assert opened[0].path == "/dev/video0"
    assert source.frame(0) is None
    opened[0].press()
    opened[0].press()
    frame = source.frame(SECOND // 15)
    assert frame is not None
    assert (frame.image_bgr[0, 0, 0], frame.index, frame.captured_ns) == (2, 0, SECOND // 15)
    assert source.frame(SECOND // 10) is None
    opened[0].unplug()
    source.close()


def test_an_unplugged_device_is_told_within_a_second_and_opened_again() -> None:
    opened, open_capture = _devices()
    source = DeviceFrames("/dev/v4l/by-id/cam", 6, 4, open_capture=open_capture)
    opened[0].press()
    assert source.frame(0) is not None
    opened[0].unplug()
    assert opened[0].released.wait(timeout=60)
    assert source.frame(SECOND // 2) is None
    with pytest.raises(FrameError, match=r"no frame for 1\.0 s: replug"):
        source.frame(SECOND)
    assert [capture.path for capture in opened] == ["/dev/v4l/by-id/cam"] * 2
    opened[1].press()
    assert source.frame(SECOND + SECOND // 15) is not None
    opened[1].unplug()
    source.close()


def test_a_device_that_stays_away_is_asked_for_once_a_second() -> None:
    opened, open_capture = _devices()
    attempts: list[str] = []

    def gone_after_first(path: str) -> FakeCapture:
        attempts.append(path)
        if len(attempts) > 1:
            raise FrameError(f"no camera {path}; found: none")
        return open_capture(path)

    source = DeviceFrames("0", 6, 4, open_capture=gone_after_first)
    opened[0].unplug()
    for tick in range(46):
        if tick in (15, 30, 45):
            with pytest.raises(FrameError, match="no camera"):
                source.frame(tick * SECOND // 15)
        else:
            assert source.frame(tick * SECOND // 15) is None
    assert len(attempts) == 1 + 3
    source.close()


def test_a_file_that_is_no_video_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "clip.avi"
    path.write_bytes(b"RIFF but no video")
    with pytest.raises(FrameError, match="no video that OpenCV can read"):
        FileFrames(path)


def test_an_ordinary_file_is_no_camera(tmp_path: Path) -> None:
    path = tmp_path / "video0"
    path.write_bytes(b"not a device")
    with pytest.raises(FrameError, match="no V4L2 camera"):
        open_source(f"device:{path}", 480, 360)


def test_a_topic_gives_frames_with_messages_only() -> None:
    source = open_source("topic:camera/image_raw", 480, 360)
    assert isinstance(source, TopicFrames)
    assert source.from_topic
    assert source.frame(0) is None
    source.close()


class BrokenCapture(FakeCapture):
    """A device whose driver raises during a read."""

    def grab(self) -> bool:
        raise cv2.error("VIDIOC_DQBUF: No such device")


def test_a_device_that_raises_is_a_silent_one() -> None:
    opened: list[FakeCapture] = []

    def open_capture(path: str) -> FakeCapture:
        opened.append(BrokenCapture(path))
        return opened[-1]

    source = DeviceFrames("0", 6, 4, open_capture=open_capture)
    assert opened[0].released.wait(timeout=60)
    assert source.frame(0) is None
    with pytest.raises(FrameError, match=r"no frame for 1\.0 s: replug") as fault:
        source.frame(SECOND)
    assert fault.value.kind == "silent"
    source.close()


def _video(path: Path, frames: int) -> Path:
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 15.0, (64, 48))
    for level in range(frames):
        writer.write(np.full((48, 64, 3), 5 * level, np.uint8))
    writer.release()
    return path


def test_a_video_without_frames_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match="holds no frame") as rejection:
        FileFrames(_video(tmp_path / "clip.avi", 0))
    assert rejection.value.exit_code == 78


def test_a_video_cut_anywhere_is_refused_or_ends_early(tmp_path: Path) -> None:
    whole = _video(tmp_path / "clip.avi", 30).read_bytes()
    path = tmp_path / "cut.avi"
    for cut in range(0, len(whole), len(whole) // 20):
        path.write_bytes(whole[:cut])
        try:
            source = FileFrames(path)
        except SourceError:
            continue
        with pytest.raises(EndOfFrames, match="has ended after"):
            _play(source)
        source.close()


def _play(source: FileFrames) -> None:
    for tick in range(60):
        source.frame(tick * SECOND // 15)


@pytest.mark.parametrize(("name", "told", "code"), [("none.avi", "no video file", 66), (".", "found a folder", 78)])
def test_a_missing_video_says_what_is_there(tmp_path: Path, name: str, told: str, code: int) -> None:
    with pytest.raises(SourceError, match=told) as rejection:
        open_source(f"file:{tmp_path / name}", 480, 360)
    assert rejection.value.exit_code == code


def test_a_device_without_rights_names_the_remedy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "video0"
    path.touch()

    def denied(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", denied)  # root may open everything
    with pytest.raises(SourceError, match="sudo usermod -aG video"):
        open_source(f"device:{path}", 480, 360)


def test_a_busy_device_names_who_holds_it(tmp_path: Path) -> None:
    path = tmp_path / "video0"
    path.touch()
    command, pipe = [sys.executable, "-c", HOLD, str(path)], subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True) as holder:
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(SourceError, match=rf"held by pid {holder.pid} \(python.*\): end it first"):
            open_source(f"device:{path}", 480, 360)
        holder.communicate()


def test_a_topic_that_falls_silent_is_told_until_it_speaks_again() -> None:
    source = TopicFrames()
    raw = RawImage(encoding="bgr8", width=2, height=2, step=6, data=bytes(12))
    assert source.frame(0, raw) is not None
    assert source.frame(SECOND) is None
    with pytest.raises(FrameError, match="no image on camera/image_raw"):
        source.frame(SECOND + 1)
    assert source.frame(2 * SECOND, raw) is not None
    assert source.frame(2 * SECOND + 1) is None


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
