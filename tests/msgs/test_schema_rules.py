"""The rules of msgs/README.md that a machine can check."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCHEMAS = sorted((ROOT / "msgs").glob("*.proto"))


def _file(schema: Path) -> Any:
    return importlib.import_module(f"paramove.msgs.{schema.stem}_pb2").DESCRIPTOR


def _messages(schema: Path) -> list[Any]:
    found, waiting = [], list(_file(schema).message_types_by_name.values())
    while waiting:
        message = waiting.pop()
        found.append(message)
        waiting += message.nested_types
    return found


@pytest.mark.parametrize("schema", SCHEMAS, ids=lambda path: path.stem)
def test_package_and_import_path(schema: Path) -> None:
    assert _file(schema).package == "paramove.msgs"
    assert _file(schema).name == f"paramove/msgs/{schema.name}"


@pytest.mark.parametrize("schema", SCHEMAS, ids=lambda path: path.stem)
def test_zero_of_every_enum_is_unspecified(schema: Path) -> None:
    for message in _messages(schema):
        for enum in message.enum_types:
            assert enum.values_by_number[0].name.endswith("_UNSPECIFIED"), enum.full_name


@pytest.mark.parametrize("schema", SCHEMAS, ids=lambda path: path.stem)
def test_only_crc_checked_fields_are_opaque_bytes(schema: Path) -> None:
    for message in _messages(schema):
        for field in message.fields:
            if field.type == field.TYPE_BYTES:
                assert "crc" in message.fields_by_name, field.full_name
