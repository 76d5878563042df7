"""Parameters that have been renamed: the old names work for one release, with a warning."""

from __future__ import annotations

import copy
import logging
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
        if not isinstance(values, dict):
            return values
        given = copy.deepcopy(values)
        for old, new in cls.old_names:
            *outer, old_key = old.split(".")
            new_key = new.rpartition(".")[2]
            inner: Any = given
            for key in outer:
                inner = inner.get(key) if isinstance(inner, dict) else None
            if isinstance(inner, dict) and old_key in inner and new_key not in inner:
                _log.warning("%s is called %s now; the next release knows the new name only", old, new)
                inner[new_key] = inner.pop(old_key)
        return given
