"""A person measured without a ruler: arm lengths and shoulder from key points of a few seconds of movement.

`PersonSetUp` leads the person through that movement. One camera does not see how large things are. The scale comes from
the distance of the shoulder (a board held at the chest, a depth image), or from the person's height.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from paramove.cameras import CalibratedCamera
from paramove.documents import Floats, InputError
from paramove.observation.body_key_points import ARM_POINTS, BodyKeyPoints
from paramove.observation.key_point_observer import KeyPointOptions

MIN_IMAGES = 20
"""Of a person with the whole right arm in view."""
LENGTHS_SD, DISTANCE_SD, HEIGHT_SD = 0.02, 0.04, 0.05
"""Deviation of a bone's length, m; of the shoulder's distance, m, and of lengths from the height, as a fraction."""
UPPER_ARM_OF_HEIGHT, FOREARM_OF_HEIGHT = 0.16, 0.14
"""Between the network's joints, of the height: together 0.28 to 0.32 of three measured persons."""
HAND_OF_FOREARM = 0.72
"""Wrist to fingertip; a closed hand does not show it."""
LIMITS_M = {"upper_arm": (0.15, 0.45), "forearm": (0.15, 0.40), "hand": (0.10, 0.28)}
MEAN_HEIGHT_M, ANY_HEIGHT_SD = 1.70, 0.06
"""Of adults, where nothing is known, and its deviation as a fraction."""
HANGS_WITHIN = np.radians(9.0)
"""Deviation of a resting upper arm from the vertical, to either side: of ten seated persons."""
SEARCHED_M = np.linspace(-0.3, 0.3, 121)
"""Errors of the network's depths that are tried."""
UNUSUAL = 3.0
"""An arm whose bones are both longer than this many deviations from the usual is not as far away as given."""
RESTING_IMAGES = 9
"""The first so many images show the resting arm."""
STILL = 4.0
"""Deviations of a key point within which a resting hand stays."""
MOVING_IMAGES = 45
"""Of the moving arm: three seconds at 15 images a second."""
MOVED = 25.0
"""Deviations by which the hand moves in these images, at least."""
HANG = "sit or stand as you will point, in view from head to hips, and let your right arm hang still"
MOVE = "move your right arm slowly: forward, to the side, up, and back, with a bent and a stretched elbow"


@dataclass(frozen=True)
class MeasuredArm:
    """Measures of a person.

    Attributes:
        upper_arm, forearm, hand: m; the hand to the tip of the stretched index finger.
        resting: Shoulder, elbow, fingertip of the resting arm, (9,), m, in the world.
        length_deviation: Of the lengths, m.
        distance_deviation: Of the shoulder along the line of sight, m.
    """

    upper_arm: float
    forearm: float
    hand: float
    resting: Floats
    length_deviation: float
    distance_deviation: float

    @property
    def shoulder(self) -> Floats:
        """Where it rests, (3,), m, in the world."""
        return self.resting[:3]


def measured_arm(
    camera: CalibratedCamera, key_points: Sequence[BodyKeyPoints], *, distance: float | None = None,
    height: float | None = None,
) -> MeasuredArm:  # fmt: skip
    """The measures of the right arm in these images, which begin with a resting arm.

    Args:
        camera: Calibrated, standing still.
        key_points: Of images in which the arm rests and then moves to several sides.
        distance: Of the right shoulder along the camera's axis, m.
        height: Of the person, m; without, that of a mean adult, who is also what uncertain lengths tend to.

    Raises InputError for too few images, and for lengths that no arm has.
    """
    check_scale(distance, height)
    arms = np.array([one.positions[0] for one in key_points]).reshape(-1, len(ARM_POINTS), 2)
    whole = np.isfinite(arms).all(axis=(1, 2))
    if whole.sum() < MIN_IMAGES:
        raise InputError(
            f"the right arm is in view in {whole.sum()} images, {MIN_IMAGES} are needed: sit where the camera sees "
            "head, shoulders and the whole arm, and move it for some seconds"
        )
    detected = [one for one, good in zip(key_points, whole, strict=True) if good]
    rays = np.concatenate([camera.normalised(arms[whole]), np.ones((whole.sum(), len(ARM_POINTS), 1))], axis=2)
    usual = np.array([UPPER_ARM_OF_HEIGHT, FOREARM_OF_HEIGHT]) * (MEAN_HEIGHT_M if height is None else height)
    if distance is not None:
        deviation, along = DISTANCE_SD / distance, distance
    else:
        deviation = HEIGHT_SD if height is not None else ANY_HEIGHT_SD
        along = _distance_of(camera, detected, rays, float(usual.sum()))
    measured = _lengths(_points(camera, detected, rays, along))
    usual_sd = usual * (ANY_HEIGHT_SD if height is None else HEIGHT_SD)
    measured_sd = np.hypot(LENGTHS_SD, deviation * usual)
    if ((measured - usual) / np.hypot(usual_sd, measured_sd) > UNUSUAL).all():
        raise InputError(
            f"the arm seems to be {100.0 * measured.sum():.0f} cm long to the wrist, about "
            f"{100.0 * usual.sum():.0f} cm expected: is the distance right?"
        )
    weights = np.array([usual_sd**-2, measured_sd**-2])
    upper_arm, forearm = (weights * [usual, measured]).sum(axis=0) / weights.sum(axis=0)
    lengths = {"upper_arm": float(upper_arm), "forearm": float(forearm), "hand": HAND_OF_FOREARM * float(forearm)}
    for name, (low, high) in LIMITS_M.items():
        if not low <= lengths[name] <= high:
            raise InputError(
                f"the {name.replace('_', ' ')} seems to be {100.0 * lengths[name]:.0f} cm long, {100.0 * low:.0f} "
                f"to {100.0 * high:.0f} cm expected: is the distance right, and was the whole arm in view?"
            )
    resting = _resting(camera, _points(camera, detected, rays, along), float(upper_arm), float(forearm))
    return MeasuredArm(
        **lengths,
        resting=resting,
        length_deviation=float(weights.sum(axis=0).min() ** -0.5),
        distance_deviation=deviation * along,
    )


