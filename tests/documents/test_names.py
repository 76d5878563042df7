"""The check of names that become files."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from pydantic import BaseModel, ValidationError

from paramove.bus import default_folder, socket_path
from paramove.documents import FileName, InputError, checked_name, is_identifier, name_fault
from paramove.supervision.run_folder import RunFolder

BAD = [
    *("", " ", ".", "..", "../x", "/etc/x", "a/b", "a/", "..\\x", ".hidden", "-rf", "a\nb", "a\0b", "a\tb"),
    *("\x1b[2J", "a\u202eb", " a", "a ", "a" * 201, "ä" * 101, "a\ud800", os.fsdecode(b"a\xff")),
]
GOOD = ["reaching", "Zeigen nach links", "reach (left)", "pick&place: 2", "हाथ मिलाना", "握手", "a" * 200, "e\u0301"]


class Named(BaseModel):
    name: FileName


@pytest.mark.parametrize("name", BAD)
def test_what_is_no_name_of_a_file_is_rejected(name: str) -> None:
    assert name_fault(name)
    with pytest.raises(InputError) as wrong:
        checked_name(name, "action")
    assert str(wrong.value).isprintable()
    assert len(str(wrong.value)) < 250
    with pytest.raises(ValidationError) as wrong_field:
        Named(name=name)
    assert wrong_field.value.errors()[0]["type"] in ("file_name", "string_unicode")


@pytest.mark.parametrize("name", GOOD)
def test_other_names_make_a_file_in_the_folder(name: str, tmp_path: Path) -> None:
    assert checked_name(name, "action") == Named(name=name).name == name
    file = tmp_path / f".{name}.model.4194304.part.training.json"  # the longest that is made of one
    file.touch()
    assert file.parent == tmp_path
    assert [path.name for path in tmp_path.iterdir()] == [file.name]


@pytest.mark.parametrize("name", ["node", "a1_b", "a" * 40])
def test_an_identifier_can_be_the_name_of_a_file(name: str) -> None:
    assert is_identifier(name)
    assert not name_fault(name)


@pytest.mark.parametrize("name", ["", "A", "1a", "a-b", "a/b", "a\n", "ä", "a" * 41])
def test_what_is_no_identifier_is_rejected(name: str) -> None:
    assert not is_identifier(name)


def test_names_are_checked_where_they_are_joined_to_a_path(tmp_path: Path) -> None:
    for join in (default_folder, RunFolder(tmp_path).log, RunFolder(tmp_path).config):
        with pytest.raises(InputError):
            join("../x")
    for topic in ("..", "", "a\0b", "a\ud800"):
        with pytest.raises(InputError):
            socket_path(tmp_path, topic)
