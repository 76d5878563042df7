"""The demo video of a run: VP9 in mp4, which browsers play."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Self

import av
import cv2
import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track

from paramove.bus import topics
from paramove.evaluation.recorded_run import recording_in
from paramove.evaluation.run_summary import RunEvaluation
from paramove.evaluation.story import Story
from paramove.evaluation.video_frame import SIZE, VideoFrame

Picture = NDArray[np.uint8]

FRAMES_PER_S = 10.0
CAMERA_HZ = 15.0
LONG_RUN_S = 400.0
"""A longer run is shown four times as fast as it was, others twice."""
WAITING_FRAMES = 8
ENCODER = {"deadline": "realtime", "cpu-used": "7", "row-mt": "1", "crf": "34", "b": "0", "g": "20"}
LINGER_FRAMES = 20  # the last picture stays so long


class VideoError(RuntimeError):
    """No video can be written; the text says what was tried."""


def write_video(evaluation: RunEvaluation, console: Console) -> Path | None:
    """Write `demo.mp4` into the run's folder, with a progress bar; None if the view was not recorded (headless).

    Raises:
        VideoError: There is no VP9 encoder.
    """
    run = evaluation.run
    number = sum(time_s <= run.end_s for time_s in view_times(run.folder))
    if number == 0:
        return None
    story = Story(run, evaluation.relocations)
    factor = 2 if run.end_s <= LONG_RUN_S else 4
    every = round(factor * CAMERA_HZ / FRAMES_PER_S)
    frame = VideoFrame(f"rule learning, seed {run.truth.layout.seed}", factor)
    path = run.folder / "demo.mp4"
    beside = path.with_name("demo.part.mp4")
    with _Writer(beside) as writer:
        shown = range(0, number, every)
        pictures = paired_images(run.folder, every)
        picture = np.zeros((SIZE[1], SIZE[0], 3), dtype=np.uint8)
        for _, (time_s, camera, view) in zip(
            track(shown, "video", console=console, transient=True), pictures, strict=False
        ):
            picture = frame.draw(camera, view, story.at(time_s), time_s, run.end_s)
            writer.write(picture)
        for _ in range(LINGER_FRAMES):
            writer.write(picture)
    beside.replace(path)
    return path


def view_times(folder: Path) -> Iterator[float]:
    """Times of the recorded views, s."""
    for recorded in recording_in(folder, "truth.mcap").read({topics.TRUTH_VIEW.name}):
        yield recorded.log_ns * 1e-9


def paired_images(folder: Path, every: int) -> Iterator[tuple[float, Picture, Picture]]:
    """Time, camera image and view, RGB, of every so-many-th view; the camera's image is the newest one by then."""
    cameras = recording_in(folder, "recording.mcap").read({topics.CAMERA_IMAGE.name})
    newest, following = None, next(cameras, None)
    for place, view in enumerate(recording_in(folder, "truth.mcap").read({topics.TRUTH_VIEW.name})):
        while following is not None and following.log_ns <= view.log_ns:
            newest, following = following, next(cameras, None)
        if place % every == 0 and newest is not None:
            yield view.log_ns * 1e-9, _decoded(newest.message.data), _decoded(view.message.data)


def _decoded(data: bytes) -> Picture:
    image = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_COLOR)
    if image is None:
        raise VideoError(f"an image of {len(data)} bytes in the recording cannot be decoded")
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), dtype=np.uint8)


class _Writer:
    """Encodes in a thread of its own, so that the next picture is drawn meanwhile."""

    def __init__(self, path: Path) -> None:
        try:
            self._file = av.open(str(path), "w")
            self._stream = self._file.add_stream("libvpx-vp9", rate=round(FRAMES_PER_S), options=ENCODER)
        except (av.FFmpegError, ValueError) as error:
            raise VideoError(
                f"PyAV {av.__version__} opens no VP9 encoder for {path}: {error}; use --no-video"
            ) from error
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

    def write(self, picture: Picture) -> None:
        """Add a picture, RGB; waits while many wait to be encoded."""
        self._waiting.append(self._thread.submit(self._encode, picture))
        if len(self._waiting) > WAITING_FRAMES:
            self._waiting.popleft().result()

    def _encode(self, picture: Picture) -> None:
        self._file.mux(self._stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
