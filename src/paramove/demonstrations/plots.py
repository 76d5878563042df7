"""Pictures of a demonstration set: paths in space, and coordinates over time, coloured by a parameter."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from paramove.demonstrations.demonstration_set import DemonstrationSet
from paramove.demonstrations.movement import POINTS_FIRST, DemonstrationError
from paramove.documents import Floats, image, nearest, report_page

DPI = 110
FIGURE_IN = (13.0, 7.5)
COLOURS = "viridis"


def plot_set(dataset: DemonstrationSet, point: str | None = None, colour_by: str | None = None) -> Figure:
    """On the left the paths of one point in space, on the right its x, y, z over time; one line per movement.

    Args:
        dataset: The set to draw.
        point: Name of the point; None: the fingertip where there is one.
        colour_by: Name of a parameter, or "action"; None: the parameter that varies most, else the action.

    Raises DemonstrationError for a set without movements, or an unknown name.
    """
    if not len(dataset):
        raise DemonstrationError("there is no movement to draw")
    name = point or next((one for one in POINTS_FIRST if one in dataset.point_names), dataset.point_names[-1])
    values, title = _colour_values(dataset, colour_by)
    paths = [movement.point(name) for movement in dataset]
    figure = new_figure(*FIGURE_IN)
    grid = figure.add_gridspec(3, 2, width_ratios=[1.15, 1.0])
    space = space_axes(figure, grid[:, 0], paths, f"path of {name}, frame '{dataset.frame}'")
    over_time = [figure.add_subplot(grid[row, 1]) for row in range(3)]
    norm = Normalize(float(values.min()), float(max(values.max(), values.min() + 1e-9)))
    colours = colormaps[COLOURS](norm(values))
    for movement, path, colour in zip(dataset, paths, colours, strict=True):
        space.plot(*path.T, color=colour, linewidth=0.9, alpha=0.8)
        for axis, axes in enumerate(over_time):
            axes.plot(movement.time, path[:, axis], color=colour, linewidth=0.9, alpha=0.8)
    for letter, axes in zip("xyz", over_time, strict=True):
        axes.set_ylabel(f"{name} {letter}, m")
        axes.grid(alpha=0.3)
    over_time[-1].set_xlabel("time, s")
    if title == "action":
        _legend(space, dataset, values, colours)
    else:
        figure.colorbar(ScalarMappable(norm, COLOURS), ax=over_time, label=title, pad=0.02)
    figure.suptitle(_title(dataset), fontsize=11)
    return figure


def new_figure(width_in: float, height_in: float) -> Figure:
    """An empty figure that needs no display."""
    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def space_axes(figure: Figure, cell: Any, paths: Sequence[Floats], title: str) -> Any:
    """Axes in 3D with equal scales that hold the paths (T, 3)."""
    axes: Any = figure.add_subplot(cell, projection="3d")
    low = np.min([path.min(axis=0) for path in paths], axis=0)
    high = np.max([path.max(axis=0) for path in paths], axis=0)
    middle, half = 0.5 * (low + high), 0.5 * float(np.max(high - low)) + 1e-3
    for number, axis in enumerate("xyz"):  # equal scales, so that a circle is one
        getattr(axes, f"set_{axis}lim")(middle[number] - half, middle[number] + half)
        getattr(axes, f"set_{axis}label")(f"{axis}, m")
    axes.set_box_aspect((1.0, 1.0, 1.0))
    axes.set_title(title, fontsize=10)
    return axes


def embedded(figure: Figure, about: str, dpi: float) -> str:
    """The picture as a part of an HTML page, with a description as its alternative text."""
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=dpi)
    return image(picture.getvalue(), about)


def write_plot(figure: Figure, path: Path, about: str = "") -> None:
    """Writes the picture as PNG, SVG or PDF, or within a self-contained HTML page.

    Raises DemonstrationError for another ending.
    """
    if path.suffix.lower() in (".html", ".htm"):
        plot = embedded(figure, "paths and coordinates", DPI)
        style = "main{max-width:1400px}img{max-width:100%}"
        path.write_text(report_page(about, about, "", [plot], style=style), encoding="utf-8")
    elif path.suffix.lower() in (".png", ".svg", ".pdf"):
        figure.savefig(path, dpi=DPI)
    else:
        raise DemonstrationError(f"{path}: pictures end in .png, .svg, .pdf or .html")


def _colour_values(dataset: DemonstrationSet, colour_by: str | None) -> tuple[Floats, str]:
    """A number per movement, and what it is."""
    names = dataset.parameter_names
    if colour_by not in (None, "action", *names):
        raise DemonstrationError(f"there is no parameter '{colour_by}'; {nearest(str(colour_by), ['action', *names])}")
    theta = np.stack([movement.theta for movement in dataset])
    ranges = np.ptp(theta, axis=0) if names else np.zeros(0)
    if colour_by is None and names and ranges.max() > 0.0:
        colour_by = names[int(ranges.argmax())]
    if colour_by in names:
        return theta[:, names.index(str(colour_by))], str(colour_by)
    numbers = [dataset.actions.index(movement.action) for movement in dataset]
    return np.array(numbers, dtype=np.float64), "action"


def _legend(space: Any, dataset: DemonstrationSet, values: Floats, colours: Floats) -> None:
    for number, action in enumerate(dataset.actions):
        colour = colours[int(np.flatnonzero(values == number)[0])]
        space.plot([], [], [], color=colour, label=action)
    space.legend(loc="upper left", fontsize=8)


def _title(dataset: DemonstrationSet) -> str:
    persons = [name for name in dataset.subjects if name]
    parts = [
        f"{len(dataset)} movements",
        ", ".join(dataset.actions),
        f"{len(persons)} persons" if len(persons) > 1 else "",
    ]
    return " · ".join(part for part in parts if part)
