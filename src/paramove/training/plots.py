"""Pictures for arrays: movements of a model, estimates of theta, and whether regions hold what they promise.

Each draws into given axes or new ones and returns them, as plots of scikit-learn do.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtr, ndtri

from paramove.documents import Floats
from paramove.hmm import resample
from paramove.phmm import ParametricHMM
from paramove.training.drawing import ACTION_COLOURS, FAINT, INK, WARN, add_ellipse

if TYPE_CHECKING:  # matplotlib takes half a second, which only those who draw should wait
    from matplotlib.axes import Axes

FRAMES = 100
LEVELS = np.linspace(0.0, 1.0, 41)


def plot_movement(
    model: ParametricHMM,
    theta: ArrayLike,
    sequences: Sequence[ArrayLike] = (),
    *,
    component: int = 0,
    ax: Axes | None = None,
) -> Axes:
    """One component of the movements that a model makes for theta (P,) or (M, P), and where 95 % of the frames lie.

    Args:
        model: a trained one.
        theta: one or several.
        sequences: recorded movements (T_k, D) to compare with, drawn faintly.
        component: which of the D coordinates of a frame.
        ax: axes to draw into.
    """
    axes, progress = ax or _new_axes(7.0, 4.0), np.linspace(0.0, 1.0, FRAMES)
    for sequence in sequences:
        axes.plot(progress, resample(sequence, FRAMES)[:, component], color=FAINT, linewidth=0.8, zorder=0)
    for number, one in enumerate(np.atleast_2d(np.asarray(theta, dtype=np.float64))):
        colour = ACTION_COLOURS[number % len(ACTION_COLOURS)]
        made = model.synthesize(one, FRAMES)[:, component]
        widths = 1.96 * np.sqrt([model.progress_covariance(one, float(at))[component, component] for at in progress])
        axes.fill_between(progress, made - widths, made + widths, color=colour, alpha=0.15, linewidth=0.0)
        axes.plot(progress, made, color=colour, label="θ = " + ", ".join(f"{value:.3g}" for value in one))
    axes.set(xlabel="fraction of the movement", ylabel=f"component {component}")
    axes.legend(fontsize=8)
    return axes


def plot_theta(
    model: ParametricHMM, sequences: Sequence[ArrayLike], theta: ArrayLike | None = None, *, ax: Axes | None = None
) -> Axes:
    """Estimates of theta and their 95 % regions: ellipses of the first two components, or error bars of a single one.

    With labels (K, P) those whose region does not hold theta are red, and a line leads to the label.
    """
    axes = ax or _new_axes(5.5, 5.0)
    flat, covariances = model.predict(sequences, return_cov=True)
    estimated = flat.reshape(len(covariances), -1)
    labels = None if theta is None else np.asarray(theta, dtype=np.float64).reshape(estimated.shape)
    held = np.ones(len(estimated), bool) if labels is None else levels_of(labels, estimated, covariances) <= 0.95
    for number, (at, covariance) in enumerate(zip(estimated, covariances, strict=True)):
        colour = ACTION_COLOURS[0] if held[number] else WARN
        if estimated.shape[1] == 1:
            axes.errorbar(
                number if labels is None else labels[number, 0], at[0], yerr=1.96 * np.sqrt(covariance[0, 0]), fmt="o",
                color=colour, markersize=3,
            )  # fmt: skip
            continue
        add_ellipse(axes, at[:2], covariance[:2, :2], colour, alpha=0.2)
        axes.plot(*at[:2], "o", color=colour, markersize=3)
        if labels is not None:
            axes.plot(*np.stack([at[:2], labels[number, :2]]).T, "-", color=INK, linewidth=0.6)
            axes.plot(*labels[number, :2], "+", color=INK, markersize=5)
    if estimated.shape[1] == 1:
        if labels is not None:
            axes.plot(labels[:, 0], labels[:, 0], "-", color=FAINT, zorder=0)
        axes.set(xlabel="movement" if labels is None else "labelled θ", ylabel="estimated θ")
    else:
        axes.set(xlabel="θ, first component", ylabel="θ, second component", aspect="equal")
        axes.autoscale_view()
    return axes


def plot_coverage(
    theta: ArrayLike, estimated: ArrayLike, covariances: ArrayLike, *, label: str | None = None, ax: Axes | None = None
) -> Axes:
    """How many regions of theta hold it, against how many should: on the diagonal a model is honest.

    Below it regions are too small, above too large. The grey band holds an honest model with 95 % probability.

    Args:
        theta: labels of movements that did not train the model, (K, P).
        estimated, covariances: as of `predict(X, return_cov=True)`, (K, P) and (K, P, P).
        label: for the legend. ax: axes to draw into.
    """
    new = ax is None
    axes = ax or _new_axes(4.6, 4.4)
    levels = levels_of(*(np.asarray(one, dtype=np.float64) for one in (theta, estimated, covariances)))
    if new or not axes.lines:
        half = ndtri(0.975) * np.sqrt(LEVELS * (1.0 - LEVELS) / len(levels))
        axes.fill_between(
            100 * LEVELS, 100 * (LEVELS - half), 100 * (LEVELS + half), color=FAINT, alpha=0.4, linewidth=0
        )
        axes.plot([0, 100], [0, 100], "--", color=INK, linewidth=0.8)
    shares = np.mean(levels[:, None] <= LEVELS, axis=0)
    axes.plot(100 * LEVELS, 100 * shares, label=label)
    axes.set(xlabel="regions should hold, %", ylabel="regions hold, %", xlim=(0, 100), ylim=(0, 100), aspect="equal")
    if label:
        axes.legend(fontsize=8, loc="lower right")
    return axes


def coverage(theta: ArrayLike, estimated: ArrayLike, covariances: ArrayLike, level: float = 0.95) -> float:
    """Fraction of regions of that level that hold theta; arguments as of `plot_coverage`."""
    levels = levels_of(*(np.asarray(one, dtype=np.float64) for one in (theta, estimated, covariances)))
    return float(np.mean(levels <= level))


def levels_of(theta: Floats, estimated: Floats, covariances: Floats) -> Floats:
    """Level of the smallest region of each estimate that holds theta. Shape (K,)."""
    missed = estimated.reshape(len(estimated), -1) - theta.reshape(len(theta), -1)
    squared = (missed * np.linalg.solve(covariances, missed[..., None])[..., 0]).sum(axis=1)
    return np.asarray(chdtr(missed.shape[1], squared), dtype=np.float64)


def _new_axes(width_in: float, height_in: float) -> Axes:
    from matplotlib import pyplot  # so that notebooks show it

    return pyplot.subplots(figsize=(width_in, height_in), layout="constrained")[1]
