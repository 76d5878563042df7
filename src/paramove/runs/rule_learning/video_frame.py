"""One picture of the demo video: the camera with the robot's estimates, the world next to it, captions around."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import cv2
import numpy as np
import PIL.Image
from matplotlib import font_manager
from PIL import ImageDraw, ImageFont

from paramove.documents import Image
from paramove.msgs.tracked_objects_pb2 import TrackedObject
from paramove.runs.rule_learning.story import RobotState

Colour = tuple[int, int, int]

PANEL = (640, 480)
TOP_PX, BOTTOM_PX = 48, 192
SIZE = (2 * PANEL[0], TOP_PX + PANEL[1] + BOTTOM_PX)

BACK: Colour = (24, 27, 33)
FAINT: Colour = (130, 138, 150)
TEXT: Colour = (236, 239, 244)
ACCENT: Colour = (98, 190, 255)
COLOURS: dict[str, Colour] = {"yellow": (255, 205, 40), "green": (70, 205, 95), "blue": (95, 140, 255)}
HAND: Colour = (255, 80, 190)
STAGES = ("calibrate", "learn", "apply")


class VideoFrame:
    """Composes pictures, RGB [H, W, 3] of `SIZE`.

    Args:
        title: Stands at the top left.
        factor: By which the video is faster than the run.
    """

    def __init__(self, title: str, factor: float) -> None:
        self._title, self._factor = title, factor
        self._steady = SteadyImage()

    def draw(self, camera: Image, view: Image, state: RobotState, time_s: float, end_s: float) -> Image:
        """A picture from the two images, RGB, and the robot's state."""
        frame = np.empty((SIZE[1], SIZE[0], 3), dtype=np.uint8)
        frame[:] = BACK
        body = frame[TOP_PX : TOP_PX + PANEL[1]]
        zoom = PANEL[0] / camera.shape[1]
        view_of_robot = cv2.resize(self._steady.update(camera), PANEL, interpolation=cv2.INTER_CUBIC)
        draw_estimates(np.asarray(view_of_robot), state, zoom)
        body[:, : PANEL[0]] = view_of_robot
        body[:, PANEL[0] :] = cv2.resize(view, PANEL)
        paste(body, label("camera: what the robot sees", 16, TEXT), 10, PANEL[1] - 30, shade=True)
        paste(body, label("the world: not shown to the robot", 16, TEXT), PANEL[0] + 10, PANEL[1] - 30, shade=True)
        self._top(frame[:TOP_PX], state, time_s)
        _captions(frame[TOP_PX + PANEL[1] :], state)
        done = round(SIZE[0] * min(1.0, time_s / end_s)) if end_s > 0 else 0
        frame[-4:, :done] = ACCENT
        return frame

    def _top(self, bar: Image, state: RobotState, time_s: float) -> None:
        paste(bar, label(self._title, 20, TEXT, bold=True), 16, 12)
        reached = len(STAGES) if state.stage == "done" else STAGES.index(state.stage) if state.stage in STAGES else -1
        x = 534
        for index, stage in enumerate(STAGES):
            now = index == reached
            colour = ACCENT if now else TEXT if index < reached else FAINT
            text = f"{'✓' if index < reached else index + 1} {stage}"
            sprite = label(text, 20, colour, bold=now)
            paste(bar, sprite, x, 12)
            x += sprite.shape[1] + 35
        clock = label(f"{time_s:6.1f} s   {self._factor:g}× speed", 19, FAINT)
        paste(bar, clock, SIZE[0] - clock.shape[1] - 16, 13)


class SteadyImage:
    """Holds what does not change, so that the sensor's noise does not fill the video file."""

    CHANGE = 9  # of 255, in any colour, after smoothing

    def __init__(self) -> None:
        self._held: Image | None = None
        self._seed = np.ones((3, 3), dtype=np.uint8)
        self._around = np.ones((9, 9), dtype=np.uint8)

    def update(self, image: Image) -> Image:
        """The image with new content only where it differs from what is held."""
        smooth = np.asarray(cv2.GaussianBlur(image, (5, 5), 0), dtype=np.uint8)
        if self._held is None:
            self._held = smooth
        red, green, blue = cv2.split(cv2.absdiff(smooth, self._held))
        _, changed = cv2.threshold(cv2.max(cv2.max(red, green), blue), self.CHANGE, 255, cv2.THRESH_BINARY)
        changed = cv2.dilate(cv2.morphologyEx(changed, cv2.MORPH_OPEN, self._seed), self._around)
        cv2.copyTo(smooth, changed, self._held)
        return self._held.copy()


