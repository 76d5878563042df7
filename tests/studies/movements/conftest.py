"""Folds and methods that are small and quick."""

from pathlib import Path

import numpy as np
import pytest

from paramove.documents.array_types import Floats
from paramove.hmm import resample
from studies.movements.method import BEGINNINGS, CLASSES, OUTLIERS, SYNTHESIS, THETA, Estimate, Examples, NotAble
from studies.movements.tasks import Fold, real_tasks
from tests.demonstrations.synthetic_recordings import write_pointing, write_table


class MeanPath(NotAble):
    """The mean movement; theta is the mean of the training; the action is that of the nearest mean."""

    can = frozenset({SYNTHESIS, THETA, CLASSES, BEGINNINGS, OUTLIERS})

    def fit(self, examples: Examples) -> None:
        self.means = {
            action: np.mean([resample(x, 100) for x in examples.of(action).sequences], axis=0)
            for action in examples.actions
        }
        self.theta = examples.theta.mean(axis=0)

    def synthesize(self, theta: Floats, n: int) -> Floats:
        return resample(next(iter(self.means.values())), n)

    def estimate(self, x: Floats) -> Estimate:
        return Estimate(self.theta, 100.0 * np.eye(len(self.theta)))

    def classify(self, x: Floats, finished: bool) -> str:
        return min(self.means, key=lambda action: float(((resample(x, 100) - self.means[action]) ** 2).sum()))

    def score(self, x: Floats) -> float:
        return -float(((resample(x, 100) - next(iter(self.means.values()))) ** 2).sum())


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recordings")
    write_table(path)
    write_pointing(path)
    return path


@pytest.fixture(scope="session")
def tasks(folder: Path) -> dict[str, list[Fold]]:
    return real_tasks(folder)
