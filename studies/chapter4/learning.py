"""How many demonstrations are needed: fewer repetitions, and fewer or more places."""

from __future__ import annotations

from typing import Any

import numpy as np

from studies.chapter4.kinds import BY_NAME, CPHMM_3, IPHMM_3, LPHMM_3, OURS, QPHMM_3
from studies.chapter4.measurement import synthesis_errors
from studies.chapter4.raster import REPETITIONS, Shown, denser_training, raster, references
from studies.movements.measures import theta_error

LEARNERS = (IPHMM_3, LPHMM_3 + OURS, QPHMM_3 + OURS, CPHMM_3 + OURS)
"""Kinds that are shown; on another raster the names mean that raster."""
TRAININGS = (*((3, repetitions) for repetitions in (1, 2, 3, 5, 10)), (2, 10), (6, 10))
"""Places per side of the raster, and repetitions at each."""
STATES = 20


def measured_learning(name: str, side: int, repetitions: int, seed: int) -> dict[str, Any]:
    """Synthesis error and error of theta of pointing, cm, learned from `side` x `side` places."""
    tests = raster(seed).test["pointing"]
    shown = _training(seed, side, repetitions)
    model = BY_NAME[name].untrained(STATES).fit(shown.sequences, shown.places)
    asked = zip(tests.sequences[::REPETITIONS], tests.places[::REPETITIONS], strict=True)
    return {
        "values": {
            "synthesis": synthesis_errors(model, references(seed, "pointing"), tests.places),
            "theta": [theta_error(model.estimate(x).theta, place, "raster") for x, place in asked],
        }
    }


def _training(seed: int, side: int, repetitions: int) -> Shown:
    shown = raster(seed).train["pointing"]
    if side == 3:
        return shown.repeated(repetitions)
    if side == 2:
        return shown.at_corners().repeated(repetitions)
    return denser_training(seed, side, side, repetitions, "pointing")


def able(name: str, side: int, repetitions: int) -> bool:
    """A local HMM of a grid needs more than one movement; cubics are shown where there are places enough."""
    return not (name == IPHMM_3 and repetitions == 1) and not (name == CPHMM_3 + OURS and side < 6)


def count_of(side: int, repetitions: int) -> int:
    """Demonstrations in all."""
    return int(np.square(side)) * repetitions
