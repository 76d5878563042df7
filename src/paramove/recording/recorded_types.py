"""Message types by the schemas that a recording has in it: for topics that no table here knows, or knows otherwise."""

from __future__ import annotations

import contextlib
from functools import lru_cache
from typing import Any

from google.protobuf.descriptor_pb2 import FileDescriptorSet  # type: ignore[import-untyped]
from google.protobuf.descriptor_pool import DescriptorPool  # type: ignore[import-untyped]
from google.protobuf.message import DecodeError  # type: ignore[import-untyped]
from google.protobuf.message_factory import GetMessageClass  # type: ignore[import-untyped]
from mcap.records import Schema

from paramove.bus import Topic, changed_field, is_own, topics
from paramove.documents import InputError


def row_of(name: str, schema: Schema) -> Topic:
    """The topic's row of the table if messages of the schema can be read by its type, else one of the recording's own.

    What the library has changed in its own types can be read; a workspace's type may have changed in any way.

    Raises InputError for a topic that no table here knows and whose schema cannot be used.
    """
    row = known_row(name)
    if row is None or row.type_name != schema.name:
        return recorded_row(name, type_of(schema))
    if is_own(row.type.DESCRIPTOR) and change_of(row, type_of(schema)):
        return recorded_row(name, type_of(schema))
    return row


def known_row(name: str) -> Topic | None:
    """The topic's row of the table; None for a name that no table here has."""
    with contextlib.suppress(KeyError, ValueError):
        return topics.by_name(name)
    return None


def recorded_row(name: str, kind: type[Any]) -> Topic:
    """A row for a topic that no table here knows, or knows with another type."""
    return Topic(name, kind, None, topics.Profile.QUEUE, max_bytes=topics.IMAGE_BYTES)


def change_of(row: Topic, recorded: type[Any]) -> str:
    """What is another now in the type of a topic, so that messages of a recorded class cannot be read by it; "" if they
    can."""
    if row.type is recorded:
        return ""
    if row.type_name != recorded.DESCRIPTOR.full_name:
        return f"{recorded.DESCRIPTOR.full_name} is {row.type_name} now"
    return changed_field(row.type.DESCRIPTOR, recorded.DESCRIPTOR)


def type_of(schema: Schema) -> type[Any]:
    """Class of the messages of a schema, in a pool of its own; raises InputError if it is none of protobuf."""
    if schema.encoding != "protobuf":
        raise InputError(f"the schema {schema.name!r:.80} is in {schema.encoding!r:.20}; only protobuf is read")
    try:
        return _class(schema.name, schema.data)
    except (DecodeError, TypeError, KeyError) as error:
        raise InputError(f"the schema {schema.name!r:.80} of the recording is damaged: {error}") from error


@lru_cache(maxsize=256)
def _class(name: str, files: bytes) -> type[Any]:
    """The same class each time, as messages of two classes are of two types."""
    pool = DescriptorPool()
    for file in FileDescriptorSet.FromString(files).file:
        pool.Add(file)
    kind: type[Any] = GetMessageClass(pool.FindMessageTypeByName(name))
    return kind
