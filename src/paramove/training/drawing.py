"""Parts of the pictures of models: points, names, ellipses, grids of theta."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.special import chdtri  # scipy.stats would take half a second to import

from paramove.demonstrations import POINTS_FIRST
from paramove.documents import Floats, InputError, nearest
from paramove.phmm import MovementDescription, ParametricHMM
from paramove.training.examples import is_place

if TYPE_CHECKING:  # matplotlib takes half a second, which only those who draw should wait
    from matplotlib.axes import Axes

COLOURS = "viridis"
INK, FAINT, WARN = "#1d2530", "#aab3bd", "#b3372b"
ACTION_COLOURS = ("#3367d6", "#2f9e57", "#d9722b", "#8a4fbf", "#c2375b", "#6b7480", "#a08a00", "#1f9aa8")
LINES = {1: 9, 2: 5, 3: 3}
"""How many values of each parameter a grid has, by the number of parameters."""


class DrawnPoint(NamedTuple):
    """The body point of a model that is drawn.

    Attributes:
        name: of the point.
        columns: of its x, y, z in a frame.
    """

    name: str
    columns: slice


def drawn_point(model: ParametricHMM, name: str | None = None) -> DrawnPoint:
    """The named point, else the fingertip where there is one, else the last.

    Raises InputError for a name that the model does not have, or a model whose frames are not positions of points.
    """
    names = point_names(model)
    if name is not None and name not in names:
        raise InputError(f"there is no point '{name}' in the model; {nearest(name, names)}")
    point = name or next((one for one in POINTS_FIRST if one in names), names[-1])
    first = 3 * names.index(point)
    return DrawnPoint(point, slice(first, first + 3))


def description_of(model: ParametricHMM) -> MovementDescription:
    """The stored description, or that of any movement."""
    return model.description or MovementDescription()


def point_names(model: ParametricHMM) -> tuple[str, ...]:
    """Names of the body points, as described or else numbered. Raises InputError if frames are not positions."""
    described = description_of(model).point_names
    dim = dimension(model)
    if described and 3 * len(described) == dim:
        return described
    if dim % 3:
        raise InputError(f"cannot draw this model: expected frames of 3D positions, found {dim} components")
    return tuple(f"point_{number}" for number in range(1, dim // 3 + 1))


def dimension(model: ParametricHMM) -> int:
    """D, the number of components of a frame."""
    return int(model.state_means(bounds(model).mean(axis=0)).shape[-1])


def bounds(model: ParametricHMM) -> Floats:
    """Minimum and maximum theta of the training. Shape (2, P). Raises InputError for an untrained model."""
    if model.parameter_bounds_ is None:
        raise InputError("this model is not trained yet")
    return model.parameter_bounds_


def parameter_names(model: ParametricHMM) -> tuple[str, ...]:
    """Names of the components of theta, as described or else numbered."""
    count = bounds(model).shape[1]
    described = description_of(model).parameter_names
    return described if len(described) == count else tuple(f"parameter_{n}" for n in range(1, count + 1))


def with_unit(name: str) -> str:
    """A parameter's name for an axis: a coordinate of a position is in metres."""
    return f"{name}, m" if is_place(name) else name


def grid(low_high: Floats) -> Floats:
    """Theta of a grid between bounds (2, P). Shape (M, P)."""
    count = LINES.get(low_high.shape[1], 2)
    lines = [np.unique(np.linspace(low, high, count)) for low, high in low_high.T]
    return np.array(list(itertools.product(*lines)))


def add_ellipse(
    axes: Axes, centre: Floats, covariance: Floats, colour: Any, fraction: float = 0.95, **style: Any
) -> None:
    """The region of a normal distribution in the plane that holds this fraction of it."""
    from matplotlib.patches import Ellipse

    values, vectors = np.linalg.eigh(covariance)
    lengths = 2.0 * np.sqrt(np.maximum(values, 0.0) * chdtri(2, 1.0 - fraction))
    angle = float(np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1])))
    axes.add_patch(Ellipse((centre[0], centre[1]), lengths[1], lengths[0], angle=angle, color=colour, **style))
