"""Frames replayed at their recorded rate: a folder of pictures, or the images of a recording."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from paramove.cameras.frames import EndOfFrames, Frame, FrameError, decode
from paramove.documents import InputError, read_picture
from paramove.recording import Recorded, read

PICTURES = (".jpg", ".jpeg", ".png", ".bmp")
TICK_FRACTION = 0.25
"""Fraction of a frame's period by which it may be early, as ticks are rounded to milliseconds."""


class FolderFrames:
    """The pictures of a folder in the order of their names, at a given rate; those between two ticks are left out.

    Raises InputError if there are none; EndOfFrames after the last one.
    """

    from_topic = False

    def __init__(self, folder: Path, rate_hz: float) -> None:
        self._files = sorted(file for file in folder.glob("*") if file.suffix.lower() in PICTURES)
        if not self._files:
            reason = "it holds none" if folder.is_dir() else "there is no such folder"
            raise InputError(f"{folder}: a folder of pictures ({', '.join(PICTURES)}) expected, {reason}", missing=True)
        if not 0.1 <= rate_hz <= 1000.0:
            raise InputError(f"{folder}: 0.1 to 1000 pictures per second expected, found {rate_hz}")
        self._folder, self._rate_hz = folder, rate_hz
        self._start_ns: int | None = None
        self._next = 0

    def frame(self, now_ns: int, raw: RawImage | None = None) -> Frame | None:
        """The latest picture that is due. Raises FrameError for one that cannot be read."""
        self._start_ns = now_ns if self._start_ns is None else self._start_ns
        index = int((now_ns - self._start_ns) * 1e-9 * self._rate_hz + TICK_FRACTION)
        if index < self._next:
            return None
        if index >= len(self._files):
            raise EndOfFrames(f"{self._folder} has ended after {len(self._files)} pictures")
        self._next = index + 1
        try:
            image = read_picture(self._files[index])
        except InputError as error:
            raise FrameError(str(error), "corrupt") from error
        return Frame(image, now_ns, index)

    def close(self) -> None:
        """Does nothing: there is no resource to release."""


class RecordingFrames:
    """The images of one topic of a recording, at the times at which they were captured.

    Raises InputError if the recording has none; EndOfFrames after the last one.
    """

    from_topic = False

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
        self._start_ns: int | None = None
        self._index = 0

    def frame(self, now_ns: int, raw: RawImage | None = None) -> Frame | None:
        """The latest image that is due. Raises FrameError for one that cannot be decoded."""
        self._start_ns = now_ns if self._start_ns is None else self._start_ns
        due_ns = self._first_ns + (now_ns - self._start_ns) + 1_000_000
        if self._waiting is None:
            raise EndOfFrames(f"{self._path} has ended after {self._index} images on {self._topic}")
        latest: Recorded | None = None
        while self._waiting is not None and self._captured_ns(self._waiting) <= due_ns:
            latest, self._waiting = self._waiting, next(self._recorded, None)
            self._index += 1
        return None if latest is None else Frame(decode(latest.message), now_ns, self._index - 1)

    def close(self) -> None:
        """Releases the file."""
        self._recorded = iter(())

    @staticmethod
    def _captured_ns(recorded: Recorded) -> int:
        return int(recorded.message.timestamp.ToNanoseconds())
