"""Message types by the schemas that a recording has in it, for topics that no table here knows."""

from __future__ import annotations

import contextlib
from functools import lru_cache
from typing import Any

from google.protobuf.descriptor_pb2 import FileDescriptorSet  # type: ignore[import-untyped]
from google.protobuf.descriptor_pool import DescriptorPool  # type: ignore[import-untyped]
from google.protobuf.message import DecodeError  # type: ignore[import-untyped]
from google.protobuf.message_factory import GetMessageClass  # type: ignore[import-untyped]
from mcap.records import Schema

from paramove.bus import Topic, topics
from paramove.documents import InputError


def row_of(name: str, type_name: str) -> Topic | None:
    """The topic's row of the table, if messages of this type are on it there."""
    with contextlib.suppress(KeyError, ValueError):
        row = topics.by_name(name)
        if row.type_name == type_name:
            return row
    return None


def unknown_row(name: str, kind: type[Any]) -> Topic:
    """A row for a topic that no table here knows."""
    return Topic(name, kind, None, topics.Profile.QUEUE)


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
