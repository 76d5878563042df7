"""The video of relocation by pointing: camera 1 with the ball, the world next to it, and the robot's speech."""

from __future__ import annotations

from operator import attrgetter
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track

from paramove.bus import topics
from paramove.cameras import decode
from paramove.documents import replacing
from paramove.runs.pointing.video import drawn
from paramove.runs.recorded_run import RecordedRun
from paramove.runs.video import (
    ACCENT,
    LINGER_FRAMES,
    PANEL,
    SIZE,
    TEXT,
    TOP_PX,
    VideoWriter,
    label,
    paste,
    shortened,
    side_by_side,
    views_with,
)

FACTOR = 2
"""Every image becomes a frame: at 15 Hz the video is twice as fast as the run."""
MAX_LETTERS = 104
CAMERA, OUTLINE = topics.CAMERA_IMAGES[0].name, topics.ACTION_OUTLINE.name
CAPTION = "camera 1, the tracked arm, and the ball where it points"


def write_relocation_video(run: RecordedRun, console: Console) -> Path | None:
    """Write `relocations.mp4` into the run's folder; None if no view was recorded (headless). Raises VideoError."""
    views = sum(1 for _ in run.recording("truth").read({topics.TRUTH_VIEW.name}))
    if not views:
        return None
    path = run.folder / "relocations.mp4"
    title = run.title("relocation by pointing")
    with replacing(path) as unfinished, VideoWriter(unfinished) as writer:
        picture = np.zeros((SIZE[1], SIZE[0], 3), dtype=np.uint8)
        pairs = views_with(run, {CAMERA, OUTLINE}, attrgetter("publish_ns"))
        for view, latest in track(pairs, "video", views, console=console, transient=True):
            if CAMERA not in latest:
                continue
            time_s = view.log_ns * 1e-9
            outline = latest[OUTLINE].message if OUTLINE in latest else None
            camera = drawn(decode(latest[CAMERA].message), outline, "", PANEL)
            picture = side_by_side(camera, CAPTION, decode(view.message)[:, :, ::-1], title, time_s, FACTOR)
            stage, speech = run.latest(topics.APPLICATION_STAGE, time_s), run.latest(topics.SPEECH, time_s)
            step = stage.message.step.replace("_", " ") if stage is not None else ""
            paste(picture, label(step, 20, ACCENT), 560, 12)
            detail = shortened(speech.message.text, MAX_LETTERS) if speech is not None else ""
            paste(picture, label(detail, 22, TEXT, bold=True), 18, TOP_PX + PANEL[1] + 30)
            writer.write(picture)
        writer.write(picture, LINGER_FRAMES)
    return path
