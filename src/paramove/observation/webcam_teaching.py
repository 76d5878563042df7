"""A person teaches a movement in front of calibrated cameras: from rest to known positions, touched with a fingertip.

It reads no clock and draws nothing: key points in, prompts for the person and a growing demonstration set out. The
position that is touched is known, so it anchors the movement in space and is its theta.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from paramove.cameras import WORLD_FRAME, AlignedViews, CalibratedCamera, Views
from paramove.demonstrations import DemonstrationError, TaughtSet, moved_part
from paramove.documents import Floats, InputError
from paramove.observation.arm_body import ArmSizes
from paramove.observation.arm_movement import HAND, SHOULDER, WRIST, ArmMovement, reconstructed
from paramove.observation.body_key_points import SIDES, BodyKeyPoints

POINT_NAMES = ("shoulder", "other_shoulder", "elbow", "wrist", "knuckle", "index", "thumb")
OTHER_SHOULDER = np.array([0.0, 0.36, 0.0])
"""m: the left shoulder, from the right one, of a person who faces along x."""
STILL_S = 0.6
"""A hand that has been still for so long rests, or touches its target."""
STILL, MOVED = 3.0, 8.0
"""Deviations of a key point within which a still hand stays, and beyond which it has moved."""
MIN_STILL = 0.7
"""Fraction of the images in which it does; the others may have exchanged sides."""
RESTS_WITHIN_M, TOUCHES_WITHIN_M = 0.02, 0.005
"""A hand rests, and touches its target, within these distances of the path's ends."""
TOUCH_S = 0.4
"""The last part of a movement in which the fingertip is at its target."""
MAX_OFF_M = 0.25
"""A fingertip that appears farther than this from the position where it should be touches another one."""
MAX_ASIDE_M = 0.10
"""A fingertip that a picture shows farther than this beside the position touches another one."""
MAX_STRANGE = 0.3
"""Fraction of the images of a movement that may show something else than this arm."""
LONGEST_S = 10.0
SAME_M = 0.01
"""Positions that are nearer to each other are one."""


class WebcamTeacher:
    """Leads a person through the positions, one movement each, and writes each movement as it ends.

    Args:
        cameras: One or more calibrated cameras, which stand still.
        targets: Positions to touch in turn, (N, 3), m, in the world, and their names.
        taught: The set that the movements go to. Positions of this action that it has already are not requested.
        sizes: Of the person's arm. shoulder: where it rests, (3,), m; both are needed with one camera.
        rate_hz: Of the cameras.

    Attributes:
        prompt: What the person shall do now.
    """

    def __init__(
        self, cameras: Sequence[CalibratedCamera], targets: Mapping[str, Floats], taught: TaughtSet, *,
        sizes: ArmSizes | None = None, shoulder: ArrayLike | None = None, rate_hz: float = 15.0,
    ) -> None:  # fmt: skip
        if len(cameras) == 1 and (sizes is None or shoulder is None):
            raise InputError("one camera gives no depth: the person's measures are needed, or a second camera")
        if not targets:
            raise InputError("no position to touch given: expected at least one")
        self._cameras = tuple(cameras)
        done = [np.asarray(theta) for theta in taught.positions]
        self._targets = [
            (name, place)
            for name, place in targets.items()
            if not any(np.linalg.norm(place - theta) < SAME_M for theta in done)
        ]
        self._taught, self._sizes, self._shoulder = taught, sizes, shoulder
        self._names = [camera.name for camera in cameras]
        self._views = AlignedViews[BodyKeyPoints](self._names, 1.0 / rate_hz)
        self._track: list[Views[BodyKeyPoints]] = []
        self._resting: Floats | None = None
        self._is_out = False
        self._done = 0
        self._ask(0)

    @property
    def finished(self) -> bool:
        """Whether all positions were touched."""
        return self._done == len(self._targets)

    def see(self, camera: str, captured_ns: int, points: BodyKeyPoints) -> str:
        """Adds the key points of an image; what has just happened, for the person, or "".

        Raises InputError for a camera that is not among them.
        """
        if camera not in self._names:
            raise InputError(
                f"key points of {camera}, calibrated are {', '.join(self._names)}: is it their calibration?"
            )
        happened = ""
        for views in self._views.add(camera, captured_ns, points):
            if not self.finished:
                self._track.append(views)
                happened = self._judged() or happened
        return happened

    def _judged(self) -> str:
        """Follows rest, movement, touch and return by the hand in the first image."""
        while self._track[-1].captured_ns - self._track[0].captured_ns > LONGEST_S * 1e9:
            self._track.pop(0)
        recent = [one for one in self._track if self._track[-1].captured_ns - one.captured_ns <= STILL_S * 1e9]
        hands = np.array([_hand(one) for one in recent])
        long_enough = len(recent) > 2 and recent[-1].captured_ns - recent[0].captured_ns >= 0.8 * STILL_S * 1e9
        hand = _still(hands) if long_enough else None
        if hand is None:
            return ""
        if self._resting is None or (self._is_out and np.linalg.norm(hand - self._resting) < MOVED):
            self._resting, self._is_out, self._track = hand, False, recent
            return ""
        if not self._is_out and np.linalg.norm(hand - self._resting) > MOVED:
            self._is_out = True
            return self._ended()
        if not self._is_out:
            self._track = recent  # a rest: the movement begins after it
        return ""

    def _ended(self) -> str:
        track, (name, target) = self._track, self._targets[self._done]
        try:
            movement = self._reconstructed(track, target)
            hand = movement.fingertip
            moved = moved_part(hand, RESTS_WITHIN_M)[0], moved_part(hand, TOUCHES_WITHIN_M)[1]
            recording = self._taught.add(
                movement.times_s, body_points(movement), POINT_NAMES, WORLD_FRAME, moved, target
            )
        except (InputError, DemonstrationError) as error:
            self._ask(self._done)
            return f"left out: {error}"
        self._ask(self._done + 1)
        return f"{recording}: {name} touched"

    def _reconstructed(self, track: Sequence[Views[BodyKeyPoints]], target: Floats) -> ArmMovement:
        times = np.array([one.captured_ns - track[0].captured_ns for one in track]) * 1e-9
        points = [[one.images[number] for one in track] for number in range(len(self._cameras))]
        known = partial(
            reconstructed, self._cameras, times, points, sizes=self._sizes, shoulder=self._shoulder,
            hangs_until_s=0.5 * STILL_S,
        )  # fmt: skip
        free = known()
        strange = float((free.sides == 2).mean())
        if strange > MAX_STRANGE:
            raise InputError(f"{100.0 * strange:.0f} % of the images show something else than the arm")
        off = np.linalg.norm(free.fingertip[-1] - target)
        if off > MAX_OFF_M * (1.0 if len(self._cameras) > 1 else 2.0):
            raise InputError(
                f"the fingertip ends {100.0 * off:.0f} cm from the position, as detected: was it another one?"
            )
        begins_s = times[-1] - TOUCH_S
        for camera, row, sides in zip(self._cameras, points, free.sides, strict=True):
            aside = _aside(camera, target, [
                one.positions[side] for one, side, at in zip(row, sides, times, strict=True)
                if one is not None and 0 <= side < len(SIDES) and at >= begins_s
            ])  # fmt: skip
            if aside > MAX_ASIDE_M:
                raise InputError(
                    f"{camera.name} shows the fingertip {100.0 * aside:.0f} cm beside the position: was it another one?"
                )
        return known(touched=(target, begins_s))

    def _ask(self, number: int) -> None:
        self._done = number
        if self.finished:
            self.prompt = "all positions are touched"
            return
        name = self._targets[number][0]
        self.prompt = (
            f"{number + 1} of {len(self._targets)}: let your right arm hang; then touch {name} with the fingertip, and "
            "hold it there"
        )


