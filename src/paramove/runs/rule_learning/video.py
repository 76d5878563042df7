"""The demo video of a run: the camera with the robot's estimates, the world next to it, captions around."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from operator import attrgetter
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from rich.console import Console
from rich.progress import track

from paramove.bus import topics
from paramove.cameras import decode
from paramove.documents import Image, replacing
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.rule_pb2 import ApplicationStage
from paramove.msgs.tracked_objects_pb2 import TrackedObject
from paramove.objects import PlaneHomography
from paramove.runs.recorded_run import RecordedRun
from paramove.runs.relocations import Relocation
from paramove.runs.rule_learning.summary import RunEvaluation
from paramove.runs.video import (
    ACCENT,
    FAINT,
    FRAMES_PER_S,
    LINGER_FRAMES,
    PANEL,
    SIZE,
    TEXT,
    TOP_PX,
    Colour,
    VideoWriter,
    label,
    paste,
    shortened,
    side_by_side,
    views_with,
)

COLOURS: dict[str, Colour] = {"yellow": (255, 205, 40), "green": (70, 205, 95), "blue": (95, 140, 255)}
HAND: Colour = (255, 80, 190)
STAGES = ("calibrate", "learn", "apply")
CAMERA, CAMERA_HZ = topics.CAMERA_IMAGE.name, 15.0
LONG_RUN_S = 400.0
"""A longer run is displayed four times as fast as it was, others twice."""
GESTURE_DISPLAYED_S = 1.5
_TEXTS = {
    Gesture.KIND_APPEARED: "appeared",
    Gesture.KIND_MOVED: "moves",
    Gesture.KIND_RESTED: "rests",
    Gesture.KIND_VANISHED: "vanished",
    Gesture.KIND_POINTED_AT: "pointed at",
}


def write_video(evaluation: RunEvaluation, console: Console) -> Path | None:
    """Write `demo.mp4` into the run's folder, with a progress bar; None if the view was not recorded (headless).

    Raises:
        VideoError: There is no encoder.
    """
    run = evaluation.run
    views = run.recording("truth").read({topics.TRUTH_VIEW.name})
    number = sum(view.log_ns * 1e-9 <= run.end_s for view in views)
    if number == 0:
        return None
    factor = 2 if run.end_s <= LONG_RUN_S else 4
    every = round(factor * CAMERA_HZ / FRAMES_PER_S)
    title, steady = run.title("rule learning"), SteadyImage()
    path = run.folder / "demo.mp4"
    with replacing(path) as unfinished, VideoWriter(unfinished) as writer:
        pairs = views_with(run, {CAMERA}, attrgetter("log_ns"))
        displayed = ((view, latest[CAMERA]) for view, latest in islice(pairs, 0, None, every) if CAMERA in latest)
        count = len(range(0, number, every))
        picture = np.zeros((SIZE[1], SIZE[0], 3), dtype=np.uint8)
        for view, image in track(islice(displayed, count), "video", count, console=console, transient=True):
            time_s = view.log_ns * 1e-9
            camera = steady.update(_rgb(image.message))
            state = state_at(run, evaluation.relocations, time_s)
            picture = drawn(camera, _rgb(view.message), state, title, time_s, factor)
            done = round(SIZE[0] * min(1.0, time_s / run.end_s)) if run.end_s > 0 else 0
            picture[-4:, :done] = ACCENT
            writer.write(picture)
        writer.write(picture, LINGER_FRAMES)
    return path


@dataclass(frozen=True, eq=False)
class RobotState:
    """The robot's state at one time.

    Attributes:
        stage: "calibrate", "learn", "apply", "done" or "".
        detail: Text of the last speech message.
        rules: Object -> estimated opening (x, y), m.
        goal: The goal under way, else None; `phase` of its motion.
        gesture: The latest gesture if it is fresh, else None.
        tracked: The latest `TrackedObjects`, else None.
        homography: The robot's calibration, once it has one.
    """

    stage: str
    detail: str
    rules: dict[str, tuple[float, float]]
    goal: Relocation | None
    phase: str
    gesture: Any
    tracked: Any
    homography: PlaneHomography | None

    @property
    def doing(self) -> str:
        """The goal as text."""
        if self.goal is None:
            return ""
        name = f" {self.goal.goal.object}" if self.goal.goal.object else ""
        attempt = f", attempt {self.goal.goal.attempt}" if self.goal.goal.attempt > 1 else ""
        return f"{self.goal.kind.replace('_', ' ')}{name}{attempt}{': ' + self.phase if self.phase else ''}"

    @property
    def seeing(self) -> str:
        """The gesture as text."""
        if self.gesture is None or self.gesture.kind not in _TEXTS:
            return ""
        return f"{self.gesture.object or 'hand'} {_TEXTS[self.gesture.kind]}"


def state_at(run: RecordedRun, relocations: Sequence[Relocation], time_s: float) -> RobotState:
    """The robot's state at a time of a run, s, by the latest of everything; `relocations` are the run's goals."""
    stage, speech = run.latest(topics.APPLICATION_STAGE, time_s), run.latest(topics.SPEECH, time_s)
    rules, plane = run.latest(topics.RULES, time_s), run.latest(topics.CALIBRATION_PLANE, time_s)
    gesture, status = run.latest(topics.GESTURES, time_s), run.latest(topics.RELOCATION_STATUS, time_s)
    # What is drawn onto an image belongs to the time at which the image was taken.
    tracked = run.latest(topics.OBJECTS_TRACKED, time_s, "log_ns")
    goal = next((g for g in relocations if g.begun_s <= time_s < g.ended_s and g.result != "refused"), None)
    of_goal = goal is not None and status is not None and status.message.goal_id == goal.goal.id
    fresh = gesture is not None and time_s - gesture.publish_ns * 1e-9 < GESTURE_DISPLAYED_S
    return RobotState(
        stage=ApplicationStage.Stage.Name(stage.message.stage).removeprefix("STAGE_").lower() if stage else "",
        detail=speech.message.text if speech is not None else "",
        rules={rule.object: (rule.x, rule.y) for rule in rules.message.rules} if rules is not None else {},
        goal=goal,
        phase=status.message.phase if of_goal and status is not None else "",
        gesture=gesture.message if fresh and gesture is not None else None,
        tracked=tracked.message if tracked is not None else None,
        homography=PlaneHomography.from_message(plane.message) if plane is not None else None,
    )


def _rgb(message: Any) -> Image:
    return np.asarray(cv2.cvtColor(decode(message), cv2.COLOR_BGR2RGB), dtype=np.uint8)


def drawn(camera: Image, view: Image, state: RobotState, title: str, time_s: float, factor: float) -> Image:
    """A picture from the two images, RGB, and the robot's state."""
    zoom = PANEL[0] / camera.shape[1]
    view_of_robot = np.asarray(cv2.resize(camera, PANEL, interpolation=cv2.INTER_CUBIC))
    draw_estimates(view_of_robot, state, zoom)
    picture = side_by_side(view_of_robot, "camera: what the robot sees", view, title, time_s, factor)
    _stages(picture[:TOP_PX], state)
    _captions(picture[TOP_PX + PANEL[1] :], state)
    return picture


def _stages(bar: Image, state: RobotState) -> None:
    reached = len(STAGES) if state.stage == "done" else STAGES.index(state.stage) if state.stage in STAGES else -1
    x = 534
    for index, stage in enumerate(STAGES):
        now = index == reached
        colour = ACCENT if now else TEXT if index < reached else FAINT
        text = f"{'✓' if index < reached else index + 1} {stage}"
        sprite = label(text, 20, colour, bold=now)
        paste(bar, sprite, x, 12)
        x += sprite.shape[1] + 35


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
        paste(panel, label(shortened(state.detail, 96), 23, TEXT, bold=True), 18, 24)
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


def _pixel(homography: Any, position: tuple[float, float], zoom: float) -> tuple[int, int]:
    u, v = homography.image_from_plane(*position)
    return round(float(np.clip(zoom * u, -999, 9999))), round(float(np.clip(zoom * v, -999, 9999)))
