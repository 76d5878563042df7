"""Parameters and attributes that have been renamed: the old names work for one release, with a warning."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Sequence
from typing import Any, ClassVar

from pydantic import BaseModel, model_validator

_log = logging.getLogger(__name__)


class OldNames(BaseModel):
    """A model that also accepts the names that its fields had in the previous release.

    Attributes:
        old_names: Pairs of old and new name; `outer.inner` for a nested field.
    """

    old_names: ClassVar[tuple[tuple[str, str], ...]] = ()

    @model_validator(mode="before")
    @classmethod
    def _renamed(cls, values: Any) -> Any:
        for old, new in cls.old_names:
            values = _renamed(values, old, new, old.split("."))
        return values


def renamed_attribute(old: str, new: str) -> Any:
    """A property that reads the attribute `new` by its name in the previous release."""

    def read(instance: Any) -> Any:
        message = f"{type(instance).__name__}.{old} is called {new} now; the next release knows the new name only"
        warnings.warn(message, DeprecationWarning, stacklevel=2)
        return getattr(instance, new)

    return property(read, doc=f"Old name of `{new}`, for one release.")


def _renamed(values: Any, old: str, new: str, path: Sequence[str]) -> Any:
    """The mapping with the key at the end of `path` renamed; unchanged if there is no such key."""
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
