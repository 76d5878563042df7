"""Movements to grids of targets on the table, as the thesis recorded them (4.2.1), by the synthetic demonstrator."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from paramove.demonstrations import SAMPLE_RATE_HZ, Action, demonstrations_at, redirect_demonstrations, table_targets
from paramove.documents import Floats, Ints
from paramove.hmm import LeftRightHMM, resample
from studies.movements.tasks import grid_tasks

ACTIONS: tuple[Action, ...] = ("pointing", "reaching")
COLUMNS, ROWS, REPETITIONS = 7, 5, 4
FRAMES = 100
REFERENCE_STATES, REFERENCE_FRAMES, COMPARED_SAMPLES = 80, 200, 200
REDIRECT_S = 4.2
OTHER_MOVEMENTS = 35


@dataclass(frozen=True)
class MovementSet:
    """Movements (T_k, 21), m, at 60 Hz, and theta, their targets (u, v) in [0, 1], shape (K, 2)."""

    sequences: tuple[Floats, ...]
    theta: Floats

    def at_corners(self) -> MovementSet:
        """Those to the four corners of the region."""
        return self._chosen(np.flatnonzero(np.isin(self.theta, (0.0, 1.0)).all(axis=1)))

    def repeated(self, repetitions: int) -> MovementSet:
        """The first so many movements to each target."""
        count: dict[tuple[float, ...], int] = {}
        chosen = []
        for number, target in enumerate(map(tuple, self.theta.tolist())):
            count[target] = count.get(target, 0) + 1
            if count[target] <= repetitions:
                chosen.append(number)
        return self._chosen(np.array(chosen))

    def _chosen(self, numbers: Ints) -> MovementSet:
        return MovementSet(tuple(self.sequences[number] for number in numbers.tolist()), self.theta[numbers])


@dataclass(frozen=True)
class Grid:
    """Training on 3 x 3 targets, 10 times each, and tests on 7 x 5 targets, 4 times each, of every action."""

    train: Mapping[str, MovementSet]
    test: Mapping[str, MovementSet]


@lru_cache(maxsize=2)
def grid(seed: int) -> Grid:
    """The movements of one seed: the same that `python -m studies peers` gives to every method."""
    tasks = grid_tasks((seed,))
    folds = {action: tasks[f"raster/{action}"][0] for action in ACTIONS}
    train: dict[str, MovementSet] = {
        action: MovementSet(tuple(fold.train.sequences), fold.train.theta) for action, fold in folds.items()
    }
    test: dict[str, MovementSet] = {
        action: MovementSet(tuple(fold.test.sequences), fold.test.theta) for action, fold in folds.items()
    }
    return Grid(train, test)


@lru_cache(maxsize=4)
def references(seed: int, action: str) -> Floats:
    """The average of the test movements to each of the 35 targets, from an 80-state HMM (4.2.4). (35, 200, 21), m."""
    tests = grid(seed).test[action]
    averages = []
    for first in range(0, len(tests.sequences), REPETITIONS):
        frames = [resample(one, REFERENCE_FRAMES) for one in tests.sequences[first : first + REPETITIONS]]
        model = LeftRightHMM(REFERENCE_STATES, 2, 3).fit(frames)
        averages.append(model.synthesize(COMPARED_SAMPLES))
    return np.stack(averages)


def denser_training(seed: int, columns: int, rows: int, repetitions: int, action: Action) -> MovementSet:
    """Training movements to a grid of another size."""
    targets, theta = table_targets(columns, rows)
    rng = np.random.default_rng([seed, 2, columns, ACTIONS.index(action)])
    demonstrations = demonstrations_at(targets, rng, action=action, repetitions=repetitions)
    return MovementSet(tuple(demonstrations.sequences), np.repeat(theta, repetitions, axis=0))


def redirects(seed: int, count: int = OTHER_MOVEMENTS) -> list[Floats]:
    """Movements of another kind: to one target, over to another, and back (4.3), both drawn over the region."""
    rng = np.random.default_rng([seed, 3])
    pairs = rng.uniform(0.0, 1.0, (count, 4))
    samples = round(REDIRECT_S * SAMPLE_RATE_HZ)
    return redirect_demonstrations(pairs, rng, n_samples=samples).sequences
