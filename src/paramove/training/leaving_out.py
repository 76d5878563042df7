"""Cross-validation of a kind of model: whole parameters or persons are left out."""

from __future__ import annotations

import itertools
import warnings
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from scipy.spatial import Delaunay, QhullError

from paramove.alignment import movement_distance
from paramove.documents import Floats
from paramove.hmm import resample
from paramove.phmm import ExtrapolationWarning, InterpolativePHMM, ParametricHMM, UnlikelyMovementWarning, groups_of
from paramove.training.examples import Examples, is_place
from paramove.training.plots import levels_of

LeftOutBy = Literal["theta", "subject", "repetition"]

MAX_FOLDS = 10
HULL_DIMENSIONS = 4
FRAMES = 100
"""Movements are compared after resampling to this many frames."""
REGION = 0.95
"""Confidence level of the regions of theta."""


class LeftOut(NamedTuple):
    """Result for one movement, from a model that was trained without its group.

    Attributes:
        number: of the movement in the examples.
        theta: as labelled, shape (P,).
        estimated: from the movement, shape (P,).
        deviation: standard deviations of the estimate, shape (P,).
        covered: whether the 95 % region of the estimate holds the label.
        synthesis: root mean square distance of the synthesised from the recorded body points after time warping, m.
        outside: whether theta lies outside the training's thetas, so that the model had to extrapolate.
    """

    number: int
    theta: Floats
    estimated: Floats
    deviation: Floats
    covered: bool
    synthesis: float
    outside: bool


@dataclass(frozen=True)
class LeaveOutResult:
    """Results for all movements, each from a model that was trained without its group.

    Attributes:
        by: what a group is.
        folds: how many models were trained.
        movements: in the order of the examples.
        parameter_names: of theta.
    """

    by: LeftOutBy
    folds: int
    movements: tuple[LeftOut, ...]
    parameter_names: tuple[str, ...]

    def summary(self) -> dict[str, Any]:
        """Numbers for people and JSON: errors of theta and synthesis, fraction of regions that hold the label."""
        errors = np.stack([one.estimated - one.theta for one in self.movements])
        by_name = zip(self.parameter_names, np.sqrt((errors**2).mean(axis=0)).tolist(), strict=True)
        synthesis = np.array([one.synthesis for one in self.movements])
        result: dict[str, Any] = {
            "left_out": self.by,
            "folds": self.folds,
            "movements": len(self.movements),
            "outside_the_training": sum(one.outside for one in self.movements),
            "theta_rms": dict(by_name),
            "theta_covered": float(np.mean([one.covered for one in self.movements])),
            "synthesis_median_m": float(np.median(synthesis)),
            "synthesis_p95_m": float(np.percentile(synthesis, 95)),
        }
        if all(is_place(name) for name in self.parameter_names):
            distances = np.linalg.norm(errors, axis=1)
            result["theta_median_m"] = float(np.median(distances))
            result["theta_p95_m"] = float(np.percentile(distances, 95))
        return result


def leave_out(
    examples: Examples,
    make: Callable[[], ParametricHMM],
    by: LeftOutBy = "theta",
    finished: Callable[[int, int], None] | None = None,
) -> LeaveOutResult:
    """Train again without each group of movements, and test these models on it.

    Args:
        examples: of one action.
        make: gives the untrained model.
        by: what is left out together: all movements of one theta, of one person, or each n-th movement of every theta.
            An InterpolativePHMM needs every theta: for it repetitions are left out.
        finished: called after each fold with the number of finished folds and of all folds.

    Raises ValueError if there is only one group, if without one all others have the same theta, or if a fold cannot be
    trained.
    """
    if by == "theta" and isinstance(make(), InterpolativePHMM):
        by = "repetition"
    folds = _folds(examples, by)
    if len(folds) < 2:
        raise ValueError(f"there is only one {by}: nothing can be left out")
    results: list[LeftOut] = []
    for number, tested in enumerate(folds):
        rest = examples.of([one for one in range(len(examples)) if one not in tested])
        if (rest.theta == rest.theta[0]).all():
            raise ValueError(
                f"without one {by} all others have the theta {rest.theta[0].tolist()}, so that nothing can be tested; "
                "add movements with a third theta, or leave nothing out (--leave-out none)"
            )
        model = make().fit(rest.sequences, rest.theta, rest.groups)
        results += [_tested(model, examples, one, rest) for one in tested]
        if finished is not None:
            finished(number + 1, len(folds))
    return LeaveOutResult(by, len(folds), tuple(sorted(results, key=lambda one: one.number)), examples.parameter_names)


def covers(estimated: Floats, covariance: Floats, theta: Floats) -> bool:
    """Whether the 95 % region of an estimate holds theta."""
    return bool(levels_of(theta[None], estimated[None], covariance[None])[0] <= REGION)


def _folds(examples: Examples, by: LeftOutBy) -> list[list[int]]:
    """Numbers of the movements that are left out together; groups share folds where there are many."""
    theta = groups_of(None, examples.theta)
    if by == "repetition":
        repetitions: dict[int, Iterator[int]] = defaultdict(itertools.count)
        groups = [next(repetitions[cell]) for cell in theta.tolist()]
    else:
        names = examples.subjects if by == "subject" else None
        groups = groups_of(names, examples.theta).tolist()
    count = min(MAX_FOLDS, len(set(groups)))
    return [[one for one, group in enumerate(groups) if group % count == fold] for fold in range(count)]


def _tested(model: ParametricHMM, examples: Examples, number: int, rest: Examples) -> LeftOut:
    sequence, theta = examples.sequences[number], examples.theta[number]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnlikelyMovementWarning)  # what hardly fits was named before the training
        estimate = model.estimate(sequence)
    return LeftOut(
        number,
        theta,
        estimate.theta,
        np.sqrt(np.diagonal(estimate.covariance)),
        covers(estimate.theta, estimate.covariance, theta),
        synthesis_error(model, theta, sequence, len(examples.point_names)),
        is_outside(theta, rest.theta),
    )


def is_outside(theta: Floats, trained: Floats) -> bool:
    """Whether theta (P,) lies outside the convex hull of trained ones (K, P); or their bounds, if many or flat."""
    low, high = trained.min(axis=0), trained.max(axis=0)
    scale = np.maximum(high - low, 1e-9)
    slack = 1e-6 * scale
    if ((theta < low - slack) | (theta > high + slack)).any():
        return True
    if not 2 <= len(theta) <= HULL_DIMENSIONS:
        return False
    try:
        hull = Delaunay((trained - low) / scale)
    except QhullError:
        return False
    return bool(hull.find_simplex((theta - low) / scale, tol=1e-6) < 0)


def synthesis_error(model: ParametricHMM, theta: Floats, sequence: Floats, n_points: int) -> float:
    """Root mean square distance of body points between the synthesis for theta and a recording (T, D), warped."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExtrapolationWarning)  # `outside` says so
        synthesised = model.synthesize(theta, FRAMES)
    return movement_distance(synthesised, resample(sequence, FRAMES), n_points=n_points, cut=0.0)
