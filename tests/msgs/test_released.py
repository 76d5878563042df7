"""Programs of different releases understand each other, and stored bytes of every release still decode."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from google.protobuf import descriptor_pb2

from paramove.bus.schemas import GENERATIONS
from tests.msgs.released import FOLDER, classes_of, is_repeated, present_schemas, present_types

RELEASES = sorted(path for path in FOLDER.iterdir() if path.is_dir())
MESSAGES = [(path.parent.name, path) for release in RELEASES for path in sorted(release.glob("*.*.binpb"))]
RENAMED = {
    "ActionBelief": "ActionProbability",
    "ActionEstimate.sentence": "detail",
    "ApplicationStage.sentence": "detail",
    "Clock.said": "published",
    "Hoap3State.refusal": "rejection",
    "Hoap3State.refused_batches": "rejected_batches",
    "Motor.heard": "responding",
    "NodeStatus.heard": "received",
    "NodeStatus.said": "published",
    "NodeStatus.sentence": "detail",
    "Rule.sentence": "text",
    "STATE_REFUSED": "STATE_REJECTED",
    "SafetyFault.sentence": "detail",
    "SafetyState.refused_trajectories": "rejected_trajectories",
    "Speech.sentence": "text",
    "TickDone.said": "published",
    "TopicCount.refused": "rejected",
}
"""What has another name and the same number, type and meaning, which are all that travels."""
PRESENT = {str(kind.DESCRIPTOR.full_name): kind for kind in present_types()}


def released_class(version: str, name: str) -> Any:
    content = (FOLDER / version / "schemas.binpb").read_bytes()
    return classes_of(descriptor_pb2.FileDescriptorSet.FromString(content))[name]


def name_of(descriptor: Any) -> str:
    """The name that a field, a type or a value of any release has now."""
    return RENAMED.get(
        getattr(descriptor, "full_name", descriptor.name).removeprefix("paramove.msgs."), str(descriptor.name)
    )


def values(message: Any) -> dict[str, Any]:
    """Field by name -> value, within all levels; of fields that are set."""
    found: dict[str, Any] = {}
    for field, value in message.ListFields():
        name = name_of(field)
        if field.message_type is None:
            found[name] = list(value) if is_repeated(field) else value
        else:
            found[name] = [values(part) for part in value] if is_repeated(field) else values(value)
    return found


def types_within(descriptor: Any, seen: set[str] | None = None) -> Iterator[Any]:
    seen = set() if seen is None else seen
    if descriptor.full_name not in seen:
        seen.add(descriptor.full_name)
        yield descriptor
        for field in descriptor.fields:
            if field.message_type is not None:
                yield from types_within(field.message_type, seen)


def meaning(field: Any) -> tuple[Any, ...]:
    """What both sides must agree on: enum and 32-bit integer are one on the wire, but not to a reader."""
    inner = field.message_type or field.enum_type
    return name_of(field), field.type, is_repeated(field), name_of(inner) if inner else ""


def incompatible(old: Any, new: Any) -> list[str]:
    """Fields of the old schema that mean something else in the new one or are gone without being reserved."""
    new_types = {kind.name: kind for kind in types_within(new)}
    found = []
    for kind in types_within(old):
        successor = new_types.get(name_of(kind))
        if successor is None:
            continue  # the field that led to it is gone or changed, which is reported there
        proto = descriptor_pb2.DescriptorProto()
        successor.CopyToProto(proto)
        reserved = {number for part in proto.reserved_range for number in range(part.start, part.end)}
        for field in kind.fields:
            now = successor.fields_by_number.get(field.number)
            if now is None and field.number not in reserved:
                found.append(f"{kind.full_name}.{field.name}: number {field.number} is gone and not reserved")
            elif now is not None and meaning(now) != meaning(field):
                found.append(f"{kind.full_name}: number {field.number} was {meaning(field)}, is {meaning(now)}")
            if now is not None and field.enum_type is not None and now.enum_type is not None:
                names = {value.number: value.name for value in now.enum_type.values}
                found += [
                    f"{field.enum_type.full_name}: {value.name} = {value.number} is {names.get(value.number)}"
                    for value in field.enum_type.values
                    if names.get(value.number, name_of(value)) != name_of(value)
                ]
    return found


def test_there_is_a_release() -> None:
    assert RELEASES
    assert MESSAGES


@pytest.mark.parametrize(("version", "path"), MESSAGES, ids=lambda item: item.stem if isinstance(item, Path) else item)
def test_stored_bytes_of_a_release_still_decode_to_the_same_values(version: str, path: Path) -> None:
    content = path.read_bytes()
    old = released_class(version, path.stem).FromString(content)
    new = PRESENT[path.stem].FromString(content)
    assert values(old)
    assert values(new) == values(old)
    # And back: what this program says, the released one reads.
    assert values(released_class(version, path.stem).FromString(new.SerializeToString())) == values(old)


@pytest.mark.parametrize(("version", "path"), MESSAGES, ids=lambda item: item.stem if isinstance(item, Path) else item)
def test_a_schema_changed_only_in_ways_that_both_sides_survive_or_got_a_new_generation(
    version: str, path: Path
) -> None:
    changes = incompatible(released_class(version, path.stem).DESCRIPTOR, PRESENT[path.stem].DESCRIPTOR)
    assert changes == [] or GENERATIONS.get(path.stem, 1) > 1, (
        "use a new field number and reserve the old one, or raise the type in paramove.bus.schemas.GENERATIONS"
    )


@pytest.mark.parametrize(
    ("change", "detail"),
    [
        (lambda field: setattr(field, "number", 99), "number 2 is gone and not reserved"),
        (lambda field: setattr(field, "name", "beat"), "number 2 was ('tick'"),
        (lambda field: setattr(field, "type", field.TYPE_STRING), "number 2 was ('tick'"),
        (lambda field: setattr(field, "label", field.LABEL_REPEATED), "number 2 was ('tick'"),
    ],
)
def test_an_incompatible_change_is_found(change: Any, detail: str) -> None:
    schemas = present_schemas()
    (clock,) = [
        message for file in schemas.file for message in file.message_type if f"{file.package}.{message.name}" == NAME
    ]
    change(next(field for field in clock.field if field.name == "tick"))
    changed = classes_of(schemas)[NAME]
    assert detail in "\n".join(incompatible(PRESENT[NAME].DESCRIPTOR, changed.DESCRIPTOR))


NAME = "paramove.msgs.Clock"
