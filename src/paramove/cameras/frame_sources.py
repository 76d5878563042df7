"""Sources of frames: a topic, a video, pictures, a recording, or a V4L2 device; a camera node has one code path."""

from __future__ import annotations

import logging
import re
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Protocol

import cv2
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from paramove.cameras.camera_socket import CameraSocket
from paramove.cameras.frames import EndOfFrames, Frame, FrameError, SourceError, decode, image_of_raw
from paramove.cameras.video_file import VideoFile, VideoFrame
from paramove.devices import holders
from paramove.documents import Image, InputError, read_picture
from paramove.recording import Recorded, read

_log = logging.getLogger(__name__)

SOURCES = "topic:camera/image_raw, file:PATH, device:PATH, device:URL, folder:PATH@RATE or recording:PATH#TOPIC"
URLS = ("http://", "https://", "rtsp://")
"""Network cameras that OpenCV reads: MJPEG over HTTP, or RTSP."""
OPEN_TIMEOUT_MS = 2000
READ_TIMEOUT_MS = 1000
TIMEOUT_NS = 1_000_000_000
"""A source without frames for longer has a fault."""
PICTURES = (".jpg", ".jpeg", ".png", ".bmp")
TICK_S = 1.0 / 15.0
"""Time between two requests of a node for a frame."""
TICK_FRACTION = 0.25
"""Fraction of a frame's period, or of a tick if that is shorter, by which it may be early, as ticks are not exact."""


class Capture(Protocol):
    """The part of cv2.VideoCapture that is used."""

    def grab(self) -> bool: ...
    def retrieve(self) -> tuple[bool, Any]: ...
    def set(self, prop: int, value: float) -> bool: ...
    def release(self) -> None: ...


class FrameSource(ABC):
    """Gives a frame on request, once a tick, or (a topic) once a message."""

    from_topic = False
    """True if frames come as messages, False if they are read at each tick."""

    @abstractmethod
    def frame(self, now_ns: int, raw: RawImage | None = None) -> Frame | None:
        """The latest frame, None if there is no new one yet. Raises FrameError."""

    def close(self) -> None:  # noqa: B027 - most sources hold nothing
        """Releases what the source holds."""


class TopicFrames(FrameSource):
    """Frames that another node publishes as raw images, such as the simulator's camera."""

    from_topic = True

    def __init__(self) -> None:
        self._index = 0
        self._latest_ns: int | None = None

    def frame(self, now_ns: int, raw: RawImage | None = None) -> Frame | None:
        """`now_ns` is the message's capture time; without a message, checks the time since the last one."""
        if raw is None:
            self._latest_ns = now_ns if self._latest_ns is None else self._latest_ns
            if now_ns - self._latest_ns > TIMEOUT_NS:
                raise FrameError(
                    "no image on camera/image_raw for more than 1 s: check its publisher (the simulator)", "silent"
                )
            return None
        self._latest_ns = now_ns
        self._index += 1
        return Frame(image_of_raw(raw), now_ns, self._index - 1)


class PlayedFrames(FrameSource):
    """Frames that are played at their own rate, from the first request on; those between two ticks are left out."""

    _start_ns: int | None = None

    def _elapsed_ns(self, now_ns: int) -> int:
        """Time since the first request."""
        self._start_ns = now_ns if self._start_ns is None else self._start_ns
        return now_ns - self._start_ns

    def _played(self, image: Image, index: int, time_s: float, now_ns: int) -> Frame:
        """A frame whose capture time is that of its source, `time_s` since the first one, and never later than now."""
        start_ns = now_ns if self._start_ns is None else self._start_ns
        return Frame(image, min(now_ns, start_ns + round(1e9 * time_s)), index)


