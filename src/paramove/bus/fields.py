"""Fields of protobuf messages of any type, also one that has maps, or is a part of itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cache
from typing import Any

from google.protobuf.descriptor import Descriptor, EnumDescriptor, FieldDescriptor  # type: ignore[import-untyped]
from google.protobuf.descriptor_pb2 import DescriptorProto, FieldDescriptorProto  # type: ignore[import-untyped]

OWN_FOLDER = "msgs"
"""Of a workspace: with its own messages and topics."""
_TIMESTAMP = "google.protobuf.Timestamp"
FieldTest = Callable[[FieldDescriptor], bool]


def is_own(descriptor: Descriptor) -> bool:
    """Whether a message type is of a workspace, not of a library."""
    return str(descriptor.file.name).startswith(f"{OWN_FOLDER}/")


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


def _changed_value(present: EnumDescriptor, former: EnumDescriptor) -> str:
    """What a value of an enumeration is now; "" if each has its number still."""
    for value in former.values:
        known = present.values_by_number.get(value.number) or present.values_by_name.get(value.name)
        if known is not None and (known.name, known.number) != (value.name, value.number):
            return f"'{value.name} = {value.number}' is '{known.name} = {known.number}' now"
    return ""


def is_not_of_google(descriptor: Descriptor) -> bool:
    """Whether a message type is another than Google's, which everybody knows."""
    return not str(descriptor.full_name).startswith("google.")


def changed_field(present: Descriptor, former: Descriptor) -> str:
    """What a field is now that messages of the former definition would be misread by; "" if they can be read.

    A field that only one of the two has is no change: it is left out, or absent.
    """
    seen = set[str]()
    waiting = [(present, former)]
    while waiting:
        new, old = waiting.pop()
        if new.full_name in seen:
            continue
        seen.add(new.full_name)
        for field in old.fields:
            known = new.fields_by_number.get(field.number) or new.fields_by_name.get(field.name)
            if known is None:
                continue
            if _written(known) != _written(field):
                return f"'{_written(field)}' is '{_written(known)}' now"
            if known.enum_type is not None and (changed := _changed_value(known.enum_type, field.enum_type)):
                return changed
            part, old_part = value_of(known).message_type, value_of(field).message_type
            if part is not None and is_own(part):
                waiting.append((part, old_part))
    return ""


def written_out(descriptor: Descriptor, only: Callable[[Descriptor], bool] = is_not_of_google) -> str:
    """A message type, and those in it that pass `only`, as in a `.proto` file."""
    seen = {descriptor.full_name}
    blocks = []
    waiting = [descriptor]
    while waiting:
        one = waiting.pop(0)
        blocks.append(_block(one))
        for field in one.fields:
            part = value_of(field).message_type
            if part is not None and part.full_name not in seen and only(part):
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
        choice = None if _is_optional(field) else field.containing_oneof
        of_choice = "" if choice is None else f"  // one of {choice.name}"
        lines.append(f"  {_written(field)};{of_choice}")
    return "\n".join([*lines, "}"])


def _written(field: FieldDescriptor) -> str:
    """A field as in a `.proto` file, such as `repeated double angle = 1`."""
    kind = "optional " if _is_optional(field) else "repeated " if is_repeated(field) and not is_map(field) else ""
    return f"{kind}{_type_name(field)} {field.name} = {field.number}"


def _is_optional(field: FieldDescriptor) -> bool:
    choice = field.containing_oneof
    return choice is not None and len(choice.fields) == 1 and choice.name == f"_{field.name}"


def _type_name(field: FieldDescriptor) -> str:
    if is_map(field):
        return f"map<{_type_name(field.message_type.fields_by_name['key'])}, {_type_name(value_of(field))}>"
    if field.message_type is not None:
        return str(field.message_type.full_name)
    if field.enum_type is not None:
        return str(field.enum_type.full_name)
    return str(FieldDescriptorProto.Type.Name(field.type)).removeprefix("TYPE_").lower()
