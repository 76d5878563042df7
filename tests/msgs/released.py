"""The schemas and example messages of every release, kept in `tests/data/releases/<version>/`.

    python -m tests.msgs.released 0.2.0     # at a release: writes its folder from the present schemas

`schemas.binpb` is a FileDescriptorSet of all types of the topic table; `<full name>.binpb` is a message of that type
with every field set, as the release encodes it. Neither is ever changed afterwards.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

from paramove.bus import topics
from paramove.msgs.clock_pb2 import TickDone

FOLDER = Path(__file__).parents[1] / "data" / "releases"
DEPTH = 3


def present_types() -> list[Any]:
    """Message classes that travel between processes, by name."""
    kinds = {topic.type for topic in topics.TOPICS} | {topics.status("x").type, TickDone}
    return sorted(kinds, key=lambda kind: str(kind.DESCRIPTOR.full_name))


def is_repeated(field: Any) -> bool:
    """`label` and its successor `is_repeated` do not both exist in every supported protobuf."""
    repeated = getattr(field, "is_repeated", None)
    return field.label == field.LABEL_REPEATED if repeated is None else bool(repeated)


def fill(message: Any, depth: int = DEPTH) -> Any:
    """Sets every field to a value that depends on its number and is not the default."""
    for field in message.DESCRIPTOR.fields:
        if field.message_type is not None:
            if depth == 0:
                continue
            for _ in range(2 if is_repeated(field) else 1):
                value = getattr(message, field.name)
                part = value.add() if is_repeated(field) else value
                part.SetInParent()
                fill(part, depth - 1)
        elif is_repeated(field):
            getattr(message, field.name).extend([_value(field), _value(field)])
        else:
            setattr(message, field.name, _value(field))
    return message


def _value(field: Any) -> Any:
    if field.enum_type is not None:
        return field.enum_type.values[-1].number
    if field.cpp_type == field.CPPTYPE_STRING:
        return b"\x00\xff" if field.type == field.TYPE_BYTES else f"field {field.number}"
    if field.cpp_type == field.CPPTYPE_BOOL:
        return True
    return field.number + 100


def present_schemas() -> descriptor_pb2.FileDescriptorSet:
    """All files behind the present types, each after those that it imports."""
    found: dict[str, Any] = {}

    def add(file: Any) -> None:
        if file.name not in found:
            for other in file.dependencies:
                add(other)
            found[file.name] = file

    for kind in present_types():
        add(kind.DESCRIPTOR.file)
    schemas = descriptor_pb2.FileDescriptorSet()
    for file in found.values():
        file.CopyToProto(schemas.file.add())
    return schemas


def classes_of(schemas: descriptor_pb2.FileDescriptorSet) -> dict[str, Any]:
    """Message classes by full name, apart from those of this program."""
    pool = descriptor_pool.DescriptorPool()
    for file in schemas.file:
        pool.Add(file) if hasattr(pool, "Add") else pool.AddSerializedFile(file.SerializeToString())
    names = [f"{file.package}.{message.name}" for file in schemas.file for message in file.message_type]
    return {name: message_factory.GetMessageClass(pool.FindMessageTypeByName(name)) for name in names}


def write(version: str) -> None:
    """Writes the folder of a release; a folder that exists is left alone."""
    folder = FOLDER / version
    folder.mkdir(parents=True)
    (folder / "schemas.binpb").write_bytes(present_schemas().SerializeToString(deterministic=True))
    for kind in present_types():
        content = fill(kind()).SerializeToString(deterministic=True)
        (folder / f"{kind.DESCRIPTOR.full_name}.binpb").write_bytes(content)


if __name__ == "__main__":
    write(sys.argv[1])