class FileFrames(PlayedFrames):
    """Frames of a video file, at the times that the file gives them.

    Raises SourceError if the file does not exist, is no video or has no usable frame; EndOfFrames after the last frame.
    """

    def __init__(self, path: Path) -> None:
        self._video = VideoFile(path)
        self._waiting = self._read()
        if self._waiting is None:
            self._video.close()
            raise SourceError(f"{path} ({path.stat().st_size} bytes) holds no frame: it is cut off or damaged")

    def frame(self, now_ns: int, raw: RawImage | None = None) -> Frame | None:
        """The latest frame that is due. Raises EndOfFrames after the last one, FrameError for one that is unusable."""
        elapsed_s = 1e-9 * self._elapsed_ns(now_ns)
        latest: VideoFrame | None = None
        while isinstance(self._waiting, VideoFrame) and self._waiting.time_s - _early_s(self._waiting) <= elapsed_s:
            latest = self._waiting
            self._waiting = self._read()
        if latest is not None:
            return self._played(latest.image_bgr, latest.index, latest.time_s, now_ns)
        if self._waiting is None:
            raise EndOfFrames(self._video.ending())
        if isinstance(self._waiting, FrameError):
            unusable = self._waiting
            self._waiting = self._read()
            raise unusable
        return None

    def close(self) -> None:
        """Close the file."""
        self._video.close()

    def _read(self) -> VideoFrame | FrameError | None:
        """The next frame, what is wrong with it, or None after the last one."""
        try:
            return self._video.read()
        except FrameError as error:
            return error


def _early_s(frame: VideoFrame) -> float:
    return TICK_FRACTION * min(frame.gap_s, TICK_S)


class FolderFrames(PlayedFrames):
    """The pictures of a folder in the order of their names, at a given rate.

    Raises InputError if there are none; EndOfFrames after the last one.
    """

    def __init__(self, folder: Path, rate_hz: float) -> None:
        self._files = sorted(file for file in folder.glob("*") if file.suffix.lower() in PICTURES)
        if not self._files:
            reason = "it holds none" if folder.is_dir() else "there is no such folder"
            raise InputError(f"{folder}: a folder of pictures ({', '.join(PICTURES)}) expected, {reason}", missing=True)
        if not 0.1 <= rate_hz <= 1000.0:
            raise InputError(f"{folder}: 0.1 to 1000 pictures per second expected, found {rate_hz}")
        self._folder, self._rate_hz = folder, rate_hz
        self._next = 0

    def frame(self, now_ns: int, raw: RawImage | None = None) -> Frame | None:
        """The latest picture that is due. Raises FrameError for one that cannot be read."""
        index = int(self._elapsed_ns(now_ns) * 1e-9 * self._rate_hz + TICK_FRACTION)
        if index < self._next:
            return None
        if index >= len(self._files):
            raise EndOfFrames(f"{self._folder} has ended after {len(self._files)} pictures")
        self._next = index + 1
        try:
            image = read_picture(self._files[index])
        except InputError as error:
            raise FrameError(str(error), "corrupt") from error
        return self._played(image, index, index / self._rate_hz, now_ns)


class RecordingFrames(PlayedFrames):
    """The images of one topic of a recording, at the times at which they were captured.

    Raises InputError if the recording has none; EndOfFrames after the last one.
    """

    def __init__(self, path: Path, topic: str) -> None:
        if not path.is_file():
            raise InputError(f"{path}: no such recording; a run's recording.mcap expected", missing=True)
        self._path, self._topic = path, topic
        self._recorded: Iterator[Recorded] = read(path, only=[topic])
        try:
            self._waiting = next(self._recorded, None)
        except KeyError as error:
            raise InputError(f"{path}: {error.args[0]}") from error
        if self._waiting is None or not isinstance(self._waiting.message, CompressedImage):
            raise InputError(f"{path}: no images on {topic}; `paramove recover` lists the contents of a recording")
        self._first_ns = self._captured_ns(self._waiting)
        self._index = 0

    def frame(self, now_ns: int, raw: RawImage | None = None) -> Frame | None:
        """The latest image that is due. Raises FrameError for one that cannot be decoded."""
        due_ns = self._first_ns + self._elapsed_ns(now_ns) + 1_000_000
        if self._waiting is None:
            raise EndOfFrames(f"{self._path} has ended after {self._index} images on {self._topic}")
        latest: Recorded | None = None
        while self._waiting is not None and self._captured_ns(self._waiting) <= due_ns:
            latest, self._waiting = self._waiting, next(self._recorded, None)
            self._index += 1
        if latest is None:
            return None
        time_s = 1e-9 * (self._captured_ns(latest) - self._first_ns)
        return self._played(decode(latest.message), self._index - 1, time_s, now_ns)

    def close(self) -> None:
        """Releases the file."""
        self._recorded = iter(())

    @staticmethod
    def _captured_ns(recorded: Recorded) -> int:
        return int(recorded.message.timestamp.ToNanoseconds())


