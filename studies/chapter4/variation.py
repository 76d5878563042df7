"""How much the repetitions of the synthetic demonstrator differ, and what no model can know (4.2.4, 4.2.5)."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np

from paramove.alignment import movement_distance
from paramove.demonstrations import POINT_NAMES, Demonstrator, Variation, table_place, table_targets
from paramove.hmm import LeftRightHMM, resample
from studies.chapter4.class_likeness import hmmlearn_class_accuracy
from studies.chapter4.grid import (
    ACTIONS,
    COLUMNS,
    COMPARED_SAMPLES,
    FRAMES,
    REPETITIONS,
    ROWS,
    grid,
    references,
)
from studies.chapter4.kinds import BY_NAME, IPHMM_3, LINEAR_FIT, LPHMM_3, QUADRATIC_FIT, RESTRICTIONS
from studies.chapter4.measurement import synthesis_errors, trained

AT_TARGET = 45
"""Frame of 100 in which the finger is at the target."""
CORNERS = ((0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0))


def natural_variation(seed: int, maximum: int = 14) -> dict[str, Any]:
    """Distances (4.3) of pairs of up to `maximum` pointing movements to the centre and each corner, and the misses, cm.

    "prototype": distance of the demonstrator's own movement without any variation from the average of the four tests at
    each of the 35 targets: the part of a synthesis error that is that of the averages.
    """
    data = grid(seed)
    values: dict[str, list[float]] = {}
    for name, target in {"centre": (0.5, 0.5), **{f"corner {c}": c for c in CORNERS}}.items():
        movements = [
            resample(x, FRAMES)
            for part in (data.train["pointing"], data.test["pointing"])
            for x, own in zip(part.sequences, part.theta, strict=True)
            if np.allclose(own, target)
        ][:maximum]
        values[name] = [100.0 * movement_distance(a, b) for a, b in combinations(movements, 2)]
        if name == "centre":
            tips = np.stack([x.reshape(FRAMES, -1, 3)[AT_TARGET, POINT_NAMES.index("index")] for x in movements])
            values["miss"] = (100.0 * np.linalg.norm(tips - table_place(target), axis=1)).tolist()
    return {"values": values | {"prototype": _of_prototypes(seed)}}


def _of_prototypes(seed: int) -> list[float]:
    person, rng = Demonstrator(variation=Variation.none()), np.random.default_rng(0)
    averages = references(seed, "pointing")
    return [
        100.0 * movement_distance(resample(person.demonstrate("pointing", target, rng), COMPARED_SAMPLES), average)
        for target, average in zip(table_targets(COLUMNS, ROWS)[0], averages, strict=True)
    ]


def fit_to_references(seed: int) -> dict[str, Any]:
    """Synthesis errors of linear and quadratic PHMMs trained on the 35 averages themselves (figure 4.11)."""
    averages, targets = references(seed, "pointing"), grid(seed).test["pointing"].theta
    values = {}
    for kind, states in (LINEAR_FIT, QUADRATIC_FIT):
        model = kind.untrained(states).fit(list(averages), targets[::REPETITIONS])
        values[kind.name] = synthesis_errors(model, averages, targets)
    return {"values": values}


def likelihood_surfaces(seed: int, states: int, points: int) -> dict[str, Any]:
    """ln p(X | u, v) of the first test movement to the centre under an IPHMM and an LPHMM (figure 4.15).

    Values per model in the order of a grid of `points` x `points` targets over the region, u slower.
    """
    data = grid(seed)
    tests = data.test["pointing"]
    centre = int(np.flatnonzero(np.all(tests.theta == 0.5, axis=1))[0])
    line = np.linspace(0.0, 1.0, points)
    values, estimates = {}, {}
    for name in (IPHMM_3, LPHMM_3):
        model = trained(BY_NAME[name], states, data.train["pointing"])
        x = tests.sequences[centre]
        values[name] = [float(model.log_likelihood(x, (u, v))) for u in line for v in line]
        estimates[name] = model.estimate(x).theta.tolist()
    return {"values": values, "estimates": estimates}


def plain_rate(seed: int) -> dict[str, Any]:
    """Classification of the 280 tests by one HMM per action that knows no parameter, 20 states, full covariances."""
    data = grid(seed)
    models = []
    for action in ACTIONS:
        frames = [resample(x, FRAMES) for x in data.train[action].sequences]
        models.append(LeftRightHMM(20, *RESTRICTIONS[20]).fit(frames))
    right = []
    for number, action in enumerate(ACTIONS):
        for x in data.test[action].sequences:
            scores = [model.log_likelihood(resample(x, FRAMES)) for model in models]
            right.append(float(int(np.argmax(scores)) == number))
    return {"values": {"correct": right}}


def hmmlearn_rate(seed: int) -> dict[str, Any]:
    """Classification by plain HMMs of hmmlearn: the fraction of right answers. Raises ImportError without it."""
    return {"values": {"correct": [hmmlearn_class_accuracy(seed)]}}
