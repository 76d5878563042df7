"""The peers of the comparison, each with its default and its tuned row."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import product
from operator import call
from typing import Any

from studies.movements.method import BEGINNINGS, CLASSES, Method
from studies.movements.per_action import ByElapsedTime, PerAction
from studies.movements.sweep import Row
from studies.peers.gaussian_process import FrameProcess
from studies.peers.hidden_markov import CellHMMs, GaussianHMM
from studies.peers.input_driven_hmm import InputDrivenHMM
from studies.peers.minirocket import MiniRocket
from studies.peers.nearest import NearestByWarping
from studies.peers.promp import ContextualProMP
from studies.peers.ridge import AlignedRidge, FrameRidge, MotionRidge
from studies.peers.tuning import Tuned

Parameters = dict[str, Any]


def grid_of(**values: list[Any]) -> list[Parameters]:
    """All combinations of some values of hyper-parameters."""
    return [dict(zip(values, chosen, strict=True)) for chosen in product(*values.values())]


def one_action(make_one: Callable[[], Method]) -> Method:
    """A model of one action; with several a classifier of whole movements and of beginnings as well."""
    can = make_one().can | {CLASSES}
    return ByElapsedTime(partial(PerAction, make_one, can), can | {BEGINNINGS})


def one_action_whole(make_one: Callable[[], Method]) -> Method:
    """As `one_action` without beginnings: for models that take too long to be trained once per elapsed time."""
    can = make_one().can | {CLASSES}
    return PerAction(make_one, can)


def classifier(make: Callable[[], Method]) -> Method:
    """A classifier, of beginnings as well."""
    return ByElapsedTime(make, make().can | {BEGINNINGS})


def both(
    name: str,
    kind: Callable[..., Method],
    candidates: list[Parameters],
    libraries: tuple[str, ...],
    *,
    whole: Callable[[Callable[[], Method]], Method] = one_action,
    **fixed: Any,
) -> list[Row]:
    """Default and tuned row of a kind of method with some parameters fixed."""

    def default(seed: int) -> Method:
        return whole(partial(kind, **fixed))

    def tuned(seed: int) -> Method:
        return whole(partial(Tuned, partial(kind, **fixed), candidates))

    return [
        Row(f"{name} (default)", default, repr(fixed), libraries),
        Row(f"{name} (tuned)", tuned, repr((fixed, candidates)), libraries),
    ]


def ridge_rows() -> list[Row]:
    """Alignment, principal components and ridge regression: the strong simple baseline."""
    candidates = grid_of(components=[4, 8, 16], degree=[1, 2])
    rest = (AlignedRidge, candidates, ("tslearn", "scikit-learn"))
    return [
        Row("ridge from all frames", _seedless(FrameRidge), "", ("scikit-learn",)),
        *(Row(name, _seedless(partial(MotionRidge, *of)), repr(of), ("scikit-learn",)) for name, of in MOVING.items()),
        *both("DTW + PCA + quadratic ridge, diagonal", *rest),
        *both("DTW + PCA + quadratic ridge, full covariance", *rest, covariance="full"),
        *both("PCA + quadratic ridge, full covariance", *rest, covariance="full", warped=False),
    ]


MOVING: dict[str, tuple[Any, Any]] = {
    "ridge from position and velocity": ("all", "position and velocity"),
    "ridge from the fingertip's position": ("fingertip", "position"),
    "ridge from the fingertip's position and velocity": ("fingertip", "position and velocity"),
    "ridge from the fingertip at constant velocity": ("fingertip", "constant velocity"),
}


def _seedless(make: Callable[[], Method]) -> Callable[[int], Method]:
    return lambda seed: make()


def gaussian_process_rows() -> list[Row]:
    """Gaussian processes on resampled frames."""
    candidates = grid_of(components=[4, 8, 16])
    return both("Gaussian processes", FrameProcess, candidates, ("scikit-learn",), whole=call)


def promp_rows() -> list[Row]:
    """Probabilistic movement primitives with quadratic context."""
    candidates = grid_of(weights=[8, 15], degree=[1, 2], noise_m=[0.003, 0.01, 0.03])
    rest = (ContextualProMP, candidates, ("movement-primitives", "gmr", "tslearn"))
    return [
        *both("ProMP, quadratic context, linear time", *rest),
        *both("ProMP, quadratic context, DTW-aligned", *rest, warped=True),
    ]


def hmm_rows() -> list[Row]:
    """Hidden Markov models: hmmlearn without parameters, dynamax with theta as its input."""
    plain = (grid_of(n_states=[10, 20, 30]), ("hmmlearn",))
    driven = (grid_of(n_states=[10, 20], floor_m=[0.003, 0.01]), ("dynamax", "jax"))
    return [
        *both("hmmlearn, one HMM per action", GaussianHMM, *plain),
        *both("hmmlearn, one HMM per target", CellHMMs, *plain),
        *both("dynamax LinearRegressionHMM, linear", InputDrivenHMM, *driven, whole=one_action_whole, degree=1),
        *both("dynamax LinearRegressionHMM, quadratic", InputDrivenHMM, *driven, whole=one_action_whole, degree=2),
    ]


def classifier_rows() -> list[Row]:
    """Classification and regression of time series."""
    rocket = (grid_of(kernels=[1_000, 10_000]), ("sktime", "scikit-learn"))
    nearest = (grid_of(neighbours=[1, 3, 5], radius=[10, None]), ("tslearn",))
    return [
        *both("MiniRocket", MiniRocket, *rocket, whole=classifier),
        *both("kNN-DTW", NearestByWarping, *nearest, whole=classifier),
    ]


def peer_rows() -> list[Row]:
    """All rows of other people's methods."""
    return [*ridge_rows(), *gaussian_process_rows(), *promp_rows(), *classifier_rows(), *hmm_rows()]
