"""Strips of images with the estimated arm and target drawn into them (thesis figures 6.10 to 6.27)."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np

from paramove.cameras import CalibratedCamera
from paramove.documents import Floats, Image, Ints
from paramove.observation import ArmObserver
from sim.persons.clips import Clip
from studies.chapter6.measures import Track

COLUMNS = 8
IMAGE_PX = (200, 150)
BALL_M = 0.028
MIN_BALL_PX = 5
UNCERTAIN = 0.25
"""Deviation of theta from which on the ball is red; it is green at 0."""
ARM_COLOUR, TEXT_COLOUR = (80, 255, 120), (255, 255, 255)
QUALITY = 82


def strip(clip: Clip, rows: Sequence[tuple[Track, int]], title: str) -> str:
    """Rows of images of one clip as an HTML figure; each row one track seen in one view.

    The frames lie evenly from shortly before the first performance to the end of the last.
    """
    pictures = np.vstack([_row(clip, track, view, frame_numbers(track)) for track, view in rows])
    written, file = cv2.imencode(".jpg", pictures[..., ::-1], (cv2.IMWRITE_JPEG_QUALITY, QUALITY))
    if not written:
        raise ValueError(f"a picture of shape {pictures.shape} cannot be written as JPEG")
    data = base64.b64encode(file.tobytes()).decode("ascii")
    return f"<img alt='{title}' style='width:100%' src='data:image/jpeg;base64,{data}'>"


def frame_numbers(track: Track) -> Ints:
    """Numbers of the frames that are shown, (COLUMNS,)."""
    first = max(int(np.searchsorted(track.times_s, track.acts[0].start_s)) - 1, 0)
    last = min(int(np.searchsorted(track.times_s, track.acts[-1].end_s)), len(track.times_s) - 1)
    return np.linspace(first, last, COLUMNS).round().astype(np.int64)


def _row(clip: Clip, track: Track, view: int, numbers: Ints) -> Image:
    observer = ArmObserver(clip.sizes, [clip.cameras[view]], threads=1)
    pictures: dict[int, Image] = {}
    for number, image in enumerate(clip.images(view)):
        if number in numbers:
            outline = observer.outline(track.poses[number], 0)
            pictures[number] = drawn(image, clip.cameras[view], outline, track, number)
    row = np.hstack([cv2.resize(pictures[int(number)], IMAGE_PX, interpolation=cv2.INTER_AREA) for number in numbers])
    cameras = ", ".join(str(one + 1) for one in track.views)
    text = f"tracked by camera{'s' if len(track.views) > 1 else ''} {cameras}, image of camera {view + 1}"
    for colour, thickness in (((0, 0, 0), 3), (TEXT_COLOUR, 1)):
        cv2.putText(row, text, (5, 12), cv2.FONT_HERSHEY_SIMPLEX, 0.4, colour, thickness, cv2.LINE_AA)
    return np.asarray(row, dtype=np.uint8)


def drawn(image: Image, camera: CalibratedCamera, outline: Floats, track: Track, number: int) -> Image:
    """The image with the estimated arm's outline and a ball where theta leads, green if that is certain."""
    result: Any = image.copy()
    if len(outline):
        points = np.round(outline).astype(np.int32)[:, None]
        cv2.polylines(result, [points], isClosed=True, color=ARM_COLOUR, thickness=2, lineType=cv2.LINE_AA)
    target = track.pointed[number]
    pixel = camera.project(target)
    height, width = image.shape[:2]
    if np.isfinite(pixel).all() and 0.0 <= pixel[0] < width and 0.0 <= pixel[1] < height:
        away = float(np.linalg.norm(target - camera.position))
        radius = max(MIN_BALL_PX, round(float(camera.matrix[0, 0]) * BALL_M / away))
        centre = (round(float(pixel[0])), round(float(pixel[1])))
        cv2.circle(result, centre, radius, certainty_colour(float(track.theta_deviation[number])), -1, cv2.LINE_AA)
        cv2.circle(result, centre, radius, (20, 20, 20), 1, cv2.LINE_AA)
    return np.asarray(result, dtype=np.uint8)


def certainty_colour(deviation: float) -> tuple[int, int, int]:
    """RGB: green for a certain theta, over yellow to red."""
    doubt = min(max(deviation / UNCERTAIN, 0.0), 1.0)
    return round(255 * min(1.0, 2.0 * doubt)), round(230 * min(1.0, 2.0 * (1.0 - doubt))), 0