class DeviceFrames(FrameSource):
    """Frames of a V4L2 device, a network camera or a program's socket, read by a thread: no frame is late.

    The thread stores only the latest. A device that was unplugged may block a read for ten seconds or hand out its last
    frame again (opencv #5221, #14044): missing frames are detected here after `timeout_ns` of the caller's clock,
    repeated ones by `FrameChecks`. Every `timeout_ns` the device is opened again.

    Args:
        path: /dev/v4l/by-id/... (stays the same when plugged in elsewhere), /dev/videoN, N, or one of `URLS`.
        width_px, height_px, rate_hz: requested from the device.
        open_capture: opens a path; tests give a fake device.
    """

    def __init__(
        self,
        path: str,
        width_px: int,
        height_px: int,
        rate_hz: float = 15.0,
        timeout_ns: int = TIMEOUT_NS,
        open_capture: Callable[[str], Capture] | None = None,
    ) -> None:
        self._path = f"/dev/video{path}" if path.isdigit() else path
        self._settings = {
            cv2.CAP_PROP_FRAME_WIDTH: float(width_px),
            cv2.CAP_PROP_FRAME_HEIGHT: float(height_px),
            cv2.CAP_PROP_FPS: rate_hz,
            cv2.CAP_PROP_BUFFERSIZE: 1.0,
        }
        self._timeout_ns = timeout_ns
        self._name = without_password(self._path)
        self._open_capture = open_capture or (_open_url if is_network_camera(path) else _open_v4l2)
        self._latest_ns: int | None = None
        self._index = 0
        self._reader = _Reader(self._open())

    def frame(self, now_ns: int, raw: RawImage | None = None) -> Frame | None:
        """The latest frame, None if there is no new one yet. Raises FrameError after `timeout_ns` without one."""
        self._latest_ns = now_ns if self._latest_ns is None else self._latest_ns
        image = self._reader.take()
        if image is None:
            no_data_ns = now_ns - self._latest_ns
            if no_data_ns < self._timeout_ns:
                return None
            self._reader.stop()
            self._latest_ns = now_ns
            self._reader = _Reader(self._open())
            raise FrameError(
                f"camera {self._name} has given no frame for {no_data_ns / 1e9:.1f} s: {self._remedy}", "silent"
            )
        self._latest_ns = now_ns
        self._index += 1
        return Frame(image, now_ns, self._index - 1)

    def close(self) -> None:
        """Stop reading and release the device."""
        self._reader.stop()

    @property
    def _remedy(self) -> str:
        return "check its power and the network" if is_network_camera(self._path) else "replug it"

    def _open(self) -> Capture:
        capture = self._open_capture(self._path)
        for prop, value in self._settings.items():
            capture.set(prop, value)
        return capture


class _Reader:
    """A thread that reads frames and stores the latest. It ends when a read fails."""

    def __init__(self, capture: Capture) -> None:
        self._capture = capture
        self._lock = threading.Lock()
        self._latest: Image | None = None
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._read, name="camera reader", daemon=True)
        self._thread.start()

    def take(self) -> Image | None:
        """The latest frame since the last call, if any."""
        with self._lock:
            latest, self._latest = self._latest, None
        return latest

    def stop(self) -> None:
        """Ask the thread to end. It releases the device itself, as another thread's release during a read crashes."""
        self._stopping.set()
        self._thread.join(timeout=0.2)

    def _read(self) -> None:
        try:
            while not self._stopping.is_set() and self._capture.grab():
                done, image = self._capture.retrieve()
                if not done:
                    break
                with self._lock:
                    self._latest = image
        except cv2.error as error:  # unplugged during a read; `frame` reports that no frames come
            _log.warning("reading the camera: %s", error.err)
        finally:
            self._capture.release()


