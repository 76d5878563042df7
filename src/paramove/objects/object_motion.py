"""The state of one object (unseen, resting or moving) and its transitions (thesis 5.2.6, step 3).

All thresholds are in px of a 480 x 360 image (about 1.4 mm each) and in s of observation.
"""

from __future__ import annotations

import enum
from collections import deque
from dataclasses import dataclass

from paramove.msgs.gesture_pb2 import Gesture
from paramove.objects.full_size import FullSize
from paramove.objects.sinking import Sample, last_position


@dataclass(frozen=True)
class MotionThresholds:
    """When an object counts as moving, resting or gone.

    Attributes:
        moved_px: Opposite borders both displaced this far: 4 mm, ten times their scatter.
        moved_s: ... for this long: three frames, so that a flicker does not count.
        rest_px: All four borders stay within this range ...
        rest_s: ... for this long.
        vanish_s: A moving object not detected for this long is gone.
        hidden_s: A resting object not detected for this long is gone; longer, as the arm probably occludes it.
        timeout_s: Maximum waiting time for a hand that covers the object to leave.
        clear_share: From this visible fraction on an object is fully visible.
        part_share: Below this fraction it does not count as resting: it has partly sunk, or is occluded.
        remnant_share: Below this fraction a moving object counts as undetected: its top may stay visible in an opening.
        clear_view_s: Maximum waiting time for a clear view of an object that has come to rest.
        stands_s: An object that rests for so long stands on the table. A gripper that holds one may pause for a second.
    """

    moved_px: float = 3.0
    moved_s: float = 0.18
    rest_px: float = 2.0
    rest_s: float = 0.5
    vanish_s: float = 0.5
    hidden_s: float = 2.0
    timeout_s: float = 5.0
    clear_share: float = 0.9
    part_share: float = 0.6
    remnant_share: float = 0.35
    clear_view_s: float = 2.0
    stands_s: float = 1.7


class State(enum.Enum):
    UNSEEN = "unseen"
    RESTING = "resting"
    MOVING = "moving"


@dataclass(frozen=True)
class Transition:
    """A transition of one object; (u, v) px.

    `in_motion`: it vanished while it moved. `placed`: False if its position is unknown.
    """

    kind: Gesture.Kind
    u_px: float
    v_px: float
    confidence: float
    in_motion: bool = False
    placed: bool = True


