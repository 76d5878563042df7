"""Whether the numbers in a message can be numbers of this world: finite, not beyond all size, times that exist.

Protobuf carries NaN and infinity, and a clamp may iteration NaN into full travel. So no such message reaches a node.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

from google.protobuf.descriptor import Descriptor, FieldDescriptor  # type: ignore[import-untyped]
from google.protobuf.descriptor_pb2 import DescriptorProto, FieldDescriptorProto  # type: ignore[import-untyped]

LARGEST = 1e12
"""Of any number; in SI units, pixels or counts nothing real comes near."""
LATEST_S = 9_000_000_000
"""Of times; nanoseconds since the epoch of any clock have to fit into 64 bits."""

_FLOATS = (FieldDescriptor.TYPE_DOUBLE, FieldDescriptor.TYPE_FLOAT)
_TIMES = ("google.protobuf.Timestamp", "google.protobuf.Duration")

_Check = Callable[[Any], str]


def unsound(message: Any) -> str:
    """Where the first bad number of a message is and what it is, such as `points[3].time_s is nan`; "" for none."""
    for check in _checks(message.DESCRIPTOR):
        found = check(message)
        if found:
            return found
    return ""


@cache
def _checks(descriptor: Descriptor) -> tuple[_Check, ...]:
    """What is to be looked at in a message type; a type without numbers costs nothing."""
    if descriptor.full_name in _TIMES:
        return (_time,)
    form = DescriptorProto()
    descriptor.CopyToProto(form)  # tells what is repeated in every release of protobuf
    repeated = {one.name for one in form.field if one.label == FieldDescriptorProto.LABEL_REPEATED}
    made = (_check_of(one, one.name in repeated) for one in descriptor.fields if _is_number(one) or _holds_numbers(one))
    return tuple(made)


def _is_number(one: FieldDescriptor) -> bool:
    return one.type in _FLOATS


def _holds_numbers(one: FieldDescriptor) -> bool:
    return one.message_type is not None and bool(_checks(one.message_type))


def _check_of(one: FieldDescriptor, repeated: bool) -> _Check:
    name, is_number = one.name, _is_number(one)
    if repeated:
        return lambda message: _of_many(name, getattr(message, name), is_number)
    if is_number:
        return lambda message: _of_number(name, getattr(message, name))
    return lambda message: _inside(name, getattr(message, name)) if message.HasField(name) else ""


def _of_number(name: str, value: float) -> str:
    return "" if -LARGEST <= value <= LARGEST else f"{name} is {value:g}"


def _of_many(name: str, values: Any, are_numbers: bool) -> str:
    if are_numbers and sum(map(abs, values)) <= LARGEST:
        return ""
    for index, value in enumerate(values):
        found = _of_number(f"{name}[{index}]", value) if are_numbers else _inside(f"{name}[{index}]", value)
        if found:
            return found
    return ""


def _inside(name: str, message: Any) -> str:
    found = unsound(message)
    return f"{name}.{found}" if found else ""


def _time(message: Any) -> str:
    if 0 <= message.seconds <= LATEST_S and 0 <= message.nanos < 1_000_000_000:
        return ""
    return f"seconds is {message.seconds} with {message.nanos} ns"
