"""How many demonstrations are needed: fewer repetitions, and fewer or more targets."""

from __future__ import annotations

from typing import Any

import numpy as np

from studies.chapter4.grid import REPETITIONS, MovementSet, denser_training, grid, references
from studies.chapter4.kinds import BY_NAME, CPHMM_3, IPHMM_3, LPHMM_3, OURS, QPHMM_3
from studies.chapter4.measurement import synthesis_errors
from studies.movements.measures import theta_error

LEARNERS = (IPHMM_3, LPHMM_3 + OURS, QPHMM_3 + OURS, CPHMM_3 + OURS)
"""Compared kinds; with another grid, "3×3" in a name stands for that grid."""
TRAININGS = (*((3, repetitions) for repetitions in (1, 2, 3, 5, 10)), (2, 10), (6, 10))
"""Targets per side of the grid, and repetitions at each."""
STATES = 20


def measured_learning(name: str, side: int, repetitions: int, seed: int) -> dict[str, Any]:
    """Synthesis error and error of theta of pointing, cm, learned from `side` x `side` targets."""
    tests = grid(seed).test["pointing"]
    training = _training(seed, side, repetitions)
    model = BY_NAME[name].untrained(STATES).fit(training.sequences, training.theta)
    cases = zip(tests.sequences[::REPETITIONS], tests.theta[::REPETITIONS], strict=True)
    return {
        "values": {
            "synthesis": synthesis_errors(model, references(seed, "pointing"), tests.theta),
            "theta": [theta_error(model.estimate(x).theta, target, "raster") for x, target in cases],
        }
    }


def _training(seed: int, side: int, repetitions: int) -> MovementSet:
    training = grid(seed).train["pointing"]
    if side == 3:
        return training.repeated(repetitions)
    if side == 2:
        return training.at_corners().repeated(repetitions)
    return denser_training(seed, side, side, repetitions, "pointing")


def able(name: str, side: int, repetitions: int) -> bool:
    """A local HMM of a grid needs more than one movement; cubics need at least 6 targets per side."""
    return not (name == IPHMM_3 and repetitions == 1) and not (name == CPHMM_3 + OURS and side < 6)


def count_of(side: int, repetitions: int) -> int:
    """Demonstrations in all."""
    return int(np.square(side)) * repetitions