def open_source(source: str, width_px: int, height_px: int, folder: Path = Path()) -> FrameSource:
    """The source that the text names. Raises InputError if it is unknown or cannot be opened.

    Args:
        source: See `SOURCES`.
        width_px, height_px: Requested from a device.
        folder: That the path of a device starts from.
    """
    kind, _, rest = source.partition(":")
    if kind == "topic" and rest == "camera/image_raw":
        return TopicFrames()
    if kind == "file" and rest:
        return FileFrames(Path(rest))
    if kind == "device" and rest:
        is_complete = rest.isdigit() or is_network_camera(rest)
        return DeviceFrames(rest if is_complete else str(folder / rest), width_px, height_px)
    if kind == "folder" and rest:
        path, _, rate = rest.rpartition("@")
        try:
            rate_hz = float(rate)
        except ValueError as error:
            raise SourceError(f"camera source {source!r}: folder:PATH@RATE expected, as folder:pictures@10") from error
        return FolderFrames(Path(path), rate_hz)
    if kind == "recording" and "#" in rest:
        path, _, topic = rest.rpartition("#")
        return RecordingFrames(Path(path), topic)
    raise SourceError(f"camera source {source!r}: {SOURCES} expected")


def is_network_camera(path: str) -> bool:
    """Whether a device is named by a URL. Raises SourceError for one of a kind that is not supported."""
    if not re.match(r"[a-z][a-z0-9+.-]*://", path, re.IGNORECASE):
        return False
    if not path.lower().startswith(URLS):
        raise SourceError(f"camera {without_password(path)}: {', '.join(URLS)} are supported, or a device's path")
    return True


def without_password(source: str) -> str:
    """The same source as it may be printed and logged: of a URL without user and password."""
    return re.sub(r"(?<=://)[^/?#]*@", "", source)


def _open_url(url: str) -> Capture:
    """Raises SourceError if there is no stream of images within `OPEN_TIMEOUT_MS`."""
    timeouts = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, OPEN_TIMEOUT_MS, cv2.CAP_PROP_READ_TIMEOUT_MSEC, READ_TIMEOUT_MS]
    capture = cv2.VideoCapture(url, cv2.CAP_FFMPEG, timeouts)
    if not capture.isOpened():
        capture.release()
        raise SourceError(
            f"network camera {without_password(url)} gives no stream of images within {1e-3 * OPEN_TIMEOUT_MS:g} s: it "
            "must be switched on, in this network, and the address that of its MJPEG or RTSP stream, not of its page",
            missing=True,
        )
    return capture


def _offered(path: Path) -> Capture:
    try:
        return CameraSocket(path)
    except OSError as error:
        raise SourceError(f"no program offers images at {path}: {error.strerror}", missing=True) from error


def _open_v4l2(path: str) -> Capture:
    """Raises SourceError with the devices found, the remedy for missing permissions, or the holder of the device."""
    device = Path(path)
    if not device.exists():
        found = sorted(str(p) for p in [*Path("/dev").glob("video*"), *Path("/dev/v4l/by-id").glob("*")])
        raise SourceError(f"no camera {path}; found: {', '.join(found) or 'none at all: plug one in'}", missing=True)
    try:
        device.open("rb").close()
    except PermissionError as denied:
        raise SourceError(f"no right to read {path}: run 'sudo usermod -aG video $USER' and log in again") from denied
    except OSError as error:
        if device.is_socket():
            return _offered(device)
        raise SourceError(f"{path} cannot be opened: {error.strerror}; a V4L2 camera expected") from error
    capture = cv2.VideoCapture(path, cv2.CAP_V4L2)
    if not capture.isOpened():
        capture.release()
        held = ", ".join(map(str, holders(device)))
        why = f"held by {held}: end it first" if held else "it is no V4L2 camera that captures"
        raise SourceError(f"{path} gives no frames: {why}")
    return capture
