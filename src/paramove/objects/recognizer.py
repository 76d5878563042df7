"""From tracked objects to gestures: appeared, moved, rested, vanished, pointed at (thesis 5.2.6, steps 3 and 4)."""

from __future__ import annotations

import contextlib

import numpy as np

from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.plane_calibration_pb2 import PlaneCalibration
from paramove.msgs.tracked_objects_pb2 import TrackedObject, TrackedObjects
from paramove.objects.full_size import FullSize
from paramove.objects.homography import PlaneHomography
from paramove.objects.object_motion import MotionThresholds, ObjectMotion, State, Transition
from paramove.objects.object_shape import ObjectShape, object_shape
from paramove.objects.openings import OpeningTracker
from paramove.objects.pointing import Pointing, PointingThresholds
from paramove.objects.sinking import Sample

HAND_SEEN_S = 0.18
HAND_GONE_S = 0.5
BLIND_S = 0.35
"""Motion between images farther apart was not observed. Any loaded machine loses a few images."""
LONGEST_STEP_S = 0.2
"""Maximum observation time that one image counts for."""
MAX_PX = 1e6
LARGER = 1.1
"""Of width times height of a standing object, from which it is held up, nearer to the camera."""
HEIGHTS_DIFFER = 0.007
"""m; less can be the error of two heights that are measured in an image."""
CLOCK_BACK_S = 5.0
"""An image older than this is not delayed: the clock, or an image's time, was wrong."""


class Recognizer:
    """Keeps a small state per object and reports its changes, in the order of names, objects before the hand.

    All durations are observation times: they do not advance without images (the camera restarts, it is dark).
    """

    def __init__(self, motion: MotionThresholds | None = None, pointing: PointingThresholds | None = None) -> None:
        self._thresholds = motion or MotionThresholds()
        self._full_size = FullSize()
        self._openings = OpeningTracker()
        self._objects: dict[str, ObjectMotion] = {}
        self._last_detected: dict[str, Sample] = {}
        self._pointing = Pointing(pointing or PointingThresholds())
        self._hand = _HandPresence()
        self._calibrated: tuple[PlaneCalibration, PlaneHomography] | None = None
        self._plane_height = 0.0
        self._outlines: dict[str, list[tuple[float, float]]] = {}
        self._standing: dict[str, list[tuple[float, float]]] = {}
        self._latest_s: float | None = None
        self._watched_s = 0.0

    def update(self, tracked: TrackedObjects, calibration: PlaneCalibration | None = None) -> list[Gesture]:
        """The gestures that this image completes. An image not newer than the one before is ignored.

        Raises HomographyError if the calibration holds no homography.
        """
        step_s = self._step_s(tracked.captured.ToNanoseconds() * 1e-9)
        if step_s <= 0.0:
            return []
        if step_s > BLIND_S:
            for motion in self._objects.values():
                motion.blind = True
        self._watched_s += min(step_s, LONGEST_STEP_S)
        now_s = self._watched_s
        homography = self._homography(calibration)
        if not all(_in_some_image(one) for one in tracked.objects):
            usable = [one for one in tracked.objects if _in_some_image(one)]
            tracked = TrackedObjects(captured=tracked.captured, objects=usable)
        self._openings.update(tracked.openings)
        hand = next((one for one in tracked.objects if one.kind == TrackedObject.KIND_HAND), None)
        transitions = self._follow_objects(tracked, hand, now_s)
        transitions += [("", transition) for transition in self._hand.update(hand, now_s)]
        transitions += self._pointed_at(hand, now_s, homography)
        return [self._gesture(tracked, name, transition, homography) for name, transition in transitions]

    def _step_s(self, captured_s: float) -> float:
        """Time since the image before; 0 for one that is not newer."""
        latest_s, self._latest_s = self._latest_s, captured_s
        if latest_s is None:
            return LONGEST_STEP_S
        if latest_s - CLOCK_BACK_S < captured_s <= latest_s:
            self._latest_s = latest_s
            return 0.0
        return abs(captured_s - latest_s)

    def _follow_objects(
        self, tracked: TrackedObjects, hand: TrackedObject | None, now_s: float
    ) -> list[tuple[str, Transition]]:
        detected = {s.name: Sample.of(s, now_s) for s in tracked.objects if s.kind == TrackedObject.KIND_OBJECT}
        self._last_detected |= detected
        transitions: list[tuple[str, Transition]] = []
        for name in sorted(self._last_detected):
            if name not in self._objects:
                self._objects[name] = ObjectMotion(name, self._full_size, self._thresholds)
            near = hand is not None and _touch(hand, self._last_detected[name])
            transitions += [
                (name, transition) for transition in self._objects[name].update(detected.get(name), now_s, near)
            ]
        for one in tracked.objects:
            if one.name in detected and self._objects[one.name].is_best_view(detected[one.name]):
                self._outlines[one.name] = outline = [(point.u_px, point.v_px) for point in one.outline]
                if self._objects[one.name].stands:
                    self._standing[one.name] = outline
        return transitions

    def _pointed_at(
        self, hand: TrackedObject | None, now_s: float, homography: PlaneHomography | None
    ) -> list[tuple[str, Transition]]:
        resting = {
            name: motion.position
            for name, motion in self._objects.items()
            if motion.state is State.RESTING and motion.position is not None
        }
        any_moving = any(motion.state is State.MOVING for motion in self._objects.values())
        name = self._pointing.update(now_s, hand, resting, any_moving, homography)
        if name is None:
            return []
        position = resting[name]
        visible = self._objects[name].visible_fraction(position)
        return [(name, Transition(Gesture.KIND_POINTED_AT, position.u_px, position.v_px, visible))]

    def _homography(self, calibration: PlaneCalibration | None) -> PlaneHomography | None:
        if calibration is None:
            return None
        if self._calibrated is None or self._calibrated[0] != calibration:
            homography = PlaneHomography.from_message(calibration)
            self._calibrated = (calibration, homography)
            shape = self._shape_of(homography.object_name, homography)
            self._plane_height = 0.0 if shape is None else shape.height
        return self._calibrated[1]

    def _gesture(
        self, tracked: TrackedObjects, name: str, transition: Transition, homography: PlaneHomography | None
    ) -> Gesture:
        gesture = Gesture(
            captured=tracked.captured,
            kind=transition.kind,
            object=name,
            u_px=transition.u_px,
            v_px=transition.v_px,
            confidence=transition.confidence,
        )
        if homography is not None and name and transition.placed:
            if transition.in_motion:
                self._put_over_opening(gesture, homography)
            gesture.located, gesture.frame = True, homography.plane_frame
            depth, shape = 0.0, self._shape_of(name, homography)
            if shape is not None:
                gesture.width_m, gesture.height_m, gesture.length_m = shape.width, shape.height, shape.length
                if shape.turn is not None:
                    gesture.turn_rad = shape.turn
                lower = (self._plane_height or shape.height) - shape.height
                depth = lower / 2 if abs(lower) > HEIGHTS_DIFFER else 0.0
            gesture.x, gesture.y = homography.below_plane(gesture.u_px, gesture.v_px, depth)
        gesture.twin = any(one.twin for one in tracked.objects if one.name == name)
        return gesture

    def _shape_of(self, name: str, homography: PlaneHomography) -> ObjectShape | None:
        """As it looked in the clearest view of its last rest; standing, if it may have been held up then."""
        with contextlib.suppress(ValueError):  # on the plane's horizon
            outline, before = self._outlines.get(name, []), self._standing.get(name, [])
            latest = object_shape(np.array(outline), homography)
            standing = latest if before is outline else object_shape(np.array(before), homography)
            held_up = latest is not None and standing is not None and latest.face > LARGER * standing.face
            return standing if held_up else latest
        return None

    def _put_over_opening(self, gesture: Gesture, homography: PlaneHomography) -> None:
        """Moves a gesture over an opening to where an object with its foot in the opening's middle would be detected.

        The homography gives the foreshortening of a circle on the plane, and the object's own image the distance from
        its middle down to its foot; together they give the camera's direction.
        """
        full = self._full_size.expected(gesture.object, gesture.u_px, gesture.v_px)
        if full is None:
            return
        du, dv = full.foot_px(homography.foreshortening(gesture.u_px, gesture.v_px))
        opening = self._openings.at(gesture.u_px + du, gesture.v_px + dv)
        if opening is not None:
            gesture.u_px, gesture.v_px, gesture.confidence = opening[0] - du, opening[1] - dv, 1.0