def check_scale(distance: float | None, height: float | None) -> None:
    """Raises InputError for a distance or a height that no person has, m."""
    for name, value, (low, high) in (("distance", distance, (0.3, 10.0)), ("height", height, (0.8, 2.5))):
        if value is not None and not low <= value <= high:
            raise InputError(f"expected a {name} of {low:g} to {high:g} m, found {value:g} m")


def _points(camera: CalibratedCamera, detected: Sequence[BodyKeyPoints], rays: Floats, along: float) -> Floats:
    """Right arms with the shoulder at that depth, (N, 4, 3), m, in the camera's frame."""
    depths = np.array([one.depths_at(along, camera.matrix[0, 0])[0] for one in detected])
    return np.asarray((along + depths)[..., None] * rays)


def _lengths(points: Floats) -> Floats:
    """Upper arm and forearm, m: medians, which four cameras confirm within 2 cm."""
    return np.asarray(np.median(np.linalg.norm(np.diff(points[:, :3], axis=1), axis=2), axis=0))


def _distance_of(camera: CalibratedCamera, detected: Sequence[BodyKeyPoints], rays: Floats, arm: float) -> float:
    """The depth of the shoulder, m, at which upper arm and forearm together have that length."""
    low, high = 0.3, 10.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        shorter = _lengths(_points(camera, detected, rays, middle)).sum() < arm
        low, high = (middle, high) if shorter else (low, middle)
    return low


def _resting(camera: CalibratedCamera, points: Floats, upper_arm: float, forearm: float) -> Floats:
    """Shoulder, elbow and fingertip of the first images, in the world, (9,).

    Elbow and hand are at the most probable depths given the network's, the bones' lengths, m, and an upper arm that
    hangs.
    """
    shoulder, elbow, wrist, hand = np.median(points[:RESTING_IMAGES], axis=0)
    elbows, wrists, hands = (point * (1.0 + SEARCHED_M[:, None] / point[2]) for point in (elbow, wrist, hand))
    upper, fore = elbows - shoulder, np.linalg.norm(wrists - elbows[:, None], axis=2)  # (E,), (E, W)
    aside = (upper @ camera.camera_from_world[:3, :3])[:, :2]
    options = KeyPointOptions()
    squares = (SEARCHED_M / options.elbow_depth) ** 2
    squares += ((np.linalg.norm(upper, axis=1) - upper_arm) / LENGTHS_SD) ** 2
    squares += (aside**2).sum(axis=1) / (upper_arm * np.sin(HANGS_WITHIN)) ** 2
    both = squares[:, None] + ((fore - forearm) / LENGTHS_SD) ** 2 + (SEARCHED_M / options.hand_depth) ** 2
    best_elbow, best_hand = np.unravel_index(both.argmin(), both.shape)
    resting = np.stack([shoulder, elbows[best_elbow], 2.0 * hands[best_hand] - wrists[best_hand]])
    return np.asarray(((resting - camera.camera_from_world[:3, 3]) @ camera.camera_from_world[:3, :3]).ravel())


class PersonSetUp:
    """Key points of one camera in, what the person shall do out.

    Args:
        camera: Calibrated, standing still.
        distance, height: See `measured_arm`.

    Attributes:
        prompt: What the person shall do now.
        arm: The measures; None until they are known.
    """

    def __init__(self, camera: CalibratedCamera, *, distance: float | None = None, height: float | None = None) -> None:
        check_scale(distance, height)
        self.prompt = HANG
        self.arm: MeasuredArm | None = None
        self._camera, self._distance, self._height = camera, distance, height
        self._resting: deque[BodyKeyPoints] = deque(maxlen=RESTING_IMAGES)
        self._moving: list[BodyKeyPoints] = []

    def see(self, points: BodyKeyPoints) -> str:
        """Adds the key points of an image; what has just happened, for the person, or ""."""
        if self.arm is not None or not np.isfinite(points.positions[0]).all():
            return ""
        if self.prompt == HANG:
            self._resting.append(points)
            hands = _hands(list(self._resting))
            if len(self._resting) < RESTING_IMAGES or np.ptp(hands, axis=0).max() > STILL:
                return ""
            self.prompt = MOVE
            return "the resting arm is detected"
        self._moving.append(points)
        if len(self._moving) < MOVING_IMAGES:
            return ""
        if np.ptp(_hands(self._moving), axis=0).max() < MOVED:
            self._moving = self._moving[MOVING_IMAGES // 2 :]
            return "the arm hardly moved"
        return self._measured()

    def _measured(self) -> str:
        try:
            images = [*self._resting, *self._moving]
            self.arm = measured_arm(self._camera, images, distance=self._distance, height=self._height)
        except InputError as error:
            self.prompt, self._moving = HANG, []
            self._resting.clear()
            return f"once more: {error}"
        self.prompt = "measured"
        arm, cm = self.arm, 100.0
        return (
            f"upper arm {cm * arm.upper_arm:.0f}, forearm {cm * arm.forearm:.0f}, hand {cm * arm.hand:.0f} cm, "
            f"each ± {cm * arm.length_deviation:.0f} cm; shoulder ± {cm * arm.distance_deviation:.0f} cm along the "
            "line of sight"
        )


def _hands(points: list[BodyKeyPoints]) -> Floats:
    """Middles of the right hand, (N, 2), in deviations."""
    return np.array([one.positions[0, 3] / one.deviations[0, 0] for one in points])
