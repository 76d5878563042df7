"""Documents as pydantic models: each wrong key at its position, with the nearest that would have worked."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any, TypeVar, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from paramove.documents.positions import Document, DocumentError
from paramove.documents.wording import closest, nearest

Model = TypeVar("Model", bound=BaseModel)
_QUOTED = re.compile(r"'([^']*)'")
_EXPECTED = {
    "bool_type": "expected true or false",
    "dict_type": "expected a mapping 'key: value'",
    "model_type": "expected a mapping 'key: value'",
    "list_type": "expected a list in brackets",
    "string_type": "expected a text, in quotes if it could be something else",
    "float_type": "expected a number",
    "int_type": "expected a whole number",
}
"""Type of a finding of pydantic -> what to write instead."""


def checked(model: type[Model], document: Document, patterns: Mapping[str, str] | None = None) -> Model:
    """The document as a model.

    Args:
        model: Its keys.
        document: With the position of each key.
        patterns: What is expected of a text that has to match a regular expression, by the last part of its key; under
            "" for all others.

    Raises:
        DocumentError: With every finding, one per line.
    """
    try:
        return model.model_validate(document.data)
    except ValidationError as error:
        causes = _causes(model, error.errors())
        raise DocumentError.of([_finding(model, document, details, patterns or {}) for details in causes]) from error


def keys_at(kind: Any, path: Sequence[str]) -> list[str]:
    """Valid keys of the mapping at `path` of a model or a dataclass; none where it holds no further one."""
    for key in path:
        known = _fields(kind)
        inner = known.get(key) if known else _item(kind)
        candidates = (inner, *get_args(inner))
        kind = next((one for one in candidates if _fields(one) or _item(one) is not None), None)
    return list(_fields(kind))


def _item(kind: Any) -> Any:
    """Type of the values of a dictionary, or of the items of a list or a tuple; None for any other type."""
    container, parts = get_origin(kind), get_args(kind)
    if container is dict:
        return parts[1]
    return parts[0] if parts and container in (list, tuple) else None


def _fields(kind: Any) -> dict[str, Any]:
    """Name -> type of the fields of a model or a dataclass."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return {name: field.annotation for name, field in kind.model_fields.items()}
    if isinstance(kind, type) and is_dataclass(kind):
        return {field.name: field.type for field in fields(kind)}
    return {}


def _causes(model: type[BaseModel], details: Sequence[ErrorDetails]) -> list[ErrorDetails]:
    """Findings without the keys that are missing only because they are mistyped."""
    mistyped = set()
    for one in details:
        if one["type"] == "extra_forbidden":
            *above, key = map(str, one["loc"])
            mistyped |= {(*above, meant) for meant in closest(key, keys_at(model, above))}
    return [one for one in details if one["type"] != "missing" or tuple(map(str, one["loc"])) not in mistyped]


def _finding(
    model: type[BaseModel], document: Document, details: ErrorDetails, patterns: Mapping[str, str]
) -> DocumentError:
    path = tuple(str(part) for part in details["loc"] if part != "[key]")
    name = ".".join(path) or "the file"
    if details["type"] == "extra_forbidden":
        return document.error(path, f"unknown key '{path[-1]}'; {nearest(path[-1], keys_at(model, path[:-1]))}")
    if details["type"] == "missing":
        return document.error(path, f"{name} is missing")
    message = _EXPECTED.get(details["type"], details["msg"][0].lower() + details["msg"][1:])
    if details["type"] == "string_pattern_mismatch" and patterns:
        message = f"expected {patterns.get(path[-1], patterns[''])}"
    value = details["input"]
    message += f", found {value!r:.200}"
    if details["type"] == "literal_error":
        message += f"; {nearest(str(value), _QUOTED.findall(details['msg']))}"
    elif details["type"] in ("int_type", "float_type") and isinstance(value, str):
        message += "; write it without quotes"
    return document.error(path, f"{name}: {message}")
