"""The demo video of a run."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
from rich.console import Console
from rich.progress import track

from paramove.bus import topics
from paramove.documents import Image, InputError, decoded, replacing
from paramove.runs.recorded_run import RecordedRun
from paramove.runs.rule_learning.story import Story
from paramove.runs.rule_learning.summary import RunEvaluation
from paramove.runs.rule_learning.video_frame import SIZE, VideoFrame
from paramove.runs.video_writer import VideoError, VideoWriter

FRAMES_PER_S = 30.0
CAMERA_HZ = 15.0
LONG_RUN_S = 400.0
"""A longer run is displayed four times as fast as it was, others twice."""
LINGER_FRAMES = 60  # the last picture stays so long


def write_video(evaluation: RunEvaluation, console: Console) -> Path | None:
    """Write `demo.mp4` into the run's folder, with a progress bar; None if the view was not recorded (headless).

    Raises:
        VideoError: There is no encoder.
    """
    run = evaluation.run
    number = sum(time_s <= run.end_s for time_s in view_times(run))
    if number == 0:
        return None
    story = Story(run, evaluation.relocations)
    factor = 2 if run.end_s <= LONG_RUN_S else 4
    every = round(factor * CAMERA_HZ / FRAMES_PER_S)
    frame = VideoFrame(run.title("rule learning"), factor)
    path = run.folder / "demo.mp4"
    with replacing(path) as unfinished, VideoWriter(unfinished, SIZE, FRAMES_PER_S) as writer:
        indices = range(0, number, every)
        pictures = paired_images(run, every)
        picture = np.zeros((SIZE[1], SIZE[0], 3), dtype=np.uint8)
        for _, (time_s, camera, view) in zip(
            track(indices, "video", console=console, transient=True), pictures, strict=False
        ):
            picture = frame.draw(camera, view, story.at(time_s), time_s, run.end_s)
            writer.write(picture)
        for _ in range(LINGER_FRAMES):
            writer.write(picture)
    return path


def view_times(run: RecordedRun) -> Iterator[float]:
    """Times of the recorded views, s."""
    for recorded in run.recording("truth").read({topics.TRUTH_VIEW.name}):
        yield recorded.log_ns * 1e-9


def paired_images(run: RecordedRun, every: int) -> Iterator[tuple[float, Image, Image]]:
    """Time, camera image and view, RGB, of every so-many-th view; the camera's image is the latest one by then."""
    cameras = run.recording("recording").read({topics.CAMERA_IMAGE.name})
    latest, following = None, next(cameras, None)
    views = run.recording("truth").read({topics.TRUTH_VIEW.name})
    for index, view in enumerate(views):
        while following is not None and following.log_ns <= view.log_ns:
            latest, following = following, next(cameras, None)
        if index % every == 0 and latest is not None:
            yield view.log_ns * 1e-9, _decoded(latest.message.data), _decoded(view.message.data)


def _decoded(data: bytes) -> Image:
    try:
        image = decoded(data)
    except InputError as error:
        raise VideoError(f"an image of {len(data)} bytes in the recording {error}") from error
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), dtype=np.uint8)
