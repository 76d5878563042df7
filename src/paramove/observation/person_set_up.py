"""Leads a person through a few seconds of movement, from which the person is measured without a ruler."""

from __future__ import annotations

from collections import deque

import numpy as np

from paramove.cameras import CalibratedCamera
from paramove.documents import Floats, InputError
from paramove.observation.body_key_points import BodyKeyPoints
from paramove.observation.person_measures import RESTING_IMAGES, MeasuredArm, check_scale, measured_arm

STILL = 4.0
"""Deviations of a key point within which a resting hand stays."""
MOVING_IMAGES = 45
"""Of the moving arm: three seconds at 15 images a second."""
MOVED = 25.0
"""Deviations by which the hand moves in these images, at least."""
HANG = "sit or stand as you will point, in view from head to hips, and let your right arm hang still"
MOVE = "move your right arm slowly: forward, to the side, up, and back, with a bent and a stretched elbow"


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
