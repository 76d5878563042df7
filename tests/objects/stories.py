"""Short stories in the rendered tool-box world, frame by frame, as the colour tracker sees them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.plane_calibration_pb2 import PlaneCalibration
from paramove.msgs.tracked_objects_pb2 import TrackedObjects
from paramove.objects.colour_tracker import ColourTracker
from paramove.objects.homography import PlaneHomography
from paramove.objects.recognizer import Recognizer
from tests.objects.scene import CYLINDER_HEIGHT, WORKING_AREA, Scene

RIM_RADIUS = 0.020  # of the rendered opening, without chamfer
PERIOD_NS = 66_666_667
OPENING = (0.155, -0.02)
HAND_ABOVE = 0.052  # the hand's centre above that of a cylinder held at its upper end


class Story:
    """Steps a scene and hands each image to tracker and recognizer."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.tracker = ColourTracker()
        self.recognizer = Recognizer()
        self.calibration: PlaneCalibration | None = None
        self.gestures: list[Gesture] = []
        self.tick = 0

    def step(self, ticks: int = 1) -> TrackedObjects:
        for _ in range(ticks):
            self.tick += 1
            tracked = self.tracker.update(self.scene.image(), self.tick * PERIOD_NS)
            self.gestures += self.recognizer.update(tracked, self.calibration)
        return tracked

    def calibrate(self, name: str = "yellow") -> PlaneHomography:
        """What the robot does in step 2: put one object at the corners of the working area."""
        points = []
        for x, y in WORKING_AREA:
            self.scene.stand(name, x, y)
            seen = next(found for found in self.step().objects if found.name == name)
            points.append((seen.u_px, seen.v_px))
        self.scene.hide(name)
        homography = PlaneHomography.fit(points, WORKING_AREA)
        self.calibration = homography.to_message()
        self.tracker, self.recognizer, self.gestures = ColourTracker(), Recognizer(), []
        return homography

    def kinds(self, name: str) -> list[str]:
        return [Gesture.Kind.Name(g.kind).removeprefix("KIND_") for g in self.gestures if g.object == name]

    def carry(self, name: str, path: Iterator[np.ndarray], yaw: float) -> None:
        """Move object and hand along the object's centres; the hand leaves the object when it is at the plane."""
        for centre in path:
            self.scene.put(name, tuple(centre))
            hand = centre + np.array([0.02 * np.cos(yaw), 0.02 * np.sin(yaw), HAND_ABOVE - 0.015])
            self.scene.put("hand", (hand[0], hand[1], max(hand[2], 0.02)), yaw)
            self.step()


def segment(start: tuple[float, ...], end: tuple[float, ...], ticks: int) -> Iterator[np.ndarray]:
    """Smooth motion from rest to rest."""
    for tick in range(1, ticks + 1):
        tau = tick / ticks
        yield np.array(start) + (tau**3 * (10 - 15 * tau + 6 * tau**2)) * (np.array(end) - np.array(start))


def show_rule(story: Story, name: str, start: tuple[float, float], lowering_ticks: int, drop: bool, yaw: float) -> None:
    """The instructor takes a standing object and puts it into the opening."""
    x, y = OPENING
    middle = CYLINDER_HEIGHT / 2
    story.scene.stand(name, *start)
    story.step(14)
    story.carry(name, segment((*start, middle), (*start, 0.07), 8), yaw)
    story.carry(name, segment((*start, 0.07), (x, y, 0.07), 18), yaw)
    if drop:
        story.carry(name, segment((x, y, 0.07), (x, y, middle), lowering_ticks), yaw)
        for z in (middle - 0.011, middle - 0.043):  # free fall, 1/15 s and 2/15 s
            story.scene.put(name, (x, y, z))
            story.step()
    else:
        story.carry(name, segment((x, y, 0.07), (x, y, -0.045), lowering_ticks), yaw)
    story.scene.put(name, (x, y, -0.045))
    for _ in range(14):
        story.scene.put("hand", (0.5, 0.3, 0.1), yaw)
        story.step()
    story.scene.hide("hand")
    story.step(4)
