"""What one object does: unseen, resting or moving, and the moments between (thesis 5.2.6, step 3).

All thresholds are in px of a 480 x 360 image (about 1.4 mm each) and in s of watching.
"""

from __future__ import annotations

import enum
from collections import deque
from dataclasses import dataclass

from paramove.msgs.gesture_pb2 import Gesture
from paramove.objects.full_size import FullSize
from paramove.objects.sinking import Sample, last_place


@dataclass(frozen=True)
class MotionThresholds:
    """When an object counts as moving, resting or gone.

    Attributes:
        moved_px: Opposite borders both displaced this far: 4 mm, ten times their scatter.
        moved_s: ... for this long: three frames, so that a flicker is nothing.
        rest_px: All four borders stay within this range ...
        rest_s: ... for this long.
        vanish_s: A moving object not seen for this long is gone.
        hidden_s: A resting object not seen for this long is gone; longer, as it is rather hidden by the arm.
        timeout_s: Waiting for a hand that covers the object to leave never takes longer.
        clear_share: From this visible share on an object is seen in full.
        part_share: Below this share it is not seen to rest: it is sunk for a good part, or hidden.
        remnant_share: Below this share a moving object counts as not seen: its top may stay visible in an opening.
        clear_view_s: Waiting for a clear view of an object that has come to rest.
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


class State(enum.Enum):
    UNSEEN = "unseen"
    RESTING = "resting"
    MOVING = "moving"


@dataclass(frozen=True)
class Happening:
    """A moment of one object; (u, v) px.

    `in_motion`: it vanished while it moved. `placed`: False if nobody saw where it happened.
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
        self.place: Sample | None = None
        """Where the object rests, at its best view."""
        self.blind = False
        """There was a time without images after the object was last seen well."""
        self._full_size = full_size
        self._limits = thresholds
        self._history: deque[Sample] = deque()
        self._displaced_since: float | None = None
        self._still_since: float | None = None
        self._told_area_px = 0.0
        self._well_seen_s = 0.0

    def update(self, sample: Sample | None, now_s: float, hand_near: bool) -> list[Happening]:
        """Take in one frame: the object's sample in it or None.

        `hand_near`: the hand's box touches the place where the object was last seen.
        """
        if sample is not None:
            self._history.append(sample)
        while self._history and self._history[0].time_s < now_s - self.HISTORY_S - self._limits.timeout_s:
            self._history.popleft()
        remnant = sample is not None and self.share(sample) < self._limits.remnant_share
        if sample is not None and not remnant:
            self._well_seen_s, self.blind = sample.time_s, False
        if sample is None or (remnant and self.state is State.MOVING):
            return self._unseen(now_s, hand_near)
        if self.state is State.RESTING:
            return self._while_resting(sample)
        return self._while_not_resting(sample, now_s, hand_near)

    def share(self, sample: Sample) -> float:
        """Visible share of the object's full area, 0 to 1."""
        return self._full_size.visible_share(self.name, sample.u_px, sample.v_px, sample.area_px)

    def _unseen(self, now_s: float, hand_near: bool) -> list[Happening]:
        self._displaced_since = self._still_since = None
        if self.state is State.UNSEEN or not self._history:
            return []
        silent_s = now_s - self._well_seen_s
        needed_s = self._limits.vanish_s if self.state is State.MOVING else self._limits.hidden_s
        if silent_s < needed_s or (hand_near and silent_s < self._limits.timeout_s):
            return []
        return [self._vanish()]

    def _vanish(self) -> Happening:
        moving = self.state is State.MOVING
        u, v = last_place(self.name, list(self._history), self._full_size)
        if not moving and self.place is not None:
            u, v = self.place.u_px, self.place.v_px
        unwatched = self.blind and moving  # it went on while nobody saw where to
        self.state, self.place = State.UNSEEN, None
        self._history.clear()
        confidence = 0.2 if unwatched else 0.7 if moving else 1.0
        return Happening(Gesture.KIND_VANISHED, u, v, confidence, moving, not unwatched)

    def _while_resting(self, sample: Sample) -> list[Happening]:
        assert self.place is not None
        if sample.displacement_px(self.place) >= self._limits.moved_px:
            since = self._displaced_since if self._displaced_since is not None else sample.time_s
            self._displaced_since = since
            if sample.time_s - since + 1e-6 < self._limits.moved_s:
                return []
            return [self._begin_to_move(self.place)]
        self._displaced_since = None
        return self._better_view(sample)

    def _begin_to_move(self, start: Sample) -> Happening:
        self.state, self._displaced_since, self._still_since = State.MOVING, None, None
        return Happening(Gesture.KIND_MOVED, start.u_px, start.v_px, self.share(start))

    def _better_view(self, sample: Sample) -> list[Happening]:
        """A hand or arm that hid a part has gone: say the better place once more."""
        still = self._still_samples(sample.time_s)
        if len(still) < 2 or still[-1].time_s - still[0].time_s < 0.7 * self._limits.rest_s:
            return []
        best = Sample.median(still)
        assert self.place is not None
        best.teach(self._full_size, self.name)
        if best.area_px > self.place.area_px:
            self.place = best
        if best.area_px > 1.08 * self._told_area_px and self.share(best) >= self._limits.clear_share:
            self._told_area_px = best.area_px
            return [Happening(Gesture.KIND_RESTED, best.u_px, best.v_px, self.share(best))]
        return []

    def _still_samples(self, now_s: float) -> list[Sample]:
        """The samples of the last `rest_s`, or [] if any border moved."""
        recent = [s for s in self._history if s.time_s > now_s - self._limits.rest_s - 1e-6]
        latest = recent[-1]
        return recent if all(s.border_change_px(latest) <= self._limits.rest_px for s in recent) else []

    def _while_not_resting(self, sample: Sample, now_s: float, hand_near: bool) -> list[Happening]:
        still = self._still_samples(now_s)
        if not still or len(self._history) < 2:
            self._still_since = None
            return self._seen_in_motion(sample, now_s)
        if self._still_since is None:
            self._still_since = still[0].time_s
        if now_s - self._still_since + 1e-6 < self._limits.rest_s:
            return []
        return self._come_to_rest(Sample.median(still), now_s - self._still_since, hand_near)

    def _seen_in_motion(self, sample: Sample, now_s: float) -> list[Happening]:
        if self.state is State.MOVING:
            return []
        recent = [s for s in self._history if s.time_s > now_s - self._limits.rest_s]
        first = recent[0]
        if now_s - first.time_s < self._limits.moved_s or sample.displacement_px(first) < 2 * self._limits.moved_px:
            return []
        if self.share(sample) < self._limits.part_share / 2:
            return []
        return [self._begin_to_move(first)]

    def _come_to_rest(self, place: Sample, still_s: float, hand_near: bool) -> list[Happening]:
        share = self.share(place)
        waited = still_s >= (self._limits.timeout_s if hand_near else self._limits.clear_view_s)
        if share < self._limits.clear_share and not waited:
            return []
        if share < self._limits.part_share:
            return [self._vanish()] if self.state is State.MOVING else []
        kind = Gesture.KIND_RESTED if self.state is State.MOVING else Gesture.KIND_APPEARED
        self.state, self.place, self._told_area_px = State.RESTING, place, place.area_px
        self._still_since = None
        place.teach(self._full_size, self.name)
        return [Happening(kind, place.u_px, place.v_px, share)]
