"""Whether a track still follows its arm: the best likelihood compared with what is usual for this track."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from paramove.documents import InputError
from paramove.observation import Presence

HYSTERESIS = 0.9
"""While the arm is lost, the change of the images must fall below this fraction of the maximum."""


@dataclass(frozen=True)
class HealthOptions:
    """When a track counts as lost, and as found again; times in seconds, so that the frame rate does not matter.

    Attributes:
        settle_s: time for which a track learns what is usual before it can be lost.
        memory_s: over which the usual is learned.
        rise: fraction of `memory_s` in which it becomes better: a short time before a contrasting background must not
            raise the demands on what follows, nor a fast, well matched arm hide that it is gone later.
        drop_deviations: a drop by more than this many usual downward deviations is far below the usual.
        min_drop, max_drop: nats, of the likelihood flattened as it usually is; a smaller drop than the one is never,
            a larger than the other always far below.
        min_log_likelihood: nats; a lower one is always far below. None: no limit.
        lost_after_s: lost when the likelihood is far below for this long.
        found_after_s: found again when it is not for this long.
        found_fraction: of the allowed drop; while the arm is lost, the drop must be smaller than this fraction of it.
        min_there: of -1 to 1, see `Presence`; less means that only the background is visible where the arm should be.
        max_changed: changed area, times the arm's; more means that somebody left or came, or that a camera was moved.
        absent_after_s: lost when either limit is exceeded for this long.
    """

    settle_s: float = 0.6
    memory_s: float = 4.0
    rise: float = 0.3
    drop_deviations: float = 3.0
    min_drop: float = 3.0
    max_drop: float = 5.0
    min_log_likelihood: float | None = None
    lost_after_s: float = 0.5
    found_after_s: float = 0.3
    found_fraction: float = 0.5
    min_there: float = -0.3
    max_changed: float = 2.5
    absent_after_s: float = 0.1

    def __post_init__(self) -> None:
        """Raises InputError for times and drops that are not positive."""
        for name in vars(self):
            if name in ("min_log_likelihood", "min_there"):
                continue
            if not 0.0 < getattr(self, name) < np.inf:
                raise InputError(f"{name} is positive and finite, found {getattr(self, name)}")


class TrackHealth:
    """Follows the best log-likelihood of each frame.

    Attributes:
        lost_since_s: when the track was lost; None while it is not.
        shortfall: nats below the usual, in the latest frame; of the likelihood flattened as it usually is.
        absence: why no arm can be at the estimated pose, in the latest frame; "" if one can.
    """

    def __init__(self, options: HealthOptions | None = None) -> None:
        self.options = options if options is not None else HealthOptions()
        self.lost_since_s: float | None = None
        self.shortfall = 0.0
        self.absence = ""
        self._absent_s = 0.0
        self._usual, self._variance, self._temper = 0.0, 0.0, 1.0
        self._learned_s = 0.0
        self._bad_s, self._good_s = 0.0, 0.0

    @property
    def lost(self) -> bool:
        """Whether the track is lost."""
        return self.lost_since_s is not None

    def update(
        self, time_s: float, elapsed_s: float, best: float, temper: float = 1.0, presence: Presence | None = None
    ) -> None:
        """Takes the best log-likelihood of a frame that came `elapsed_s` after the one before, and its exponent."""
        self.absence = "" if presence is None else self._absence(presence)
        self._absent_s = self._absent_s + elapsed_s if self.absence else 0.0
        settled = self._learned_s >= self.options.settle_s
        self.shortfall = self._temper * (self._usual - best) if settled else 0.0
        minimum = self.options.min_log_likelihood
        allowed = self._allowed() * (self.options.found_fraction if self.lost else 1.0)
        bad = bool(self.absence) or (settled and self.shortfall > allowed) or (minimum is not None and best < minimum)
        self._bad_s = self._bad_s + elapsed_s if bad else 0.0
        self._good_s = 0.0 if bad else self._good_s + elapsed_s
        if not bad and not self.lost:
            self._learn(elapsed_s, best, temper)
        gone = self._bad_s >= self.options.lost_after_s or self._absent_s >= self.options.absent_after_s
        if not self.lost and gone:
            self.lost_since_s = time_s
        elif self.lost and self._good_s >= self.options.found_after_s:
            self.lost_since_s = None

    def _absence(self, presence: Presence) -> str:
        maximum = self.options.max_changed * (HYSTERESIS if self.lost else 1.0)
        if presence.changed > maximum:
            return (
                f"the images changed in {presence.changed:.1f} times the arm's area: somebody came or left, or a "
                "camera was moved"
            )
        return "only the background is visible where it should be" if presence.there < self.options.min_there else ""

    def _allowed(self) -> float:
        usual = self.options.drop_deviations * self._temper * float(np.sqrt(self._variance))
        return min(max(self.options.min_drop, usual), self.options.max_drop)

    def _learn(self, elapsed_s: float, best: float, temper: float) -> None:
        """Updates mean and downward deviation over the latest `memory_s`, or the whole track while it is shorter."""
        settling = self._learned_s < self.options.settle_s
        self._learned_s += elapsed_s
        gain = min(1.0, max(elapsed_s, 1e-3) / min(max(self._learned_s, 1e-3), self.options.memory_s))
        difference = best - self._usual
        self._temper += gain * (temper - self._temper)
        if difference > 0.0 and not settling:
            self._usual += self.options.rise * gain * difference
            self._variance *= 1.0 - gain
            return
        self._usual += gain * difference
        # Twice the mean square of what is below is the variance of a symmetric distribution.
        self._variance = (1.0 - gain) * (self._variance + (1.0 if settling else 2.0) * gain * difference**2)