def board_targets(corners: ArrayLike) -> dict[str, Floats]:
    """Nine positions of a board: names, and the inner corners of (N, 3), m, that are nearest to a grid."""
    points = np.asarray(corners, dtype=np.float64)
    low, high = points.min(axis=0), points.max(axis=0)
    names = [f"{row} {column}".strip() for row in ("near", "middle", "far") for column in ("right", "", "left")]
    fractions = [(x, y) for x in (0.0, 0.5, 1.0) for y in (0.0, 0.5, 1.0)]
    grid = low[:2] + np.array(fractions) * (high - low)[:2]
    nearest = [int(np.linalg.norm(points[:, :2] - place, axis=1).argmin()) for place in grid]
    return {f"the {name} corner": points[row] for name, row in zip(names, nearest, strict=True)}


def _aside(camera: CalibratedCamera, target: Floats, arms: Sequence[Floats]) -> float:
    """How far beside a position the fingertip of arms (4, 2), px, is in a picture, at its distance, m; 0 if unknown."""
    tips = np.array([2.0 * arm[HAND] - arm[WRIST] for arm in arms]).reshape(-1, 2)
    tips = tips[np.isfinite(tips).all(axis=1)]
    if not len(tips):
        return 0.0
    off = np.median(tips, axis=0) - camera.project(target)
    return float(np.linalg.norm(off) * float(camera.depths(target)) / camera.matrix[0, 0])


def body_points(movement: ArmMovement) -> Floats:
    """The points of `POINT_NAMES`, (T, 7, 3), m. The fingers are together; the trunk faces along x."""
    shoulder, tip = movement.points[:, SHOULDER], movement.fingertip
    rows = (shoulder, shoulder + OTHER_SHOULDER, movement.points[:, 1], movement.points[:, WRIST])
    return np.stack([*rows, movement.points[:, HAND], tip, tip], axis=1)


def _still(hands: Floats) -> Floats | None:
    """Where a hand (N, 2) is that does not move, but for images with exchanged sides and outliers; None if it does."""
    known = hands[np.isfinite(hands).all(axis=1)]
    if not len(known):
        return None
    hand: Floats = np.median(known, axis=0)
    near = np.linalg.norm(known - hand, axis=1) < STILL
    return hand if near.sum() >= MIN_STILL * len(hands) else None


def _hand(detected: Views[BodyKeyPoints]) -> Floats:
    """Of the right arm in the first image, in deviations."""
    first = detected.images[0]
    return np.full(2, np.nan) if first is None else first.positions[0, 3] / first.deviations[0, 0]
