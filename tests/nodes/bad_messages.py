"""Ways in which a message can be wrong: every number, text, choice and list of it in turn."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.descriptor_pb2 import DescriptorProto, FieldDescriptorProto

NUMBERS = (math.nan, math.inf, -math.inf, 1e300, -1e300)
INTEGERS = {
    FieldDescriptor.TYPE_UINT32: (0, 2**32 - 1),
    FieldDescriptor.TYPE_UINT64: (0, 2**64 - 1),
    FieldDescriptor.TYPE_INT32: (-(2**31), 0, 2**31 - 1),
    FieldDescriptor.TYPE_SINT32: (-(2**31), 0, 2**31 - 1),
    FieldDescriptor.TYPE_INT64: (-(2**63), 0, 2**63 - 1),
    FieldDescriptor.TYPE_FIXED32: (0, 2**32 - 1),
    FieldDescriptor.TYPE_ENUM: (0, 99),
    FieldDescriptor.TYPE_BOOL: (False, True),
}
VALUES: dict[int, tuple[Any, ...]] = {
    FieldDescriptor.TYPE_DOUBLE: NUMBERS,
    FieldDescriptor.TYPE_FLOAT: NUMBERS[:3],
    FieldDescriptor.TYPE_STRING: ("", "no such name", "\x00\x1b[31m\n", "x" * 5000),
    FieldDescriptor.TYPE_BYTES: (b"", b"\xff" * 7),
    **INTEGERS,
}


def repeated(message: Any) -> set[str]:
    """Names of the repeated fields."""
    form = DescriptorProto()
    message.DESCRIPTOR.CopyToProto(form)
    return {one.name for one in form.field if one.label == FieldDescriptorProto.LABEL_REPEATED}


def variants(good: Any) -> Iterator[tuple[str, Any]]:
    """(what is wrong, message) for every single fault; of lists the first and the last element."""
    yield "empty", type(good)()
    for path, change in faults(good):
        bad = type(good)()
        bad.CopyFrom(good)
        change(bad)
        yield path, bad


def faults(message: Any) -> Iterator[tuple[str, Callable[[Any], None]]]:
    many = repeated(message)
    for one in message.DESCRIPTOR.fields:
        if one.name in many:
            yield from _of_list(message, one)
        elif one.message_type is None:
            for value in VALUES[one.type]:
                yield f"{one.name}={value!r:.20}", lambda bad, name=one.name, value=value: setattr(bad, name, value)
        else:
            yield f"{one.name} missing", lambda bad, name=one.name: bad.ClearField(name)
            for path, change in faults(getattr(message, one.name)):
                yield f"{one.name}.{path}", lambda bad, name=one.name, change=change: change(getattr(bad, name))


def _of_list(message: Any, one: Any) -> Iterator[tuple[str, Callable[[Any], None]]]:
    items, name = getattr(message, one.name), one.name
    yield f"{name} none", lambda bad: bad.ClearField(name)
    yield f"{name} twice", lambda bad: getattr(bad, name).extend(list(getattr(bad, name)))
    for index in sorted({0, len(items) - 1} if items else ()):
        if one.message_type is None:
            for value in VALUES[one.type]:
                yield (
                    f"{name}[{index}]={value!r:.20}",
                    lambda bad, index=index, value=value: getattr(bad, name).__setitem__(index, value),
                )
        else:
            for path, change in faults(items[index]):
                yield (
                    f"{name}[{index}].{path}",
                    lambda bad, at=index, change=change: change(getattr(bad, name)[at]),
                )


def first_not_finite(message: Any) -> str:
    """Path of the first NaN or infinity in a message, "" for none."""
    many = repeated(message)
    for one in message.DESCRIPTOR.fields:
        values = getattr(message, one.name) if one.name in many else [getattr(message, one.name)]
        for value in values:
            if isinstance(value, float) and not math.isfinite(value):
                return f"{one.name}={value}"
            if one.message_type is not None and (found := first_not_finite(value)):
                return f"{one.name}.{found}"
    return ""
