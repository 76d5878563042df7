"""Fields of protobuf messages of any type, also one that has maps, or is a part of itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cache
from typing import Any

from google.protobuf.descriptor import Descriptor, FieldDescriptor  # type: ignore[import-untyped]
from google.protobuf.descriptor_pb2 import DescriptorProto, FieldDescriptorProto  # type: ignore[import-untyped]

_TIMESTAMP = "google.protobuf.Timestamp"
FieldTest = Callable[[FieldDescriptor], bool]


def is_map(field: FieldDescriptor) -> bool:
    """Whether a field is a map."""
    return field.message_type is not None and field.message_type.GetOptions().map_entry


def value_of(field: FieldDescriptor) -> FieldDescriptor:
    """The field that has the type of a field's values: of a map that of its entries' values, else the field itself."""
    return field.message_type.fields_by_name["value"] if is_map(field) else field


def is_repeated(field: FieldDescriptor) -> bool:
    """Whether a field is a list or a map."""
    return field.name in _repeated(field.containing_type)


@cache
def _repeated(descriptor: Descriptor) -> frozenset[str]:
    form = DescriptorProto()
    descriptor.CopyToProto(form)  # has the labels in every release of protobuf
    return frozenset(one.name for one in form.field if one.label == FieldDescriptorProto.LABEL_REPEATED)


def parts(field: FieldDescriptor, value: Any) -> Iterable[Any]:
    """The values in a field: of a list, of a map, or the one that it has."""
    if is_map(field):
        return list(value.values())
    return value if is_repeated(field) else (value,)


def times_in(message: Any) -> Iterator[Any]:
    """Every `google.protobuf.Timestamp` in a message and its parts, itself included; they may be changed."""
    if message.DESCRIPTOR.full_name == _TIMESTAMP:
        yield message
        return
    for field, value in message.ListFields():
        kind = value_of(field).message_type
        if kind is not None and _has_times(kind):  # the thousands of points of a trajectory have none
            for part in parts(field, value):
                yield from times_in(part)


@cache
def _has_times(descriptor: Descriptor) -> bool:
    return descriptor.full_name == _TIMESTAMP or any_field(descriptor, _is_time)


def _is_time(field: FieldDescriptor) -> bool:
    return field.message_type is not None and field.message_type.full_name == _TIMESTAMP


def any_field(descriptor: Descriptor, test: FieldTest) -> bool:
    """Whether a field of a message type, or of a part of it at any depth, passes a test."""
    seen = {descriptor.full_name}
    open_types = [descriptor]
    while open_types:
        for field in open_types.pop().fields:
            if test(field):
                return True
            if field.message_type is not None and field.message_type.full_name not in seen:
                seen.add(field.message_type.full_name)
                open_types.append(field.message_type)
    return False


def written_out(descriptor: Descriptor) -> str:
    """A message type, and those in it but Google's, as in a `.proto` file."""
    seen = {descriptor.full_name}
    blocks = []
    waiting = [descriptor]
    while waiting:
        one = waiting.pop(0)
        blocks.append(_block(one))
        for field in one.fields:
            part = value_of(field).message_type
            if part is not None and part.full_name not in seen and not part.full_name.startswith("google."):
                seen.add(part.full_name)
                waiting.append(part)
    return "\n\n".join(blocks)


def _block(descriptor: Descriptor) -> str:
    lines = [f"message {descriptor.full_name} {{"]
    kinds = [value_of(field).enum_type for field in descriptor.fields]
    enumerations = {kind.full_name: kind for kind in kinds if kind is not None}
    for name, enumeration in enumerations.items():
        numbers = " ".join(f"{value.name} = {value.number};" for value in enumeration.values)
        lines.append(f"  enum {name} {{ {numbers} }}")
    for field in descriptor.fields:
        choice = field.containing_oneof
        is_optional = choice is not None and len(choice.fields) == 1 and choice.name == f"_{field.name}"
        kind = "optional " if is_optional else "repeated " if is_repeated(field) and not is_map(field) else ""
        of_choice = "" if choice is None or is_optional else f"  // one of {choice.name}"
        lines.append(f"  {kind}{_type_name(field)} {field.name} = {field.number};{of_choice}")
    return "\n".join([*lines, "}"])


def _type_name(field: FieldDescriptor) -> str:
    if is_map(field):
        return f"map<{_type_name(field.message_type.fields_by_name['key'])}, {_type_name(value_of(field))}>"
    if field.message_type is not None:
        return str(field.message_type.full_name)
    if field.enum_type is not None:
        return str(field.enum_type.full_name)
    return str(FieldDescriptorProto.Type.Name(field.type)).removeprefix("TYPE_").lower()
