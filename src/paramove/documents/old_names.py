"""Parameters and attributes that have been renamed: the old names work for one release, with a warning."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Sequence
from typing import Any, ClassVar

from pydantic import BaseModel, model_validator

_log = logging.getLogger(__name__)


class OldNames(BaseModel):
    """A model whose fields may be given by the names that they had in the release before.

    Attributes:
        old_names: Old name and name of the field, of each; `outer.inner` for a field of a field.
    """

    old_names: ClassVar[tuple[tuple[str, str], ...]] = ()

    @model_validator(mode="before")
    @classmethod
    def _renamed(cls, values: Any) -> Any:
        for old, new in cls.old_names:
            values = _renamed(values, old, new, old.split("."))
        return values


def renamed_attribute(old: str, new: str) -> Any:
    """A property by which the attribute `new` is also read by the name that it had in the release before."""

    def read(instance: Any) -> Any:
        message = f"{type(instance).__name__}.{old} is called {new} now; the next release knows the new name only"
        warnings.warn(message, DeprecationWarning, stacklevel=2)
        return getattr(instance, new)

    return property(read, doc=f"Old name of `{new}`, for one release.")


def _renamed(values: Any, old: str, new: str, path: Sequence[str]) -> Any:
    """The mapping with the key at the end of `path` renamed; the one that is given if there is no such key."""
    key, *inner = path
    new_key = new.rpartition(".")[2]
    if not isinstance(values, dict) or key not in values:
        return values
    if inner:
        return {**values, key: _renamed(values[key], old, new, inner)}
    if new_key in values:
        return values
    _log.warning("%s is called %s now; the next release knows the new name only", old, new)
    return {new_key if name == key else name: value for name, value in values.items()}