def draw_estimates(image: Image, state: RobotState, zoom: float) -> None:
    """Tracked objects, hand, goal and estimated openings, drawn into the camera's image, enlarged by `zoom`."""
    if state.homography is not None:
        for name, opening in state.rules.items():
            at = _pixel(state.homography, opening, zoom)
            cv2.circle(image, at, 17, COLOURS.get(name, TEXT), 2, cv2.LINE_AA)
            cv2.drawMarker(image, at, COLOURS.get(name, TEXT), cv2.MARKER_CROSS, 11, 2, cv2.LINE_AA)
        if state.goal is not None and state.goal.fetches:
            start = _pixel(state.homography, tuple(state.goal.source[:2]), zoom)
            end = _pixel(state.homography, tuple(state.goal.target[:2]), zoom)
            cv2.arrowedLine(image, start, end, ACCENT, 3, cv2.LINE_AA, tipLength=0.08)
    for item in state.tracked.objects if state.tracked is not None else ():
        if item.kind == TrackedObject.KIND_HAND:
            _draw_hand(image, item, zoom)
        else:
            _draw_object(image, item, state, zoom)


def _draw_hand(image: Image, item: Any, zoom: float) -> None:
    corners = (zoom * np.array([(p.u_px, p.v_px) for p in item.outline])).round().astype(np.int32).reshape(-1, 1, 2)
    if len(corners):
        cv2.polylines(image, [corners], True, HAND, 2, cv2.LINE_AA)
    cv2.circle(image, (round(zoom * item.u_px), round(zoom * item.v_px)), 4, HAND, -1, cv2.LINE_AA)


def _draw_object(image: Image, item: Any, state: RobotState, zoom: float) -> None:
    colour = COLOURS.get(item.name, TEXT)
    left, top = round(zoom * item.left_px) - 3, round(zoom * item.top_px) - 3
    right, bottom = left + round(zoom * item.width_px) + 6, top + round(zoom * item.height_px) + 6
    cv2.rectangle(image, (left, top), (right, bottom), colour, 2, cv2.LINE_AA)
    gesture = state.gesture
    fresh = gesture is not None and gesture.object == item.name
    text = state.seeing if fresh else item.name
    sprite = label(text, 16, colour, bold=fresh)
    paste(image, sprite, left, max(0, top - sprite.shape[0] - 2), shade=True)


def _captions(panel: Image, state: RobotState) -> None:
    if state.detail:
        paste(panel, label(f"“{_shortened(state.detail, 96)}”", 23, TEXT, bold=True), 18, 24)
    paste(panel, label("estimates", 17, FAINT), 18, 81)
    x = 118
    for name, (u, v) in state.rules.items():
        sprite = label(f"{name} → ({u * 100:.1f}, {v * 100:.1f}) cm".replace("-", "−"), 19, COLOURS.get(name, TEXT))
        paste(panel, sprite, x, 79)
        x += sprite.shape[1] + 35
    if not state.rules:
        paste(panel, label("nothing yet", 19, FAINT), x, 79)
    paste(panel, label("does", 17, FAINT), 18, 132)
    paste(panel, label(state.doing or "waits", 19, ACCENT if state.doing else FAINT), 118, 130)
    paste(panel, label("detects", 17, FAINT), 658, 132)
    paste(panel, label(state.seeing or "–", 19, TEXT if state.seeing else FAINT), 746, 130)


def _shortened(text: str, length: int) -> str:
    return text if len(text) <= length else text[: length - 1] + "…"


def _pixel(homography: Any, position: tuple[float, float], zoom: float) -> tuple[int, int]:
    u, v = homography.image_from_plane(*position)
    return round(float(np.clip(zoom * u, -999, 9999))), round(float(np.clip(zoom * v, -999, 9999)))


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
