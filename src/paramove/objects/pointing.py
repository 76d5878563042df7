"""Pointing by proximity over time (thesis 5.2.6, step 4).

"The pointing is here identified by thresholding the distance between the color-tracked hand and the closest (tracked)
object. If this threshold is maintained for some time, the robot removes the object."
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from paramove.documents import Floats
from paramove.msgs.tracked_objects_pb2 import TrackedObject
from paramove.objects.homography import PlaneHomography
from paramove.objects.sinking import Sample


@dataclass(frozen=True)
class PointingThresholds:
    """When a hand points at an object.

    Attributes:
        near: Distance of fingertip and object's axis, m: a finger that points ends about 1 cm from the object's side,
            and objects stand 5 cm apart or more.
        near_px: The same while there is no calibration, at about 1.4 mm per px.
        clearer_by: The second closest object must be farther by this fraction of `near`.
        hold_s: Minimum duration: a hand that passes by, or releases one object next to another, stays for up to 0.7 s.
        still: The palm stays within this fraction of `near` meanwhile (the fingertip jumps to a knuckle at times).
        away: The hand has left beyond this multiple of `near`.
        gap_s: A shorter gap in the detections of the hand is ignored.
    """

    near: float = 0.028
    near_px: float = 25.0
    clearer_by: float = 0.25
    hold_s: float = 1.2
    still: float = 0.45
    away: float = 1.3
    gap_s: float = 0.15


class Pointing:
    """Recognizes pointing of the hand at objects at rest.

    An object can be pointed at once the hand has been away from it since it came to rest, so that the hand that puts an
    object down does not point at it; and again after the hand has left.
    """

    def __init__(self, thresholds: PointingThresholds) -> None:
        self._limits = thresholds
        self._free: set[str] = set()
        self._candidate: str | None = None
        self._since_s = 0.0
        self._last_near_s = 0.0
        self._palm_then: Floats | None = None

    def update(
        self,
        now_s: float,
        hand: TrackedObject | None,
        resting: Mapping[str, Sample],
        any_moving: bool,
        homography: PlaneHomography | None,
    ) -> str | None:
        """Name of the object that is pointed at from now on, or None. Distances are in m with a homography, else px."""
        self._free &= set(resting)
        if any_moving or hand is None:
            if hand is None:
                self._free |= set(resting)
                self._forget_after_gap(now_s)
            else:
                self._candidate = None
            return None
        distances = {name: self._distance(hand, position, homography) for name, position in resting.items()}
        self._free |= {name for name, distance in distances.items() if distance > self._limits.away}
        nearest = self._clearly_nearest(distances)
        if nearest is None:
            self._forget_after_gap(now_s)
            return None
        return self._hold(nearest, np.array([hand.u_px, hand.v_px]), now_s, resting[nearest], homography)

    def _hold(
        self, name: str, palm: Floats, now_s: float, position: Sample, homography: PlaneHomography | None
    ) -> str | None:
        moved = self._palm_then is not None and (
            np.linalg.norm(palm - self._palm_then) / self._near_px(position, homography) > self._limits.still
        )
        if name != self._candidate or moved:
            self._candidate, self._since_s, self._palm_then = name, now_s, palm
        self._last_near_s = now_s
        if name not in self._free or now_s - self._since_s + 1e-6 < self._limits.hold_s:
            return None
        self._free.discard(name)
        return name

    def _forget_after_gap(self, now_s: float) -> None:
        if now_s - self._last_near_s > self._limits.gap_s:
            self._candidate = self._palm_then = None

    def _clearly_nearest(self, distances: Mapping[str, float]) -> str | None:
        """The closest object if it is near and no other is about as close."""
        ordered = sorted(distances, key=lambda name: (distances[name], name))
        if not ordered or distances[ordered[0]] > 1.0:
            return None
        if len(ordered) > 1 and distances[ordered[1]] - distances[ordered[0]] < self._limits.clearer_by:
            return None
        return ordered[0]

    def _distance(self, hand: TrackedObject, position: Sample, homography: PlaneHomography | None) -> float:
        """Distance in the image of fingertip and object's axis, in units of `near` at the object's position.

        The finger is above the plane by an unknown height, so its own position on the plane is unknown; the distance is
        taken parallel to the image instead and scaled as the plane is at the object.
        """
        tip = _fingertip(hand, position)
        below = min(max(float(tip[1]), position.top_px), position.bottom_px)
        return float(np.hypot(tip[0] - position.u_px, tip[1] - below)) / self._near_px(position, homography)

    def _near_px(self, position: Sample, homography: PlaneHomography | None) -> float:
        if homography is None:
            return self._limits.near_px
        here = np.array(homography.plane_from_image(position.u_px, position.v_px))
        next_to_it = np.array(homography.plane_from_image(position.u_px + 1.0, position.v_px))
        return self._limits.near / float(np.linalg.norm(next_to_it - here))


def _fingertip(hand: TrackedObject, position: Sample) -> Floats:
    """The extreme point of the hand's outline: a stretched finger's tip, else the point towards the object; px."""
    centre = np.array([hand.u_px, hand.v_px])
    if not hand.outline:
        return centre
    outline = np.array([(point.u_px, point.v_px) for point in hand.outline])
    reach = np.linalg.norm(outline - centre, axis=1)
    tip = outline[int(np.argmax(reach))]
    opposite = float(np.max(-(outline - centre) @ (tip - centre))) / float(reach.max() or 1.0)
    if reach.max() >= 1.25 * opposite:  # one finger out of the palm, whose other side is nearer to its middle
        return np.asarray(tip, dtype=np.float64)
    towards = np.array([position.u_px, position.v_px]) - centre
    return np.asarray(outline[int(np.argmax((outline - centre) @ towards))], dtype=np.float64)
