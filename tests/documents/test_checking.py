"""Models of documents: what is valid at a path, and findings with positions."""

from __future__ import annotations

from dataclasses import dataclass

import pytest
from pydantic import BaseModel, ConfigDict

from paramove.documents import DocumentError, read_mapping
from paramove.documents.checking import checked, keys_at


@dataclass
class Point:
    x: float = 0.0
    y: float = 0.0


class Part(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)

    size: float
    at: Point | None = None


class Whole(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)

    name: str = ""
    parts: list[Part] = []
    named: dict[str, Part] = {}


@pytest.mark.parametrize(
    ("path", "keys"),
    [
        ([], ["name", "parts", "named"]),
        (["parts", "3"], ["size", "at"]),
        (["named", "a"], ["size", "at"]),
        (["named", "a", "at"], ["x", "y"]),
        (["parts"], []),
        (["name", "a"], []),
        (["unknown", "a", "b"], []),
    ],
)
def test_keys_that_are_valid_at_a_path(path: list[str], keys: list[str]) -> None:
    assert keys_at(Whole, path) == keys


def test_a_mistyped_key_is_one_finding_at_its_position() -> None:
    document = read_mapping("name: a\nparts:\n- {sice: 1.0}\nnamed: {b: {size: '2'}}\n", "file.yaml")
    with pytest.raises(DocumentError) as error:
        checked(Whole, document)
    first, second = str(error.value).splitlines()
    assert first.startswith("file.yaml:3:4:")
    assert "'sice'" in first
    assert "'size'" in first
    assert second.startswith("file.yaml:4:")
    assert "without quotes" in second
