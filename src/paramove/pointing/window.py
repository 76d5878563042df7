"""Pointing from a recent window of tracked elbow and hand positions (paper 5.4): reported once, with its target.

At every new sample, windows of several lengths that end there are judged by the model of the last part of pointing. The
one with the lowest outlier score counts. It is a pointing if that score is low enough, pointing fits better than
reaching, and its target is on the table; it is reported as soon as no later window has fitted better for `settled_s`.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING

import numpy as np
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from paramove.action_space import PersonPlacement, add_ball, certainty
from paramove.cameras import WORLD_FRAME
from paramove.demonstrations import FRAMES, at_times, table_place
from paramove.documents import Floats, InputError
from paramove.msgs.arm_pose_pb2 import ArmPose
from paramove.msgs.gesture_pb2 import Gesture
from paramove.pointing.events import FARTHEST_M

if TYPE_CHECKING:
    from paramove.phmm import Examination
    from paramove.pointing.last_part_model import LastPartModel

LENGTHS = (0.6, 0.75, 0.95, 1.2, 1.5)
"""Of the windows that are tried, over the mean duration of the demonstrated last parts."""
MIN_PERIOD_S = 0.03
"""Minimum time between judged windows; a tracker may be faster."""
RESTARTED_S = 1.0
"""A sample that is older than the latest by more than this is the first of a restarted tracker."""


@dataclass(frozen=True)
class WindowEstimate:
    """The estimate from the latest window.

    Attributes:
        captured_ns: of its last sample.
        examination: of the window that fits pointing best, as pointing.
        position: the target of that window, (3,), m, in the world. deviation: along each axis, (3,), m.
        hand: the last of the points at its end, (3,), m, in the world.
        pointing: whether it counts as pointing.
    """

    captured_ns: int
    examination: Examination
    position: Floats
    deviation: Floats
    hand: Floats
    pointing: bool

    @property
    def likeness(self) -> float:
        """From 0 (no pointing) to 1 (typical pointing)."""
        return float(np.nan_to_num(self.examination.p_value) ** 0.25) if self.pointing else 0.0


class PointingWindow:
    """Reports each pointing in a sequence of arm poses once, when it has just been completed.

    Args:
        model: of the last part of pointing, made for the points of the options.
        placement: where the person sits, and how large the person is.

    Attributes:
        estimate: from the window that ends with the latest pose; None if there is no window without a gap.
    """

    def __init__(
        self, model: LastPartModel, placement: PersonPlacement, options: PointingWindowOptions | None = None
    ) -> None:
        self._options = options if options is not None else PointingWindowOptions()
        self._model = model
        self._placement = placement
        self._lengths_s = [length * model.duration_s for length in LENGTHS]
        self._clear()

    def _clear(self) -> None:
        self._samples: deque[tuple[int, Floats]] = deque()
        self._judged_ns = -(10**18)
        self._best: WindowEstimate | None = None
        self._reported_at: Floats | None = None
        self.estimate: WindowEstimate | None = None

    def update(self, pose: ArmPose) -> Gesture | None:
        """The gesture that this sample completes, if there is one.

        Late and repeated samples, and those without one of the points or in another frame, are ignored. If time goes
        back by more than a second, the tracker was restarted, and the earlier samples are discarded.
        """
        captured_ns, sample = pose.captured.ToNanoseconds(), self._sample(pose)
        if self._samples and captured_ns < self._samples[-1][0] - RESTARTED_S * 1e9:
            self._clear()
        self.estimate = None
        if sample is None or (self._samples and captured_ns <= self._samples[-1][0]):
            return None
        if self._samples and captured_ns - self._samples[-1][0] > self._options.max_gap_s * 1e9:
            self._samples.clear()
            self._best = None
        self._samples.append((captured_ns, sample))
        while len(self._samples) > 1 and captured_ns - self._samples[1][0] > self._lengths_s[-1] * 1e9:
            self._samples.popleft()
        if captured_ns - self._judged_ns < MIN_PERIOD_S * 1e9:
            return None
        self._judged_ns = captured_ns
        self.estimate = self._judged(captured_ns)
        return self._completed(captured_ns, sample[-3:])

    def ball(self) -> SceneUpdate | None:
        """A ball where the latest window points; green if it is like pointing, red if it is not (figure 16)."""
        if self.estimate is None:
            return None
        message = SceneUpdate()
        entity = message.entities.add(id="pointed_at", frame_id=WORLD_FRAME)
        entity.timestamp.FromNanoseconds(self.estimate.captured_ns)
        entity.lifetime.FromMilliseconds(1000)
        add_ball(entity, self.estimate.position, self.estimate.likeness)
        return message

    def _sample(self, pose: ArmPose) -> Floats | None:
        """The points, (3 n,), m; None if one of them is missing or farther away than an arm can be."""
        points = {point.name: (point.x, point.y, point.z) for point in pose.points}
        if pose.frame != WORLD_FRAME or any(name not in points for name in self._options.points):
            return None
        sample = np.array([points[name] for name in self._options.points]).ravel()
        return sample if bool(np.all(np.abs(sample) < FARTHEST_M)) else None  # NaN is not below either

    def _judged(self, now_ns: int) -> WindowEstimate | None:
        """The estimate from the window that fits pointing best."""
        times = (np.array([captured_ns for captured_ns, _ in self._samples]) - now_ns) * 1e-9
        lengths = [length for length in self._lengths_s if length <= -times[0]]
        if not lengths:
            return None
        samples = np.array([sample for _, sample in self._samples])
        placed = self._placement.in_model(samples)
        windows = [at_times(np.linspace(-length, 0.0, FRAMES), times, placed) for length in lengths]
        examined = [self._model.pointing.examine(window) for window in windows]
        chosen = int(np.argmin([one.outlier_score for one in examined]))
        best = examined[chosen]
        position = self._placement.in_world(table_place(best.estimate.theta))
        slopes = (table_place(np.eye(2)) - table_place(np.zeros(2))) * self._placement.scale
        deviation = np.sqrt(np.einsum("pi,pq,qi->i", slopes, best.estimate.covariance, slopes))
        return WindowEstimate(
            now_ns, best, position, deviation, samples[-1, -3:], self._is_pointing(windows[chosen], best)
        )

    def _is_pointing(self, window: Floats, examined: Examination) -> bool:
        options, theta = self._options, examined.estimate.theta
        outside = np.maximum(-theta, theta - 1.0).max()
        if examined.p_value < options.level or outside > options.margin:
            return False
        return self._model.lead(window, examined) >= options.min_lead

    def _completed(self, now_ns: int, hand: Floats) -> Gesture | None:
        """The gesture of the best window, once the pointing is over; one until the hand moves away."""
        if self._reported_at is not None:
            if np.linalg.norm(hand - self._reported_at) < self._options.apart_m:
                return None
            self._reported_at = None
        estimate, best = self.estimate, self._best
        minimum = np.inf if best is None else best.examination.outlier_score
        if estimate is not None and estimate.pointing and estimate.examination.outlier_score < minimum:
            self._best = best = estimate
        if best is None or now_ns - best.captured_ns < self._options.settled_s * 1e9:
            return None
        self._reported_at, self._best = best.hand, None
        x, y, _ = best.position
        gesture = Gesture(
            kind=Gesture.KIND_POINTED_AT, located=True, frame=WORLD_FRAME, x=x, y=y,
            confidence=certainty(best.deviation),
        )  # fmt: skip
        gesture.captured.FromNanoseconds(now_ns)
        return gesture


@dataclass(frozen=True)
class PointingWindowOptions:
    """Which points are used, and when their window is a pointing.

    Attributes:
        points: of the arm, as `ArmPose` names them. ("elbow", "wrist") are the paper's; they do not distinguish
            pointing from reaching, which ("elbow", "wrist", "index") do.
        level: minimum p-value of a pointing; low, since errors of a body tracker are not in the training.
        min_lead: logarithm of the minimum ratio of the window's density as pointing to that as reaching.
        settled_s: a pointing is over after this time without a better window.
        max_gap_s: a longer time without samples, or without one of the points, starts a new window.
        margin: how far outside the demonstrated positions, as a fraction of their extent, a target may lie.
        apart_m: minimum distance that the hand moves away before it can point again.
    """

    points: tuple[str, ...] = ("elbow", "wrist", "index")
    level: float = 0.002
    min_lead: float = 7.0
    settled_s: float = 0.12
    max_gap_s: float = 0.25
    margin: float = 0.15
    apart_m: float = 0.12

    def __post_init__(self) -> None:
        """Raises InputError for points and numbers that cannot be used."""
        if not 2 <= len(self.points) == len(set(self.points)):
            raise InputError(f"points: at least two different points of the arm expected, found {self.points}")
        for name in ("level", "settled_s", "max_gap_s", "apart_m"):
            if not 0.0 < getattr(self, name) < inf:
                raise InputError(f"{name}: a positive, finite number expected, found {getattr(self, name)}")
