"""Which movement models can be trained by name, and with which states."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Literal

from paramove import hmm, phmm

if TYPE_CHECKING:
    from paramove.phmm import MovementDescription, ParametricHMM


Kind = Literal["best", "linear", "quadratic", "cubic", "neural", "interpolative"]
"""Names of the models. `best` is the current recommendation: quadratic means with correlated residuals."""
CLASSES: dict[str, str] = {
    "best": "QuadraticPHMM",
    "linear": "LinearPHMM",
    "quadratic": "QuadraticPHMM",
    "cubic": "CubicPHMM",
    "neural": "NeuralPHMM",
    "interpolative": "InterpolativePHMM",
}
DEFAULT_STATES = 20
DEFAULT_FRAMES = 100


def untrained(
    kind: str,
    *,
    description: MovementDescription | None = None,
    n_states: int = DEFAULT_STATES,
    d_min: int | None = None,
    d_max: int | None = None,
    frames: int = DEFAULT_FRAMES,
    residuals: str | None = None,
    floor_deviation: float = 0.0,
) -> ParametricHMM:
    """A model of one of the CLASSES, to be trained.

    Args:
        kind: its name.
        description: of the action.
        n_states: number of states.
        d_min, d_max: frames in a state; None: one less and one more than the mean, `frames / n_states`.
        frames: every movement is resampled to this many.
        floor_deviation: best accuracy of the points, m; 0: estimated from their variation.
        residuals: "correlated" or "independent"; None: the default of the model.

    Raises ValueError for a kind that is unknown or has no such residuals, and for states that do not fit the frames.
    """
    if kind not in CLASSES:
        raise ValueError(f"there is no model '{kind}'; there are {', '.join(CLASSES)}")
    mean = frames / n_states
    if mean < 1.0:
        raise ValueError(f"{frames} frames are fewer than {n_states} states: give more --frames or fewer --states")
    minimum = d_min if d_min is not None else max(1, math.floor(mean) - 1)
    maximum = d_max if d_max is not None else math.ceil(mean) + 1
    if not minimum <= mean <= maximum:
        raise ValueError(
            f"{frames} frames in {n_states} states are {mean:g} a state, but d_min is {minimum} and d_max is "
            f"{maximum}: the mean lies between them"
        )
    kind_class: Any = getattr(phmm, CLASSES[kind])
    arguments: dict[str, Any] = {} if residuals is None else {"residuals": residuals}
    if arguments and "residuals" not in kind_class._parameter_names():
        raise ValueError(f"a model '{kind}' has no choice of residuals; all others have")
    if floor_deviation:
        arguments["options"] = hmm.TrainingOptions(floor_deviation=floor_deviation)
    model: ParametricHMM = kind_class(
        n_states, minimum, maximum, resampled_frames=frames, description=description, **arguments
    )
    return model


def kind_of(model: ParametricHMM) -> str:
    """The model in words: class and, where it has them, degree and residuals."""
    parts = [type(model).__name__]
    if hasattr(model, "degree"):
        parts.append(f"degree {model.degree}")
    if hasattr(model, "residuals"):
        parts.append(f"{model.residuals} residuals")
    return ", ".join(parts)
