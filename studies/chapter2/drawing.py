"""Plots of trained HMMs over their training sequences, as in thesis 2.3."""

import io
from collections.abc import Callable
from typing import Any, cast

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from paramove.documents import Floats
from paramove.runs import STYLE
from studies.chapter2.movement import PARAMETER_FRACTIONS, demonstration, prototype
from studies.chapter2.training import Snapshot

RED, BLUE, GREY, GREEN = "#c8372d", "#2f6fc4", "#8b95a1", "#1f7a45"
MIN_DRAWN = 0.01
"""Transitions are drawn from this fraction of the maximum that leads to another state."""
SIZE = (5.2, 2.5)


def png_of(draw: Callable[[Axes], None], size: tuple[float, float] = SIZE) -> bytes:
    """One plot as PNG; `size` in inches."""
    with mpl.rc_context(cast(Any, STYLE)):
        figure = Figure(figsize=size, layout="constrained")
        draw(figure.subplots())
        file = io.BytesIO()
        figure.savefig(file, format="png", dpi=110, metadata={"Software": None})
    return file.getvalue()


def draw_model(axes: Axes, snapshot: Snapshot, sequences: list[Floats], bound: float) -> None:
    """Training sequences, 1-sigma ellipses of the states (E.14), their means, and transitions between states."""
    for sequence in sequences:
        axes.plot(*sequence.T, color=GREY, lw=0.5, alpha=0.8, zorder=1)
    _draw_transitions(axes, snapshot)
    for mean, covariance in zip(snapshot.means, snapshot.covariances, strict=True):
        axes.plot(*ellipse(mean, covariance).T, color=RED, lw=0.9, zorder=3)
    axes.plot(*snapshot.means.T, color=RED, marker=".", ls="", ms=5, zorder=4)
    axes.axhline(0.0, color="#bcc4cc", lw=0.6, zorder=0)
    axes.set(xlim=(-0.15, 2.15), ylim=(-1.5 * bound, 1.5 * bound), xlabel="x", ylabel="y")


def _draw_transitions(axes: Axes, snapshot: Snapshot) -> None:
    others = snapshot.transitions * (1.0 - np.eye(len(snapshot.means)))
    maximum = others.max()
    if maximum <= 0.0:
        return
    pairs = np.argwhere(others > MIN_DRAWN * maximum)
    lines = [(snapshot.means[i], snapshot.means[j]) for i, j in pairs]
    widths = [1.6 * others[i, j] / maximum for i, j in pairs]
    axes.add_collection(LineCollection(lines, colors=BLUE, linewidths=widths, alpha=0.8, zorder=2))


def ellipse(mean: Floats, covariance: Floats, points: int = 60) -> Floats:
    """Where the Mahalanobis distance from the mean is one (E.14). Shape (points, 2)."""
    values, vectors = np.linalg.eigh(covariance)
    angle = np.linspace(0.0, 2.0 * np.pi, points)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    result: Floats = mean + (vectors @ (np.sqrt(np.maximum(values, 0.0))[:, None] * circle)).T
    return result


def draw_prototypes(axes: Axes, bound: float = 0.25) -> None:
    """Figure 2.6: the movement for five parameters."""
    times = np.linspace(0.0, 2.0, 201)
    for fraction in PARAMETER_FRACTIONS:
        axes.plot(*prototype(bound * fraction, times).T, lw=1.3, label=f"p = {bound * fraction:g}")
    axes.set(xlabel="x", ylabel="y", ylim=(-0.4, 0.4))
    axes.legend(ncols=3, loc="upper center", fontsize=7)


def draw_demonstrations(axes: Axes, seed: int, bound: float = 0.25) -> None:
    """Figure 2.7: sampled versions of the same, with noise."""
    rng = np.random.default_rng(seed)
    for fraction in PARAMETER_FRACTIONS:
        axes.plot(*demonstration(bound * fraction, 50, rng).T, marker=".", ms=3, lw=0.6)
    axes.set(xlabel="x", ylabel="y", ylim=(-0.4, 0.4))


def draw_convergence(axes: Axes, distances: dict[str, Floats]) -> None:
    """Maximum distance of a state mean from its final position over the iterations, for several trainings."""
    for name, values in distances.items():
        axes.semilogy(np.arange(len(values)), np.maximum(values, 1e-6), lw=1.3, label=name)
    axes.axhline(0.01, color=GREY, lw=0.8, ls=":")
    axes.set(xlabel="iteration", ylabel="distance from the result", xlim=(0, 500), ylim=(1e-5, 3.0))
    axes.legend(fontsize=7, ncols=2)


def draw_synthesis(axes: Axes, made: dict[str, Floats], bound: float = 0.25) -> None:
    """Sequences made from one model by several methods, and the extreme movements of the class."""
    times = np.linspace(0.0, 2.0, 201)
    for fraction in (-1.0, 1.0):
        axes.plot(*prototype(bound * fraction, times).T, color=GREY, lw=0.8)
    for (name, movement), colour in zip(made.items(), (GREY, BLUE, GREEN, RED), strict=True):
        axes.plot(*movement.T, lw=1.1, color=colour, marker="." if len(movement) < 60 else "", ms=3, label=name)
    axes.set(xlabel="x", ylabel="y", ylim=(-0.45, 0.45))
    axes.legend(fontsize=7, ncols=2, loc="upper center")
