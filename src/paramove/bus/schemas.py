"""A number per message type, carried by every message.

Protobuf decodes almost any bytes as almost any type. The envelope carries this number, so that a message of another
type is rejected before it is decoded. It covers the full name of the type and its generation, not its fields: a schema
grows by new fields, which protobuf preserves or ignores, so programs of different releases understand each other. What
would break that (a field that changes its number, type or label) is caught by a test against the schemas of every
release in `tests/data/releases`; an incompatible change raises the type's generation here.

Nobody tests the types of a workspace so, and they are changed while they are developed. Their number covers their
fields, too: after a change all programs of a run have to be started again.
"""

from __future__ import annotations

import hashlib
from functools import cache
from typing import Any

from google.protobuf.descriptor import Descriptor  # type: ignore[import-untyped]

from paramove.bus import topics
from paramove.bus.fields import is_own, written_out

GENERATIONS: dict[str, int] = {}
"""Full name of a message type -> how often its schema was changed so that old and new cannot read each other; else 1.

Counts for the type that stands in the topic table, also if the change was in a type within it.
"""


def schema_hash(message_type: type[Any]) -> int:
    """First 64 bits (little-endian) of SHA-256 over "<full name> <generation>", in a workspace also over its fields."""
    return _hash_of_type(message_type.DESCRIPTOR)


@cache
def _hash_of_type(descriptor: Descriptor) -> int:
    name = str(descriptor.full_name)
    fields = written_out(descriptor, only=is_own) if is_own(descriptor) else ""
    return hash_of(name + fields, GENERATIONS.get(name, 1))


@cache
def hash_of(name: str, generation: int) -> int:
    """The number of one generation of a message type."""
    return int.from_bytes(hashlib.sha256(f"{name} {generation}".encode()).digest()[:8], "little")


def type_of_hash(value: int) -> str | None:
    """Name of the message type in the topic table that has this number, with its generation if it is not the present.

    None if there is none.
    """
    for kind in {topic.type for topic in topics.known()} | {topics.status("x").type}:
        name = str(kind.DESCRIPTOR.full_name)
        if schema_hash(kind) == value:
            return name
        present = GENERATIONS.get(name, 1)
        for generation in range(1, present + 10):
            if hash_of(name, generation) == value:
                return f"{name} of generation {generation}"
    return None
