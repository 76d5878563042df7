"""The video of a pointing run: the first camera's images with the estimated arm and the ball where it points.

The action tracker draws the ball into its outline. The target of a body tracker's poses is
published in the world; the calibration in the run's folder projects it into the image.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from rich.console import Console
from rich.progress import track

from paramove.bus import topics
from paramove.cameras import CalibratedCamera, decode, read_cameras
from paramove.documents import Image, replacing
from paramove.msgs.gesture_pb2 import Gesture
from paramove.runs.recorded_run import recording_in
from paramove.runs.video import SIZE, VideoWriter

REPEATED = 2
"""Images come at 15 Hz."""
BALL_PX = 9.0
DISPLAYED_S = 1.5
"""How long a gesture is displayed."""
CAMERA = topics.CAMERA_IMAGES[0].name


def write_pointing_video(folder: Path, console: Console) -> Path | None:
    """Write `pointing.mp4` into the run's folder; None if no image was recorded. Raises VideoError."""
    frames = list(_frames(folder))
    if not frames:
        return None
    path = folder / "pointing.mp4"
    height, width = decode(frames[0][0]).shape[:2]
    scale = min(SIZE[0] / width, SIZE[1] / height)
    inner = (round(scale * width), round(scale * height))
    left, top = (SIZE[0] - inner[0]) // 2, (SIZE[1] - inner[1]) // 2
    with replacing(path) as unfinished, VideoWriter(unfinished) as writer:
        for image, outline, caption in track(frames, "video", console=console, transient=True):
            picture = np.zeros((SIZE[1], SIZE[0], 3), dtype=np.uint8)
            picture[top : top + inner[1], left : left + inner[0]] = drawn(decode(image), outline, caption, inner)
            writer.write(picture, REPEATED)
    return path


def drawn(image_bgr: Image, outline: Any | None, caption: str, size_px: tuple[int, int]) -> Image:
    """The picture RGB of an image with `foxglove.ImageAnnotations` in its pixels, enlarged."""
    scale = size_px[0] / image_bgr.shape[1]
    picture = cv2.cvtColor(cv2.resize(image_bgr, size_px, interpolation=cv2.INTER_CUBIC), cv2.COLOR_BGR2RGB)
    for line in outline.points if outline is not None else ():
        points = scale * (np.array([(point.x, point.y) for point in line.points]).reshape(-1, 1, 2) + 0.5) - 0.5
        colour = _rgb(line.outline_color)
        cv2.polylines(picture, [(8 * points).round().astype(np.int32)], True, colour, 2, cv2.LINE_AA, shift=3)
    for circle in outline.circles if outline is not None else ():
        centre = (round(scale * circle.position.x), round(scale * circle.position.y))
        cv2.circle(picture, centre, round(scale * circle.diameter / 2), _rgb(circle.fill_color), -1, cv2.LINE_AA)
        cv2.circle(picture, centre, round(scale * circle.diameter / 2), (0, 0, 0), 1, cv2.LINE_AA)
    if caption:
        corner, font = (16, size_px[1] - 20), cv2.FONT_HERSHEY_SIMPLEX
        cv2.putText(picture, caption, corner, font, 0.8, (0, 0, 0), 5, cv2.LINE_AA)
        cv2.putText(picture, caption, corner, font, 0.8, (255, 255, 255), 2, cv2.LINE_AA)
    return np.asarray(picture, dtype=np.uint8)


def _rgb(colour: Any) -> tuple[int, int, int]:
    return round(255 * colour.r), round(255 * colour.g), round(255 * colour.b)


def _frames(folder: Path) -> Iterator[tuple[Any, Any | None, str]]:
    """Image, annotations of the same capture time, and the text of the last gesture."""
    waiting: dict[int, Any] = {}
    outlines: dict[int, Any] = {}
    captions: list[tuple[int, str]] = []
    camera = _camera(folder)
    needed = {CAMERA, topics.ACTION_OUTLINE.name, topics.GESTURES.name, topics.GESTURES_SCENE.name}
    for recorded in recording_in(folder, "recording").read(needed):
        if recorded.topic == CAMERA:
            waiting[recorded.log_ns] = recorded.message
        elif recorded.topic == topics.ACTION_OUTLINE.name:
            outlines[recorded.log_ns] = recorded.message
        elif recorded.topic == topics.GESTURES_SCENE.name:
            if camera is not None and recorded.log_ns in outlines:
                _add_ball(outlines[recorded.log_ns], recorded.message, camera)
        elif recorded.message.kind == Gesture.KIND_POINTED_AT:
            at = recorded.message
            captions.append((recorded.log_ns, f"points at ({100 * at.x:.0f}, {100 * at.y:.0f}) cm"))
    for time_ns, image in waiting.items():
        recent = [text for at, text in captions if 0 <= time_ns - at <= DISPLAYED_S * 1e9]
        yield image, outlines.get(time_ns), recent[-1] if recent else ""


def _camera(folder: Path) -> CalibratedCamera | None:
    """The first of the cameras, if their calibration lies in the run's folder."""
    path = folder / "cameras.yaml"
    return read_cameras(path)[0] if path.is_file() else None


def _add_ball(outline: Any, scene: Any, camera: CalibratedCamera) -> None:
    """Adds the balls of a `foxglove.SceneUpdate` to annotations of the camera's image."""
    for ball in (ball for entity in scene.entities for ball in entity.spheres):
        centre = ball.pose.position
        x, y = camera.project(np.array([centre.x, centre.y, centre.z]))
        if np.isfinite((x, y)).all():
            circle = outline.circles.add(diameter=BALL_PX)
            circle.position.x, circle.position.y = x, y
            circle.fill_color.CopyFrom(ball.color)
