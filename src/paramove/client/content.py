"""Messages out of what people write."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from google.protobuf.json_format import ParseDict, ParseError  # type: ignore[import-untyped]

from paramove.bus import unsound
from paramove.documents import InputError, read_value


def message_of(kind: type[Any], content: str | Mapping[str, Any]) -> Any:
    """A message of a type with the fields of a mapping, which may be a text in YAML or JSON.

    Raises InputError that names the wrong field; also for a number that every subscriber would reject.
    """
    fields = read_value(content, "the message") if isinstance(content, str) else content
    if not isinstance(fields, Mapping):
        raise InputError(f"a {kind.DESCRIPTOR.full_name} is written as a mapping, such as '{{x: 1.0}}'")
    try:
        message = ParseDict(fields, kind())
    except ParseError as error:
        raise InputError(f"this is no {kind.DESCRIPTOR.full_name}: {error}") from error
    fault = unsound(message)
    if fault:
        raise InputError(f"every subscriber would reject this {kind.DESCRIPTOR.full_name}: {fault}")
    return message