class _HandPresence:
    """Reports once that the hand has appeared and once that it has gone."""

    def __init__(self) -> None:
        self._present = False
        self._change_s: float | None = None
        self._position = (0.0, 0.0)

    def update(self, hand: TrackedObject | None, now_s: float) -> list[Transition]:
        if hand is not None:
            self._position = (hand.u_px, hand.v_px)
        if (hand is not None) == self._present:
            self._change_s = None
            return []
        self._change_s = now_s if self._change_s is None else self._change_s
        if now_s - self._change_s + 1e-6 < (HAND_GONE_S if self._present else HAND_SEEN_S):
            return []
        self._present, self._change_s = not self._present, None
        kind = Gesture.KIND_HAND_APPEARED if self._present else Gesture.KIND_HAND_VANISHED
        return [Transition(kind, *self._position, confidence=1.0)]


def _in_some_image(tracked: TrackedObject) -> bool:
    """Whether its numbers are finite and can be pixels."""
    box = (tracked.left_px, tracked.top_px, tracked.width_px, tracked.height_px)
    outline = (number for point in tracked.outline for number in (point.u_px, point.v_px))
    numbers = (tracked.u_px, tracked.v_px, tracked.area_px, *box, *outline)
    return all(abs(number) < MAX_PX for number in numbers)  # NaN is not below


def _touch(hand: TrackedObject, position: Sample) -> bool:
    """Whether the hand's box, widened by half an object, overlaps the object's."""
    margin = 0.5 * position.width_px
    return (
        hand.left_px - margin < position.right_px
        and hand.left_px + hand.width_px + margin > position.left_px
        and hand.top_px - margin < position.bottom_px
        and hand.top_px + hand.height_px + margin > position.top_px
    )
