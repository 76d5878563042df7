"""State probabilities frame by frame, without looking ahead: for use while a movement is observed (thesis 2.1.4.2).

The forward variables of (2.7), as logarithms and divided by their sum after each frame.
"""

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats
from paramove.hmm.chain import ChainEvaluator
from paramove.hmm.sequences import checked_sequence


class OnlineFilter(ABC):
    """Estimates the state of a movement after each frame.

    Attributes:
        log_likelihood: ln p(x_1..x_t | lambda), of the beginning only, whatever its end.
        n_frames: t.
    """

    def __init__(self, means: Floats, whitening: Floats, log_norm: Floats, log_start: Floats) -> None:
        self._means, self._whitening, self._log_norm = means, whitening, log_norm
        self._log_state = log_start
        """Log probabilities of the state after the frames so far; of the first frame's state while there is none."""
        self.log_likelihood = 0.0
        self.n_frames = 0

    def update(self, frame: ArrayLike) -> Floats:
        """p(q_t = i | x_1..x_t) after one more frame of shape (D,). Shape (N,).

        Raises ValueError for a bad frame, and where the model excludes the frames so far: a movement that is too long
        for its durations. The filter is then unchanged.
        """
        checked = checked_sequence(np.atleast_2d(np.asarray(frame, dtype=np.float64)), self._means.shape[1])[0]
        white = np.einsum("ijk,ik->ij", self._whitening, checked - self._means)
        log_output = self._log_norm - 0.5 * np.einsum("ij,ij->i", white, white)
        with np.errstate(divide="ignore"):
            predicted = self._predicted() if self.n_frames else self._log_state
        joint = predicted + log_output.reshape((-1,) + (1,) * (predicted.ndim - 1))
        gain = float(np.logaddexp.reduce(joint, axis=None))
        if not np.isfinite(gain):
            raise ValueError(
                f"the model has no path for frame {self.n_frames + 1} of this movement: it allows fewer frames; "
                "begin a new filter where a new movement begins"
            )
        self._log_state = joint - gain
        self.log_likelihood += gain
        self.n_frames += 1
        return self.posterior()

    @abstractmethod
    def posterior(self) -> Floats:
        """p(q_t = i | x_1..x_t). Shape (N,)."""

    @abstractmethod
    def finish_probability(self) -> float:
        """p(the movement ends with this frame | x_1..x_t), from the transition into the finish state."""

    @abstractmethod
    def _predicted(self) -> Floats:
        """Log probabilities of the state of the next frame, after at least one."""


class ChainFilter(OnlineFilter):
    """For a plain chain; with a finish state the movement has not ended while frames arrive."""

    def __init__(self, evaluator: ChainEvaluator) -> None:
        super().__init__(evaluator.parameters.means, evaluator.whitening, evaluator.log_norm, evaluator.log_start)
        self._evaluator = evaluator

    def posterior(self) -> Floats:
        """p(q_t = i | x_1..x_t); before the first frame p(q_1 = i). Shape (N,)."""
        return np.exp(self._log_state)

    def finish_probability(self) -> float:
        """p(the movement ends with this frame | x_1..x_t)."""
        return float(self.posterior() @ self._evaluator.parameters.exits) if self.n_frames else 0.0

    def _predicted(self) -> Floats:
        result: Floats = np.logaddexp.reduce(self._log_state[:, None] + self._evaluator.log_transitions, axis=0)
        return result


class DurationFilter(OnlineFilter):
    """For a left-right HMM with explicit durations: state and frames spent in it so far."""

    def __init__(self, durations: Floats, means: Floats, whitening: Floats, log_norm: Floats) -> None:
        start = np.full(durations.shape, -np.inf)
        start[0, 0] = 0.0
        super().__init__(means, whitening, log_norm, start)
        lasting = np.cumsum(durations[:, ::-1], axis=1)[:, ::-1]  # p(at least d frames)
        with np.errstate(divide="ignore", invalid="ignore"):
            leave = np.where(lasting > 0, durations / lasting, 1.0)
            self._log_leave, self._log_stay = np.log(leave), np.log(np.clip(1.0 - leave[:, :-1], 0.0, 1.0))

    def posterior(self) -> Floats:
        """p(q_t = i | x_1..x_t); before the first frame the first state. Shape (N,)."""
        result: Floats = np.exp(self._log_state).sum(axis=1)
        return result

    def finish_probability(self) -> float:
        """p(the movement ends with this frame | x_1..x_t)."""
        return float(np.exp(self._log_state[-1] + self._log_leave[-1]).sum()) if self.n_frames else 0.0

    def _predicted(self) -> Floats:
        result: Floats = np.full(self._log_leave.shape, -np.inf)
        result[1:, 0] = np.logaddexp.reduce(self._log_state[:-1] + self._log_leave[:-1], axis=1)
        result[:, 1:] = self._log_state[:, :-1] + self._log_stay
        return result
