"""The content of a file of motion capture, in its own unit, axes and names."""

from __future__ import annotations

from dataclasses import dataclass

from paramove.demonstrations import Label
from paramove.documents import Floats


@dataclass(frozen=True)
class RawTake:
    """Frames that were captured one after the other.

    Attributes:
        name: For the recording that it becomes a part of.
        time: Shape (T,), s; None if the file has neither times nor a rate.
        positions: Shape (T, P, 3), in the file's unit and axes; NaN where a point was lost.
        point_names: Of the P points, as the file has them.
        unit: "m", "cm", "mm"; None if the file does not define it.
        axes: Directions of x, y, z as `conversion.axes_matrix` takes them; None if the file does not define it.
        labels: The file's labels of movements; positions in theta are in the file's unit and axes.
        parameter_names: Of theta.
    """

    name: str
    time: Floats | None
    positions: Floats
    point_names: tuple[str, ...]
    unit: str | None = None
    axes: str | None = None
    labels: tuple[Label, ...] = ()
    parameter_names: tuple[str, ...] = ()
