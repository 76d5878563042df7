"""Films of a run for people: their layout, texts in their pictures, and their encoder.

H.264 in mp4, which browsers, QuickTime and slides play; VP9 where there is no such encoder.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import lru_cache
from pathlib import Path
from typing import Self

import av
import cv2
import numpy as np
import PIL.Image
from matplotlib import font_manager
from PIL import ImageDraw, ImageFont

from paramove.bus import topics
from paramove.documents import Image
from paramove.recording import Recorded
from paramove.runs.recorded_run import RecordedRun

Colour = tuple[int, int, int]

FRAMES_PER_S = 30
LINGER_FRAMES = 60
"""The last picture of a film stays so long."""
PANEL = (640, 480)
TOP_PX, BOTTOM_PX = 48, 192
SIZE = (2 * PANEL[0], TOP_PX + PANEL[1] + BOTTOM_PX)

BACK: Colour = (24, 27, 33)
FAINT: Colour = (130, 138, 150)
TEXT: Colour = (236, 239, 244)
ACCENT: Colour = (98, 190, 255)

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
        path: Of the file, which gets pictures of `SIZE`.

    Raises:
        VideoError: There is no encoder.
    """

    def __init__(self, path: Path) -> None:
        encoder = next((name for name in ENCODERS if name in av.codecs_available), "libvpx-vp9")
        try:
            self._file = av.open(str(path), "w", format="mp4", options={"movflags": "faststart"})
            stream = self._file.add_stream(encoder, rate=FRAMES_PER_S, options=ENCODERS[encoder])
        except (av.FFmpegError, ValueError) as error:
            raise VideoError(
                f"PyAV {av.__version__} opens no encoder {encoder} for {path}: {error}; use --no-video"
            ) from error
        assert isinstance(stream, av.VideoStream)
        self._stream = stream
        self._stream.width, self._stream.height = SIZE
        self._stream.pix_fmt = "yuv420p"
        self._thread = ThreadPoolExecutor(max_workers=1)
        self._waiting: deque[Future[None]] = deque()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._thread.shutdown()
        self._file.mux(self._stream.encode())
        self._file.close()

    def write(self, picture: Image, times: int = 1) -> None:
        """Add a picture, RGB, so many times; waits while many wait to be encoded."""
        for _ in range(times):
            self._waiting.append(self._thread.submit(self._encode, picture))
            if len(self._waiting) > WAITING_FRAMES:
                self._waiting.popleft().result()

    def _encode(self, picture: Image) -> None:
        self._file.mux(self._stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))


def views_with(
    run: RecordedRun, names: Collection[str], stamp: Callable[[Recorded], int]
) -> Iterator[tuple[Recorded, dict[str, Recorded]]]:
    """Every recorded view of the world, with the latest message of each of the topics whose stamp is not later."""
    messages = run.recording("recording").read(names)
    following = next(messages, None)
    latest: dict[str, Recorded] = {}
    for view in run.recording("truth").read({topics.TRUTH_VIEW.name}):
        while following is not None and stamp(following) <= stamp(view):
            latest[following.topic] = following
            following = next(messages, None)
        yield view, latest


def side_by_side(camera: Image, caption: str, view: Image, title: str, time_s: float, factor: float) -> Image:
    """A picture of `SIZE`: an image of the size of `PANEL` with its caption, the world next to it, room around.

    Args:
        camera, view: RGB.
        caption: Of the camera's image.
        title: Stands at the top left.
        time_s: Stands at the top right, with the `factor` by which the video is faster than the run.
    """
    picture = np.full((SIZE[1], SIZE[0], 3), BACK, dtype=np.uint8)
    body = picture[TOP_PX : TOP_PX + PANEL[1]]
    body[:, : PANEL[0]] = camera
    body[:, PANEL[0] :] = cv2.resize(view, PANEL)
    paste(body, label(caption, 16, TEXT), 10, PANEL[1] - 30, shade=True)
    paste(body, label("the world: not shown to the robot", 16, TEXT), PANEL[0] + 10, PANEL[1] - 30, shade=True)
    paste(picture, label(title, 20, TEXT, bold=True), 16, 12)
    clock = label(f"{time_s:6.1f} s   {factor:g}× speed", 19, FAINT)
    paste(picture, clock, SIZE[0] - clock.shape[1] - 16, 13)
    return picture


def shortened(text: str, length: int) -> str:
    """In quotation marks, without what is longer; "" for none."""
    return f"“{text if len(text) <= length else text[: length - 1] + '…'}”" if text else ""


@lru_cache(maxsize=8)
def _font(size: int, bold: bool) -> ImageFont.FreeTypeFont:
    weight = "bold" if bold else "normal"
    return ImageFont.truetype(font_manager.findfont(f"DejaVu Sans:{weight}"), size)


@lru_cache(maxsize=1024)
def label(text: str, size: int, colour: Colour, bold: bool = False) -> Image:
    """A text as RGBA [h, w, 4]."""
    font = _font(size, bold)
    left, _, right, _ = font.getbbox(text)
    ascent, descent = font.getmetrics()
    image = PIL.Image.new("RGBA", (max(1, round(right - left) + 2), ascent + descent), (*colour, 0))
    ImageDraw.Draw(image).text((1 - left, 0), text, font=font, fill=(*colour, 255))
    return np.asarray(image)


def paste(image: Image, sprite: Image, x: int, y: int, shade: bool = False) -> None:
    """Blend a sprite in at (x, y), in place, cut at the borders; with `shade` onto a darkened ground."""
    left, top = max(0, x), max(0, y)
    part = image[top : max(0, y + sprite.shape[0]), left : max(0, x + sprite.shape[1])]
    if part.size == 0:
        return
    cut = sprite[top - y : top - y + part.shape[0], left - x : left - x + part.shape[1]]
    alpha = cut[..., 3:].astype(np.float32) / 255
    ground = part * 0.45 if shade else part
    part[:] = (ground * (1 - alpha) + cut[..., :3] * alpha).astype(np.uint8)
