"""A number per message type that differs as soon as its schema differs.

Protobuf decodes almost any bytes as almost any type. The envelope carries this number, so that a message of another
type, or of another version of the type, is refused before it is decoded.
"""

from __future__ import annotations

import hashlib
from typing import Any

from paramove.bus import topics

_KNOWN: dict[Any, int] = {}


def schema_hash(message_type: type[Any]) -> int:
    """First 64 bits (little-endian) of SHA-256 over the schema of `message_type` and all types it contains.

    Full names, field numbers, field names, types, labels and enum values count; comments and file layout do not.
    """
    if message_type not in _KNOWN:
        lines: dict[str, str] = {}
        _describe(message_type.DESCRIPTOR, lines)
        text = "\n".join(lines[name] for name in sorted(lines))
        _KNOWN[message_type] = int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little")
    return _KNOWN[message_type]


def type_of_hash(value: int) -> str | None:
    """Full name of the message type in the topic table that has this hash; None if there is none."""
    types = [topic.type for topic in topics.TOPICS] + [topics.status("x").type]
    return next((str(kind.DESCRIPTOR.full_name) for kind in types if schema_hash(kind) == value), None)


def _describe(descriptor: Any, lines: dict[str, str]) -> None:
    """Adds the line of this message type and of every type it refers to; recursive types end at the known name."""
    if descriptor.full_name in lines:
        return
    lines[descriptor.full_name] = ""  # known from here on
    parts = [f"message {descriptor.full_name}"]
    for field in sorted(descriptor.fields, key=lambda field: field.number):
        refers_to = field.message_type or field.enum_type
        oneof = field.containing_oneof.name if field.containing_oneof else ""
        # `label` and its successor `is_repeated` do not both exist in every supported protobuf.
        repeated = getattr(field, "is_repeated", None)
        if repeated is None:
            repeated = field.label == field.LABEL_REPEATED
        kind = refers_to.full_name if refers_to else ""
        parts.append(f"{field.number} {field.name} {field.type} {kind} {bool(repeated)} {oneof}")
        if field.message_type:
            _describe(field.message_type, lines)
        elif field.enum_type:
            values = sorted((value.number, value.name) for value in field.enum_type.values)
            lines[field.enum_type.full_name] = f"enum {field.enum_type.full_name} {values}"
    lines[descriptor.full_name] = "; ".join(parts)
