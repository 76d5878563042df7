"""Checks the numbers in a message: finite, below 1e12, valid times.

Protobuf carries NaN and infinity, and a clamp may turn NaN into full travel. So no such message reaches a node.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

from google.protobuf.descriptor import Descriptor, FieldDescriptor  # type: ignore[import-untyped]
from google.protobuf.descriptor_pb2 import DescriptorProto, FieldDescriptorProto  # type: ignore[import-untyped]

LARGEST = 1e12
"""Of any number; real values in SI units, pixels or counts are far smaller."""
LATEST_S = 9_000_000_000
"""Of times; nanoseconds since the epoch of any clock have to fit into 64 bits."""

_FLOATS = (FieldDescriptor.TYPE_DOUBLE, FieldDescriptor.TYPE_FLOAT)
_TIMES = ("google.protobuf.Timestamp", "google.protobuf.Duration")

_Check = Callable[[Any], str]


def unsound(message: Any) -> str:
    """Path and value of the first bad number of a message, such as `points[3].time_s is nan`; "" for none."""
    for check in _checks(message.DESCRIPTOR):
        reason = check(message)
        if reason:
            return reason
    return ""


@cache
def _checks(descriptor: Descriptor) -> tuple[_Check, ...]:
    """The checks of a message type; none for a type without numbers."""
    if descriptor.full_name in _TIMES:
        return (_time,)
    form = DescriptorProto()
    descriptor.CopyToProto(form)  # has the labels in every release of protobuf
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
        reason = _of_number(f"{name}[{index}]", value) if are_numbers else _inside(f"{name}[{index}]", value)
        if reason:
            return reason
    return ""


def _inside(name: str, message: Any) -> str:
    reason = unsound(message)
    return f"{name}.{reason}" if reason else ""


def _time(message: Any) -> str:
    if 0 <= message.seconds <= LATEST_S and 0 <= message.nanos < 1_000_000_000:
        return ""
    return f"seconds is {message.seconds} with {message.nanos} ns"
