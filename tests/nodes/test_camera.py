import re
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from pydantic import ValidationError

from nodes import camera
from paramove.bus import topics
from paramove.bus.recorded import RecordedBus
from paramove.bus.subscriber import Received
from paramove.bus.ticks import Tick
from paramove.cameras.frames import FrameError, decode
from paramove.documents.input_error import InputError
from tests.nodes.recorded_bus import PERIOD_NS, bus_that_heard, bus_with_ticks


def _picture(seed: int, width: int = 480, height: int = 360) -> np.ndarray:
    small = np.random.default_rng(seed).integers(40, 200, (height // 12, width // 12, 3), dtype=np.uint8)
    return cv2.resize(small, (width, height), interpolation=cv2.INTER_CUBIC)


def _image_raw(image: np.ndarray) -> tuple[Any, RawImage]:
    height, width = image.shape[:2]
    raw = RawImage(encoding="bgr8", width=width, height=height, step=3 * width, data=image.tobytes())
    return topics.CAMERA_IMAGE_RAW, raw


def test_says_each_frame_of_a_video_file_once(tmp_path: Path) -> None:
    path = tmp_path / "clip.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 15.0, (480, 360))
    pictures = [_picture(seed) for seed in range(6)]
    for picture in pictures:
        writer.write(picture)
    writer.release()
    bus = bus_with_ticks(30)
    camera.run(bus, camera.Config(source=f"file:{path}"))
    assert bus.now_ns < 30 * PERIOD_NS  # it ended with the file
    assert len(bus.published) == 6
    for said, picture in zip(bus.published, pictures, strict=True):
        assert said.topic is topics.CAMERA_IMAGE
        assert said.message.frame_id == "camera_optical"
        assert said.message.timestamp.ToNanoseconds() == said.captured_ns
        assert np.abs(decode(said.message).astype(int) - picture).mean() < 6


def test_leaves_out_frames_of_a_faster_file_and_publishes_the_times_of_the_others(tmp_path: Path) -> None:
    path = tmp_path / "clip.mp4"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), 30.0, (480, 360))
    for seed in range(12):
        writer.write(_picture(seed))
    writer.release()
    bus = bus_with_ticks(30)
    camera.run(bus, camera.Config(source=f"file:{path}"))
    captured_ns = np.array([said.captured_ns for said in bus.published])
    times_s = (captured_ns - captured_ns[0]) * 1e-9
    np.testing.assert_allclose(times_s, np.array([0, 2, 4, 6, 8, 10, 11]) / 30, rtol=0, atol=1e-3)


def test_compresses_the_light_of_a_topic_and_recovers_from_bad_frames() -> None:
    black = np.zeros((360, 480, 3), np.uint8)
    wrong_size = _picture(1, 360, 240)
    bus = bus_that_heard([_image_raw(image) for image in (_picture(1), black, wrong_size, _picture(2))])
    camera.run(bus, camera.Config())
    assert [said.captured_ns // PERIOD_NS for said in bus.published] == [1, 4]
    assert [state for state, _ in bus.states] == ["ready", "degraded", "degraded", "ready"]
    assert "black" in bus.states[1][1]
    assert "360 x 240 px, 480 x 360 expected" in bus.states[2][1]


def test_a_frozen_picture_is_said_no_more() -> None:
    bus = bus_that_heard([_image_raw(_picture(1))] * 20)
    camera.run(bus, camera.Config(frozen_after=10))
    assert len(bus.published) == 9
    assert "frozen" in bus.states[-1][1]


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("file:/nowhere/clip.avi", "no video file .*/nowhere/clip.avi"),
        ("device:/dev/no-such-camera", "no camera /dev/no-such-camera; found"),
        ("socket:1", "topic:camera/image_raw, file:PATH, device:PATH, device:URL, folder:PATH@RATE"),
        ("device:ftp://camera/video", "http://, https://, rtsp://"),
        ("topic:camera/image", "expected"),
    ],
)
def test_a_source_that_is_not_there_is_named(source: str, words: str) -> None:
    with pytest.raises(FrameError, match=words):
        camera.run(bus_with_ticks(1), camera.Config(source=source))


def test_refuses_unknown_parameters() -> None:
    with pytest.raises(ValidationError):
        camera.Config.model_validate({"sauce": "file:x"})


def _bus_of(*events: Any) -> RecordedBus:
    return RecordedBus(events)


def test_silence_of_the_light_is_told_after_a_second_and_once() -> None:
    topic, image_raw = _image_raw(_picture(1))
    events: list[Any] = [Received(topic, image_raw, PERIOD_NS, PERIOD_NS, 1)]
    events += [Tick(n, n * PERIOD_NS) for n in range(1, 40)]
    events.append(Received(topic, _image_raw(_picture(2))[1], 40 * PERIOD_NS, 40 * PERIOD_NS, 2))
    bus = _bus_of(*events)
    camera.run(bus, camera.Config())
    assert [state for state, _ in bus.states] == ["ready", "degraded", "ready"]
    assert "no image on camera/image_raw for more than 1 s" in bus.states[1][1]
    assert len(bus.published) == 2


def test_the_same_fault_is_told_once() -> None:
    black = np.zeros((360, 480, 3), np.uint8)
    bus = bus_that_heard([_image_raw(image) for image in (_picture(1), *[black] * 4, _picture(2), black)])
    camera.run(bus, camera.Config())
    assert [state for state, _ in bus.states] == ["ready", "degraded", "ready", "degraded"]


@pytest.mark.parametrize("message", [RawImage(), RawImage(encoding="bgr8", width=480, height=360, data=b"short")])
def test_light_that_is_no_picture_is_left_out(message: RawImage) -> None:
    bus = bus_that_heard([(topics.CAMERA_IMAGE_RAW, message), _image_raw(_picture(1))])
    camera.run(bus, camera.Config())
    assert len(bus.published) == 1
    assert [state for state, _ in bus.states] == ["ready", "degraded", "ready"]


def test_the_end_of_a_file_that_is_cut_off_is_told(tmp_path: Path) -> None:
    path = _video(tmp_path, 40)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    bus = bus_with_ticks(60)
    camera.run(bus, camera.Config(source=f"file:{path}"))
    assert 0 < len(bus.published) < 40
    assert bus.states[-1][0] == "ready"
    assert re.search("has ended after [0-9]+ frames", bus.states[-1][1])


def test_a_source_that_is_not_there_ends_the_node_without_restart() -> None:
    with pytest.raises(InputError) as rejection:
        camera.run(bus_with_ticks(1), camera.Config(source="device:/dev/no-such-camera"))
    assert rejection.value.exit_code == 66


def _video(folder: Path, frames: int) -> Path:
    path = folder / "clip.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 15.0, (480, 360))
    for seed in range(frames):
        writer.write(_picture(seed))
    writer.release()
    return path
