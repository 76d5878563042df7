"""Checks the numbers in a message: finite, below 1e12, valid times, known values of enumerations.

Protobuf carries NaN and infinity, and a clamp may turn NaN into full travel. It also carries any number in place of an
enumeration's value, which then has no name. So no such message reaches a node.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

from google.protobuf.descriptor import Descriptor, FieldDescriptor  # type: ignore[import-untyped]
from google.protobuf.message_factory import GetMessageClass  # type: ignore[import-untyped]

from paramove.bus.fields import any_field, is_map, is_repeated, value_of

LARGEST = 1e12
"""Of any number; real values in SI units, pixels or counts are far smaller."""
LATEST_S = 9_000_000_000
"""Of times; nanoseconds since the epoch of any clock have to fit into 64 bits."""
LATEST_NS = LATEST_S * 1_000_000_000

_FLOATS = (FieldDescriptor.TYPE_DOUBLE, FieldDescriptor.TYPE_FLOAT)
_TIMES = ("google.protobuf.Timestamp", "google.protobuf.Duration")

_Check = Callable[[Any], str]


def unsound(message: Any) -> str:
    """Path and value of the first bad number of a message, such as `points[3].time_s is nan`; "" for none."""
    return _first(message, False)


def impossible_time(message: Any) -> str:
    """Path and value of the first impossible time of a message; "" for none. Takes less time than `unsound`."""
    return _first(message, True)


def has_times(descriptor: Descriptor) -> bool:
    """Whether messages of a type hold times."""
    return bool(_checks(descriptor, True))


def _first(message: Any, times_only: bool) -> str:
    for check in _checks(message.DESCRIPTOR, times_only):
        reason = check(message)
        if reason:
            return reason
    return ""


@cache
def _checks(descriptor: Descriptor, times_only: bool) -> tuple[_Check, ...]:
    """The checks of a message type; none for a type without numbers."""
    if descriptor.full_name in _TIMES:
        return (_time,)
    made = (_check_of(field, times_only) for field in descriptor.fields)
    return tuple(check for check in made if check is not None)


def _check_of(field: FieldDescriptor, times_only: bool) -> _Check | None:
    """The check of one field; None where nothing in it is to be checked."""
    name, repeated = field.name, is_repeated(field)
    if is_map(field):
        value_check = _check_of(value_of(field), times_only)
        return None if value_check is None else lambda message: _inside_map(field, message, value_check)
    if field.message_type is not None:
        if not _has_numbers(field.message_type, times_only):
            return None
        if repeated:
            return lambda message: _inside_many(name, getattr(message, name), times_only)
        return lambda message: _inside(name, getattr(message, name), times_only) if message.HasField(name) else ""
    if times_only:
        return None
    if field.enum_type is not None:
        known = frozenset(field.enum_type.values_by_number)
        return lambda message: _of_enumeration(name, getattr(message, name), known, repeated)
    if field.type not in _FLOATS:
        return None
    if repeated:
        return lambda message: _of_many(name, getattr(message, name))
    return lambda message: _of_number(name, getattr(message, name))


@cache
def _has_numbers(descriptor: Descriptor, times_only: bool) -> bool:
    """Whether a message type has something to be checked, or a part of it has."""

    def is_checked(field: FieldDescriptor) -> bool:
        if field.message_type is not None:
            return field.message_type.full_name in _TIMES
        return not times_only and (field.enum_type is not None or field.type in _FLOATS)

    return descriptor.full_name in _TIMES or any_field(descriptor, is_checked)


def _inside_map(field: FieldDescriptor, message: Any, value_check: _Check) -> str:
    entry = GetMessageClass(field.message_type)
    for key, value in getattr(message, field.name).items():
        reason = value_check(entry(value=value))
        if reason:
            return f"{field.name}[{key!r}]{reason.removeprefix('value')}"
    return ""


def _of_number(name: str, value: float) -> str:
    return "" if -LARGEST <= value <= LARGEST else f"{name} is {value:g}"


def _of_many(name: str, values: Any) -> str:
    if sum(map(abs, values)) <= LARGEST:
        return ""
    for index, value in enumerate(values):
        reason = _of_number(f"{name}[{index}]", value)
        if reason:
            return reason
    return ""


def _of_enumeration(name: str, found: Any, known: frozenset[int], repeated: bool) -> str:
    unknown = set(found if repeated else (found,)) - known
    return f"{name} is {min(unknown)}, which has no name" if unknown else ""


def _inside_many(name: str, messages: Any, times_only: bool) -> str:
    for index, message in enumerate(messages):
        reason = _inside(f"{name}[{index}]", message, times_only)
        if reason:
            return reason
    return ""


def _inside(name: str, message: Any, times_only: bool) -> str:
    reason = _first(message, times_only)
    return f"{name}.{reason}" if reason else ""


def _time(message: Any) -> str:
    if 0 <= message.seconds <= LATEST_S and 0 <= message.nanos < 1_000_000_000:
        return ""
    return f"seconds is {message.seconds} with {message.nanos} ns"
