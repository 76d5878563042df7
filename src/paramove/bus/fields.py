"""Fields of protobuf messages of any type, also one that has maps, or is a part of itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache
from typing import Any

from google.protobuf.descriptor import Descriptor, FieldDescriptor  # type: ignore[import-untyped]
from google.protobuf.descriptor_pb2 import DescriptorProto, FieldDescriptorProto  # type: ignore[import-untyped]

FieldTest = Callable[[FieldDescriptor], bool]


def is_map(field: FieldDescriptor) -> bool:
    """Whether a field is a map; its value is called `value` in the message type of its entries."""
    return field.message_type is not None and field.message_type.GetOptions().map_entry


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
