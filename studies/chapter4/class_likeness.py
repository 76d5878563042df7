"""How alike the synthetic demonstrator's pointing and reaching are: how well a plain HMM per class separates them.

The data set is that of thesis 4.2.1. The HMM of hmmlearn knows neither the target nor durations, so its rate measures
the difficulty of the data, not our models: the thesis speaks of two actions that are "not easy to distinguish".
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from paramove.demonstrations import Action, Demonstrator, demonstrations_at, table_targets
from paramove.documents import Floats
from paramove.hmm import resample

ACTIONS: tuple[Action, ...] = ("pointing", "reaching")
STATES, FRAMES = 20, 100


def hmmlearn_class_accuracy(seed: int, *, demonstrator: Demonstrator | None = None) -> float:
    """Fraction of 280 movements that the likelier of two plain left-right HMMs classifies correctly.

    Trained on the 3 x 3 grid with 10 repetitions, tested on the 7 x 5 grid with 4 (thesis 4.2.1); 20 states,
    diagonal covariances, 100 frames of 21 coordinates in m. Raises ImportError without hmmlearn, a development tool.
    """
    rng = np.random.default_rng(seed)
    training = {action: grid_movements(action, (3, 3), 10, rng, demonstrator) for action in ACTIONS}
    models = [_trained(training[action]) for action in ACTIONS]
    right = 0
    for number, action in enumerate(ACTIONS):
        for movement in grid_movements(action, (7, 5), 4, rng, demonstrator):
            right += int(np.argmax([model.score(movement) for model in models])) == number
    return right / 280.0


def grid_movements(
    action: Action,
    shape: tuple[int, int],
    repetitions: int,
    rng: np.random.Generator,
    demonstrator: Demonstrator | None = None,
) -> list[Floats]:
    """Movements to each point of a grid over the table, 100 frames each, shape (100, 21), m."""
    targets = table_targets(*shape)[0]
    demonstrations = demonstrations_at(targets, rng, action=action, repetitions=repetitions, demonstrator=demonstrator)
    return [resample(one, FRAMES) for one in demonstrations.sequences]


def _trained(movements: Sequence[Floats]) -> Any:
    from hmmlearn.hmm import GaussianHMM

    segments = np.stack([one.reshape(STATES, FRAMES // STATES, -1) for one in movements], axis=1)
    pooled = segments.reshape(STATES, -1, segments.shape[-1])
    model = GaussianHMM(STATES, "diag", init_params="", params="tmc")
    model.startprob_ = np.eye(STATES)[0]
    leave = STATES / FRAMES
    model.transmat_ = (1.0 - leave) * np.eye(STATES) + leave * np.eye(STATES, k=1)
    model.transmat_[-1, -1] = 1.0
    model.means_, model.covars_ = pooled.mean(axis=1), pooled.var(axis=1)
    return model.fit(np.concatenate(movements), [FRAMES] * len(movements))
