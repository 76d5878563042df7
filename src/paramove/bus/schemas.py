"""A number per message type, carried by every message.

Protobuf decodes almost any bytes as almost any type. The envelope carries this number, so that a message of another
type is rejected before it is decoded. It covers the full name of the type and its generation, not its fields: a schema
grows by new fields, which protobuf preserves or ignores, so programs of different releases understand each other. What
would break that (a field that changes its number, type or label) is caught by a test against the schemas of every
release in `tests/data/releases`; an incompatible change raises the type's generation here.
"""

from __future__ import annotations

import hashlib
from functools import cache
from typing import Any

from paramove.bus import topics

GENERATIONS: dict[str, int] = {}
"""Full name of a message type -> how often its schema was changed so that old and new cannot read each other; else 1.

Counts for the type that stands in the topic table, also if the change was in a type within it.
"""


def schema_hash(message_type: type[Any]) -> int:
    """First 64 bits (little-endian) of SHA-256 over "<full name> <generation>"."""
    name = str(message_type.DESCRIPTOR.full_name)
    return hash_of(name, GENERATIONS.get(name, 1))


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
        present = GENERATIONS.get(name, 1)
        for generation in range(1, present + 10):
            if hash_of(name, generation) == value:
                return name if generation == present else f"{name} of generation {generation}"
    return None
