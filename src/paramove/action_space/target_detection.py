"""Detects when the hand has reached which target (thesis 6.7.1.2, corrected: a signed speed along the approach)."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from paramove.action_space.estimates import ThetaEstimate
from paramove.documents import Floats, InputError


@dataclass(frozen=True)
class DetectionOptions:
    """When a target counts as reached.

    Attributes:
        max_deviation: of theta, (6.15); 0.2 in the thesis.
        min_contact: posterior probability that the progress is one at which the hand is at the target theta.
        window_s: over which the hand's velocity is measured; at least three frames.
        approach_speed: m/s; a hand this fast approaches a target. A slower one does once it has moved `min_travel_m`.
        still_speed: m/s, measured speed of a hand at rest.
        stop_share: the hand has arrived when its speed along the approach is below this fraction of the peak: 0 in the
            thesis, but the measured speed of a hand at rest need not cross 0.
        turning_s: time over which the direction of the approach follows a curved path.
        min_travel_m: a hand that has moved less since it arrived is still at the same target. Two targets are at least
            this far apart unless the hand moved `returned_m` between them.
        returned_m: distance that a hand moves that points at the same target twice.
    """

    max_deviation: float = 0.2
    min_contact: float = 0.5
    window_s: float = 0.16
    approach_speed: float = 0.25
    still_speed: float = 0.06
    stop_share: float = 0.12
    turning_s: float = 0.15
    min_travel_m: float = 0.08
    returned_m: float = 0.25

    def __post_init__(self) -> None:
        """Raises InputError for values that are not positive or in the wrong order."""
        for name, value in vars(self).items():
            if not 0.0 < value < np.inf:
                raise InputError(f"{name} is positive and finite, found {value}")
        if not self.still_speed < self.approach_speed:
            raise InputError(f"still_speed < approach_speed, found {self.still_speed} and {self.approach_speed}")

    def scaled(self, factor: float) -> DetectionOptions:
        """The same for movements that are `factor` times as large and take as long."""
        lengths = ("approach_speed", "still_speed", "min_travel_m", "returned_m")
        return replace(self, **{name: factor * getattr(self, name) for name in lengths})


@dataclass(frozen=True)
class DetectedTarget:
    """A target that the hand has reached.

    Attributes:
        number: counts the targets of a track from 1; the same target keeps its number while it becomes more certain.
        time_s: when the hand arrived, for the first time if it left the target a little and returned.
        action: name.
        theta: coordinates (u, v) of the target, shape (2,). covariance: of them, (2, 2).
        place: in the world, m, (3,).
        deviation: of theta (6.15), mean over the frames of the rest.
    """

    number: int
    time_s: float
    action: str
    theta: Floats
    covariance: Floats
    place: Floats
    deviation: float


class HandMotion:
    """Velocity of the hand, and its signed speed along the direction in which it approached."""

    def __init__(self, options: DetectionOptions) -> None:
        self._options = options
        self._samples: deque[tuple[float, Floats]] = deque()
        self._approach = np.zeros(3)
        self.peak = 0.0
        self.speed = 0.0
        self.along = 0.0

    def update(self, time_s: float, hand: Floats) -> None:
        """Takes a position of the hand, (3,), m."""
        elapsed_s = time_s - self._samples[-1][0] if self._samples else 0.0
        self._samples.append((time_s, hand))
        while len(self._samples) > 3 and self._samples[1][0] < time_s - self._options.window_s:
            self._samples.popleft()
        velocity = self._velocity()
        self.speed = float(np.linalg.norm(velocity))
        self.along = float(velocity @ self._approach) / max(float(np.linalg.norm(self._approach)), 1e-9)
        self.peak = max(self.peak, self.speed)
        retained = float(np.exp(-elapsed_s / self._options.turning_s))
        self._approach = retained * self._approach + (1.0 - retained) * velocity

    @property
    def stopped(self) -> bool:
        """Whether the speed along the approach is nearly 0, or has crossed 0; not where a fast path only bends."""
        still = max(self._options.still_speed, self._options.stop_share * self.peak)
        return self.along < 0.0 or (self.along < still and self.speed < 2.0 * still)

    def begin_approach(self) -> None:
        """Resets peak speed and direction for a new approach."""
        self.peak = self.along = self.speed
        self._approach = self._velocity()

    def _velocity(self) -> Floats:
        """Slope of the positions over time by least squares, (3,), m/s."""
        if len(self._samples) < 2:
            return np.zeros(3)
        times = np.array([time for time, _ in self._samples])
        positions = np.stack([position for _, position in self._samples])
        centred = times - times.mean()
        return np.asarray(centred @ (positions - positions.mean(axis=0)) / max(float(centred @ centred), 1e-12))


class TargetDetector:
    """Targets of one track, one after the other."""

    def __init__(self, options: DetectionOptions | None = None) -> None:
        self.options = options if options is not None else DetectionOptions()
        self.motion = HandMotion(self.options)
        self.latest: DetectedTarget | None = None
        self._approaching = False
        self._arrived_s: float | None = None
        self._weight = 0.0
        self._rested_at: Floats | None = None
        self._travelled_m = 0.0
        self._distance_m = np.inf

    def update(
        self, time_s: float, hand: Floats, contact: float, action: str, theta: ThetaEstimate, position: Floats
    ) -> DetectedTarget | None:
        """The latest target, which this frame may add or make more certain.

        Args:
            hand: estimated position of the hand, m, (3,), world. contact: posterior probability of a progress at which
                the hand is at the target theta.
            action: the most probable one, with the estimate `theta` (u, v) of its target. position: of the target in
                the world, m.
        """
        self.passed(time_s, hand)
        options = self.options
        certain = contact >= options.min_contact and theta.deviation < options.max_deviation
        if self._arrived_s is not None and certain:
            self._take(self._arrived_s, action, theta, position)
        return self.latest

    def passed(self, time_s: float, hand: Floats) -> DetectedTarget | None:
        """A frame in which the hand, (3,), m, is at no target."""
        motion = self.motion
        motion.update(time_s, hand)
        if self._rested_at is not None:
            self._travelled_m = max(self._travelled_m, float(np.linalg.norm(hand - self._rested_at)))
        far = self._travelled_m >= self.options.min_travel_m
        if not self._approaching and (motion.speed > self.options.approach_speed or far):
            self._approaching, self._arrived_s = True, None
            motion.begin_approach()
        elif self._approaching and motion.stopped:
            self._arrive(time_s, hand)
        return self.latest

    def forget(self) -> None:
        """Ends the approach under way: the track was lost."""
        self.motion = HandMotion(self.options)
        self._approaching, self._arrived_s, self._rested_at = False, None, None

    def _arrive(self, time_s: float, hand: Floats) -> None:
        self._approaching, self._arrived_s = False, time_s
        if self._rested_at is None or self._travelled_m >= self.options.min_travel_m:
            self._distance_m = np.inf if self._rested_at is None else self._travelled_m
            self._rested_at, self._weight = hand, 0.0
        elif self._weight > 0.0 and self.latest is not None:
            self._arrived_s = self.latest.time_s
        self._travelled_m = 0.0

    def _take(self, arrived_s: float, action: str, theta: ThetaEstimate, position: Floats) -> None:
        """Means over the frames of one rest, weighted by their certainty."""
        weight = 1.0 / max(theta.deviation, 1e-3) ** 2
        number, mean, covariance, deviation = 1, theta.mean, theta.covariance, theta.deviation
        if (latest := self.latest) is not None:
            # The same target again, which the hand left only a little.
            again = self._distance_m < self.options.returned_m and (
                float(np.linalg.norm(position - latest.place)) < self.options.min_travel_m
            )
            arrived_s = latest.time_s if again else arrived_s
            number = latest.number if again or self._weight > 0.0 else latest.number + 1
            if self._weight > 0.0 and latest.action == action:
                gain = weight / (self._weight + weight)
                mean = latest.theta + gain * (mean - latest.theta)
                covariance = latest.covariance + gain * (covariance - latest.covariance)
                position = latest.place + gain * (position - latest.place)
                deviation = latest.deviation + gain * (deviation - latest.deviation)
        self._weight += weight
        self.latest = DetectedTarget(number, arrived_s, action, mean, covariance, position, deviation)
