"""Messages out of what people write."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Mapping
from typing import Any

from google.protobuf.descriptor import Descriptor, FieldDescriptor  # type: ignore[import-untyped]
from google.protobuf.json_format import ParseDict, ParseError  # type: ignore[import-untyped]

from paramove.bus import unsound, value_of
from paramove.documents import InputError, nearest, read_value

DEEPEST = 100
"""Messages within each other: as many as protobuf reads."""


def message_of(kind: type[Any], content: str | Mapping[str, Any]) -> Any:
    """A message of a type with the fields of a mapping, which may be a text in YAML or JSON.

    A field of bytes takes bytes, or a text in base64; a list may be a numpy array.

    Raises InputError that names the wrong field; also for a number that every subscriber would reject.
    """
    fields = read_value(content, "the message") if isinstance(content, str) else content
    if not isinstance(fields, Mapping):
        raise InputError(f"a {kind.DESCRIPTOR.full_name} is written as a mapping, such as '{{x: 1.0}}'")
    fields = _in_json(kind.DESCRIPTOR, fields, "")
    try:
        message = ParseDict(fields, kind())
    except ParseError as error:
        raise InputError(f"this is no {kind.DESCRIPTOR.full_name}: {error}") from error
    fault = unsound(message)
    if fault:
        raise InputError(f"every subscriber would reject this {kind.DESCRIPTOR.full_name}: {fault}")
    return message


def _in_json(descriptor: Descriptor, fields: Mapping[str, Any], path: str) -> dict[str, Any]:
    """The fields as JSON has them, which knows no bytes; `path` is that of the message, for errors."""
    if path.count(".") >= DEEPEST:
        raise InputError(f"messages lie in each other more than {DEEPEST} deep: {path[:60]}…")
    known = {name: field for field in descriptor.fields for name in (field.name, field.json_name)}
    in_json = {}
    for name, value in fields.items():
        if name not in known:
            hint = nearest(str(name), [field.name for field in descriptor.fields])
            raise InputError(f"a {descriptor.full_name} has no field '{path}{name}'; {hint}")
        in_json[str(name)] = _value_in_json(known[name], value, f"{path}{name}")
    return in_json


def _value_in_json(field: FieldDescriptor, value: Any, path: str) -> Any:
    if hasattr(value, "tolist"):  # an array, or a number of numpy
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_value_in_json(field, part, path) for part in value]
    kind = value_of(field)
    if isinstance(value, Mapping):
        if kind is not field:  # a map
            return {name: _value_in_json(kind, part, path) for name, part in value.items()}
        is_json_itself = kind.message_type is None or kind.message_type.full_name.startswith("google.")
        return value if is_json_itself else _in_json(kind.message_type, value, f"{path}.")
    if kind.enum_type is not None and isinstance(value, str) and value not in kind.enum_type.values_by_name:
        raise InputError(f"{path} has no value '{value}'; there are: {', '.join(kind.enum_type.values_by_name)}")
    return _base64(value, path) if kind.type == FieldDescriptor.TYPE_BYTES else value


def _base64(value: Any, path: str) -> Any:
    """Bytes as a text; raises InputError for a text that is none in base64, of which protobuf would take a part."""
    if isinstance(value, bytes | bytearray | memoryview):
        return base64.b64encode(value).decode()
    if isinstance(value, str):
        try:
            base64.b64decode(value, validate=True)
        except (binascii.Error, ValueError) as error:
            raise InputError(f"{path} has bytes, written in base64 (abc is YWJj); {value!r:.40}: {error}") from error
    return value
