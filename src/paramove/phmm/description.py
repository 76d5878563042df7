"""Description of a movement model: action, points, unit, frame, names of the parameters."""

from dataclasses import dataclass, fields
from math import isfinite
from typing import Any, Self


@dataclass(frozen=True)
class MovementDescription:
    """Labels that are stored with a model.

    Attributes:
        action: name of the action.
        point_names: names of the body points whose x, y, z are stacked in a frame; () if there are none.
        unit: unit of the frames' components.
        frame: coordinate frame of the points.
        parameter_names: one name per component of theta; () for unnamed.
        duration: mean duration of the demonstrations in seconds; 0 if unknown.
        arrival: progress tau at which the target is reached, the hand still open; -1 if there is none.
        grasp: last progress tau at which the object is held; -1 if there is none.
        source: where the demonstrations come from; "" if unknown.
        rate_hz: frame rate of the demonstrations, which beginnings of movements must have; 0 if unknown.
    """

    action: str = "movement"
    point_names: tuple[str, ...] = ()
    unit: str = "m"
    frame: str = "unspecified"
    parameter_names: tuple[str, ...] = ()
    duration: float = 0.0
    arrival: float = -1.0
    grasp: float = -1.0
    source: str = ""
    rate_hz: float = 0.0

    @classmethod
    def from_record(cls, record: dict[str, Any]) -> Self:
        """From plain values. Raises ValueError for names and types that do not belong to a description."""
        known = {field.name for field in fields(cls)}
        unknown = sorted(set(record) - known)
        if unknown:
            raise ValueError(f"a description has {sorted(known)}, found also {unknown}")
        values: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else value for name, value in record.items()
        }
        for field in fields(cls):
            value = values.get(field.name, field.default)
            if not _is_like(value, field.default):
                raise ValueError(f"{field.name} of a description is like {field.default!r}, found {value!r:.80}")
        return cls(**values)


def _is_like(value: Any, default: Any) -> bool:
    """Whether a value has the type of the default: a name, names, or a finite number."""
    if isinstance(default, tuple):
        return isinstance(value, tuple) and all(isinstance(name, str) for name in value)
    if isinstance(default, str):
        return isinstance(value, str)
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)
