"""The video of relocation by pointing: camera 1 with the ball, the world next to it, and the robot's speech."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from rich.console import Console
from rich.progress import track

from paramove.bus import topics
from paramove.cameras import decode
from paramove.documents import Image, replacing
from paramove.runs.pointing.video import drawn
from paramove.runs.recorded_run import RecordedRun
from paramove.runs.rule_learning.video_frame import (
    ACCENT,
    BACK,
    BOTTOM_PX,
    FAINT,
    PANEL,
    SIZE,
    TEXT,
    TOP_PX,
    label,
    paste,
)
from paramove.runs.video_writer import VideoWriter

FRAMES_PER_S = 30.0
EVERY = 1
"""So many-th image; at 15 Hz the video is twice as fast as the run."""
LINGER_FRAMES = 60
MAX_LETTERS = 104
CAMERA = topics.CAMERA_IMAGES[0].name


def write_relocation_video(run: RecordedRun, console: Console) -> Path | None:
    """Write `relocations.mp4` into the run's folder; None if no view was recorded (headless). Raises VideoError."""
    views = sum(1 for _ in run.recording("truth").read({topics.TRUTH_VIEW.name}))
    if not views:
        return None
    speech = [(r.publish_ns, r.message.text) for r in run.received(topics.SPEECH)]
    states = [(r.publish_ns, r.message.step.replace("_", " ")) for r in run.received(topics.APPLICATION_STAGE)]
    path = run.folder / "relocations.mp4"
    title = run.title("relocation by pointing")
    with replacing(path) as unfinished, VideoWriter(unfinished, SIZE, FRAMES_PER_S) as writer:
        picture = np.zeros((SIZE[1], SIZE[0], 3), dtype=np.uint8)
        frames = track(_frames(run), "video", views // EVERY, console=console, transient=True)
        for time_ns, camera, outline, view in frames:
            picture = composed(camera, outline, view)
            paste(picture, label(title, 20, TEXT, bold=True), 16, 12)
            paste(picture, label(f"{_latest(states, time_ns)}", 20, ACCENT), 560, 12)
            clock = label(f"{time_ns * 1e-9:6.1f} s   2× speed", 19, FAINT)
            paste(picture, clock, SIZE[0] - clock.shape[1] - 16, 13)
            caption = label(_quoted(_latest(speech, time_ns)), 22, TEXT, bold=True)
            paste(picture, caption, 18, TOP_PX + PANEL[1] + 30)
            writer.write(picture)
        for _ in range(LINGER_FRAMES):
            writer.write(picture)
    return path


def composed(camera_bgr: Image, outline: Any | None, view: Image) -> Image:
    """Both images side by side, RGB, with room above and below."""
    frame = np.empty((SIZE[1], SIZE[0], 3), dtype=np.uint8)
    frame[:] = BACK
    body = frame[TOP_PX : SIZE[1] - BOTTOM_PX]
    body[:, : PANEL[0]] = drawn(camera_bgr, outline, "", PANEL)
    body[:, PANEL[0] :] = cv2.resize(view, PANEL)
    paste(body, label("camera 1, the tracked arm, and the ball where it points", 16, TEXT), 10, PANEL[1] - 30, True)
    paste(body, label("the world: not shown to the robot", 16, TEXT), PANEL[0] + 10, PANEL[1] - 30, True)
    return frame


def _frames(run: RecordedRun) -> Iterator[tuple[int, Image, Any | None, Image]]:
    """Time, image BGR and its annotations, and the view RGB, of every so-many-th view."""
    needed = {CAMERA, topics.ACTION_OUTLINE.name}
    outlines: dict[int, Any] = {}
    recorded_images = run.recording("recording").read(needed)
    image, following = None, next(recorded_images, None)
    for index, view in enumerate(run.recording("truth").read({topics.TRUTH_VIEW.name})):
        while following is not None and following.publish_ns <= view.publish_ns:
            if following.topic == CAMERA:
                image = following
            else:
                outlines = {following.log_ns: following.message}
            following = next(recorded_images, None)
        if index % EVERY == 0 and image is not None:
            latest = next(iter(outlines.values()), None)
            yield view.log_ns, decode(image.message), latest, decode(view.message)[:, :, ::-1]


def _latest(texts: list[tuple[int, str]], time_ns: int) -> str:
    at = bisect_right(texts, time_ns, key=lambda one: one[0])
    return texts[at - 1][1] if at else ""


def _quoted(detail: str) -> str:
    if not detail:
        return ""
    return f"“{detail if len(detail) <= MAX_LETTERS else detail[: MAX_LETTERS - 1] + '…'}”"
