"""Files that are missing, no files, too large or no text: one message with path, what was found and what helps."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from paramove.documents.files import read_bytes, read_text
from paramove.documents.input_error import InputError
from paramove.documents.positions import read_document


class MapError(InputError):
    """Of this test."""


def test_a_text_is_read_without_its_byte_order_mark(tmp_path: Path) -> None:
    path = tmp_path / "map.txt"
    path.write_bytes(b"\xef\xbb\xbfa\xc3\xa9")
    assert read_text(path, "map") == "aé"
    assert read_bytes(path, "map") == b"\xef\xbb\xbfa\xc3\xa9"


@pytest.mark.parametrize(
    ("make", "told", "missing"),
    [
        (lambda path: None, "there is no map {path}; draw one", True),
        (lambda path: path.mkdir(), "{path}: expected a map, found a folder or device; draw one", False),
        (lambda path: path.symlink_to("/dev/zero"), "found a folder or device", False),
        (
            lambda path: path.write_bytes(bytes(2**20 + 1)),
            "{path}: expected a map of at most 1 MB, found 1.0 MB",
            False,
        ),
        (lambda path: path.write_bytes(b"a\xff"), "{path}: expected a map; it cannot be read as UTF-8 text", False),
    ],
)
def test_what_is_no_file_of_that_kind_is_told(
    tmp_path: Path, make: Callable[[Path], object], told: str, missing: bool
) -> None:
    path = tmp_path / "map.txt"
    make(path)
    with pytest.raises(MapError) as rejection:
        read_text(path, "map", MapError, 2**20, "draw one")
    assert told.format(path=path) in str(rejection.value)
    assert rejection.value.missing is missing


def test_a_file_that_may_not_be_read_comes_with_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def denied(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    path = tmp_path / "map.txt"
    path.touch()
    monkeypatch.setattr(Path, "open", denied)  # root may read everything
    with pytest.raises(MapError, match=r"chmod u\+r"):
        read_bytes(path, "map", MapError)


def test_a_document_is_a_mapping_with_positions(tmp_path: Path) -> None:
    path = tmp_path / "map.yaml"
    path.write_text("roads:\n  - a\n  - b\n")
    found = read_document(path, "map")
    assert found.data == {"roads": ["a", "b"]}
    assert found.position(("roads", "1")).line == 3
    path.write_text("- a\n")
    with pytest.raises(MapError, match=r"map\.yaml:1:1: .*found a list; expected a map in YAML; draw one"):
        read_document(path, "map", MapError, "draw one")