class ObjectMotion:
    """Follows one object from sample to sample."""

    HISTORY_S = 3.0

    def __init__(self, name: str, full_size: FullSize, thresholds: MotionThresholds) -> None:
        self.name = name
        self.state = State.UNSEEN
        self.position: Sample | None = None
        """The best view of the object at rest."""
        self.blind = False
        """There was a gap in the images after the object was last clearly visible."""
        self.stands = False
        """It has rested for so long that no gripper holds it up, as of the latest call of `is_best_view`."""
        self._full_size = full_size
        self._limits = thresholds
        self._history: deque[Sample] = deque()
        self._displaced_since: float | None = None
        self._still_since: float | None = None
        self._reported_area_px = 0.0
        self._clearly_visible_s = 0.0
        self._rests_since_s = 0.0
        self._best_visible = 0.0

    def update(self, sample: Sample | None, now_s: float, hand_near: bool) -> list[Transition]:
        """Processes one frame: the object's sample in it or None.

        `hand_near`: the hand's box touches the object's last known position.
        """
        if sample is not None:
            self._history.append(sample)
        while self._history and self._history[0].time_s < now_s - self.HISTORY_S - self._limits.timeout_s:
            self._history.popleft()
        remnant = sample is not None and self.visible_fraction(sample) < self._limits.remnant_share
        if sample is not None and not remnant:
            self._clearly_visible_s, self.blind = sample.time_s, False
        if sample is None or (remnant and self.state is State.MOVING):
            return self._unseen(now_s, hand_near)
        if self.state is State.RESTING:
            return self._while_resting(sample)
        return self._while_not_resting(sample, now_s, hand_near)

    def visible_fraction(self, sample: Sample) -> float:
        """Visible fraction of the object's full area, 0 to 1."""
        return self._full_size.visible_fraction(self.name, sample.u_px, sample.v_px, sample.area_px)

    def is_best_view(self, sample: Sample) -> bool:
        """Whether nothing hides it in this sample, less than ever since it came to rest, or has stood."""
        if self.state is not State.RESTING:
            self.stands, self._best_visible = False, 0.0
            return False
        stands = sample.time_s - self._rests_since_s >= self._limits.stands_s
        if stands != self.stands:
            self.stands, self._best_visible = stands, 0.0
        visible = self.visible_fraction(sample)
        if visible < max(self._limits.clear_share, self._best_visible):
            return False
        self._best_visible = visible
        return True

    def _unseen(self, now_s: float, hand_near: bool) -> list[Transition]:
        self._displaced_since = self._still_since = None
        if self.state is State.UNSEEN or not self._history:
            return []
        undetected_s = now_s - self._clearly_visible_s
        needed_s = self._limits.vanish_s if self.state is State.MOVING else self._limits.hidden_s
        if undetected_s < needed_s or (hand_near and undetected_s < self._limits.timeout_s):
            return []
        return [self._vanish()]

    def _vanish(self) -> Transition:
        moving = self.state is State.MOVING
        u, v = last_position(self.name, list(self._history), self._full_size)
        if not moving and self.position is not None:
            u, v = self.position.u_px, self.position.v_px
        unobserved = self.blind and moving  # it moved on during a gap in the images
        self.state, self.position = State.UNSEEN, None
        self._history.clear()
        confidence = 0.2 if unobserved else 0.7 if moving else 1.0
        return Transition(Gesture.KIND_VANISHED, u, v, confidence, moving, not unobserved)

    def _while_resting(self, sample: Sample) -> list[Transition]:
        assert self.position is not None
        if sample.displacement_px(self.position) >= self._limits.moved_px:
            since = self._displaced_since if self._displaced_since is not None else sample.time_s
            self._displaced_since = since
            if sample.time_s - since + 1e-6 < self._limits.moved_s:
                return []
            return [self._begin_to_move(self.position)]
        self._displaced_since = None
        return self._better_view(sample)

    def _begin_to_move(self, start: Sample) -> Transition:
        self.state, self._displaced_since, self._still_since = State.MOVING, None, None
        return Transition(Gesture.KIND_MOVED, start.u_px, start.v_px, self.visible_fraction(start))

    def _better_view(self, sample: Sample) -> list[Transition]:
        """A hand or arm that hid a part has gone: reports the better position again."""
        still = self._still_samples(sample.time_s)
        if len(still) < 2 or still[-1].time_s - still[0].time_s < 0.7 * self._limits.rest_s:
            return []
        best = Sample.median(still)
        assert self.position is not None
        self._teach(best)
        if best.area_px > self.position.area_px:
            self.position = best
        if best.area_px > 1.08 * self._reported_area_px and self.visible_fraction(best) >= self._limits.clear_share:
            self._reported_area_px = best.area_px
            return [Transition(Gesture.KIND_RESTED, best.u_px, best.v_px, self.visible_fraction(best))]
        return []

    def _teach(self, position: Sample) -> None:
        """Adds a sample at rest to the known full sizes."""
        stands = position.time_s - self._rests_since_s >= self._limits.stands_s
        self._full_size.learn(self.name, position.u_px, position.v_px, position.size, stands=stands)

    def _still_samples(self, now_s: float) -> list[Sample]:
        """The samples of the last `rest_s`, or [] if any border moved."""
        recent = [s for s in self._history if s.time_s > now_s - self._limits.rest_s - 1e-6]
        latest = recent[-1]
        return recent if all(s.border_change_px(latest) <= self._limits.rest_px for s in recent) else []

    def _while_not_resting(self, sample: Sample, now_s: float, hand_near: bool) -> list[Transition]:
        still = self._still_samples(now_s)
        if not still or len(self._history) < 2:
            self._still_since = None
            return self._detected_in_motion(sample, now_s)
        if self._still_since is None:
            self._still_since = still[0].time_s
        if now_s - self._still_since + 1e-6 < self._limits.rest_s:
            return []
        return self._come_to_rest(Sample.median(still), now_s - self._still_since, hand_near)

    def _detected_in_motion(self, sample: Sample, now_s: float) -> list[Transition]:
        if self.state is State.MOVING:
            return []
        recent = [s for s in self._history if s.time_s > now_s - self._limits.rest_s]
        first = recent[0]
        if now_s - first.time_s < self._limits.moved_s or sample.displacement_px(first) < 2 * self._limits.moved_px:
            return []
        if self.visible_fraction(sample) < self._limits.part_share / 2:
            return []
        return [self._begin_to_move(first)]

    def _come_to_rest(self, position: Sample, still_s: float, hand_near: bool) -> list[Transition]:
        visible = self.visible_fraction(position)
        waited = still_s >= (self._limits.timeout_s if hand_near else self._limits.clear_view_s)
        if visible < self._limits.clear_share and not waited:
            return []
        if visible < self._limits.part_share:
            if not self._full_size.was_exchanged_back(self.name, position.u_px, position.v_px, position.size):
                return [self._vanish()] if self.state is State.MOVING else []
            visible = self.visible_fraction(position)
        kind = Gesture.KIND_RESTED if self.state is State.MOVING else Gesture.KIND_APPEARED
        self.state, self.position, self._reported_area_px = State.RESTING, position, position.area_px
        self._still_since = None
        self._rests_since_s = position.time_s - still_s
        self._teach(position)
        return [Transition(kind, position.u_px, position.v_px, visible)]
