"""Parameters that have been renamed: the old names work for one release, with a warning."""

from __future__ import annotations

import logging
from typing import Any, ClassVar

from pydantic import BaseModel, model_validator

_log = logging.getLogger(__name__)


class OldNames(BaseModel):
    """A model whose fields may be given by the names that they had in the release before.

    Attributes:
        old_names: Old name and name of the field, of each.
    """

    old_names: ClassVar[tuple[tuple[str, str], ...]] = ()

    @model_validator(mode="before")
    @classmethod
    def _renamed(cls, values: Any) -> Any:
        if not isinstance(values, dict):
            return values
        given = dict(values)
        for old, new in cls.old_names:
            if old in given and new not in given:
                _log.warning("%s is called %s now; the next release knows the new name only", old, new)
                given[new] = given.pop(old)
        return given
