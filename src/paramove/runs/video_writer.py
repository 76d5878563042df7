"""Videos for people: H.264 in mp4, which browsers, QuickTime and slides play; VP9 where there is no such encoder."""

from __future__ import annotations

from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Self

import av

from paramove.documents import Image

WAITING_FRAMES = 8
ENCODERS = {
    "libx264": {"preset": "veryfast", "crf": "26", "g": "40"},
    "libvpx-vp9": {"deadline": "realtime", "cpu-used": "7", "row-mt": "1", "crf": "34", "b": "0", "g": "20"},
}
"""Options of each encoder, the preferred one first."""


class VideoError(RuntimeError):
    """No video can be written; the text says what was tried."""


class VideoWriter:
    """Encodes in a thread of its own, so that the next picture is drawn meanwhile.

    Args:
        path: Of the file.
        size_px: Width and height of the pictures.
        rate_hz: Pictures per second.

    Raises:
        VideoError: There is no encoder.
    """

    def __init__(self, path: Path, size_px: tuple[int, int], rate_hz: float) -> None:
        encoder = next((name for name in ENCODERS if name in av.codecs_available), "libvpx-vp9")
        try:
            self._file = av.open(str(path), "w", format="mp4", options={"movflags": "faststart"})
            stream = self._file.add_stream(encoder, rate=round(rate_hz), options=ENCODERS[encoder])
        except (av.FFmpegError, ValueError) as error:
            raise VideoError(
                f"PyAV {av.__version__} opens no encoder {encoder} for {path}: {error}; use --no-video"
            ) from error
        assert isinstance(stream, av.VideoStream)
        self._stream = stream
        self._stream.width, self._stream.height = size_px
        self._stream.pix_fmt = "yuv420p"
        self._thread = ThreadPoolExecutor(max_workers=1)
        self._waiting: deque[Future[None]] = deque()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._thread.shutdown()
        self._file.mux(self._stream.encode())
        self._file.close()

    def write(self, picture: Image) -> None:
        """Add a picture, RGB; waits while many wait to be encoded."""
        self._waiting.append(self._thread.submit(self._encode, picture))
        if len(self._waiting) > WAITING_FRAMES:
            self._waiting.popleft().result()

    def _encode(self, picture: Image) -> None:
        self._file.mux(self._stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
