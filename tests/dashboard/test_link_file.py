"""The file with the page's link."""

from __future__ import annotations

import stat
from pathlib import Path

import pytest

from paramove.dashboard.link_file import NAME, LinkFile, link_in


def test_a_page_that_comes_back_has_the_same_secrets(tmp_path: Path) -> None:
    first = LinkFile.stored_or_new(tmp_path, 0).at(4711)
    first.write()
    assert LinkFile.stored_or_new(tmp_path, 0) == first
    assert link_in(tmp_path) == first.link == f"http://127.0.0.1:4711/?token={first.secrets.token}"


def test_only_its_owner_may_read_it_and_nothing_is_left_beside(tmp_path: Path) -> None:
    LinkFile.stored_or_new(tmp_path, 4711).write()
    assert [path.name for path in tmp_path.iterdir()] == [NAME]
    assert stat.S_IMODE((tmp_path / NAME).stat().st_mode) == 0o600


def test_secrets_are_long_and_new_each_time(tmp_path: Path) -> None:
    files = [LinkFile.stored_or_new(tmp_path, 0) for _ in range(20)]
    words = [word for file in files for word in (file.secrets.token, file.secrets.session, file.secrets.key)]
    assert len(set(words)) == 60
    assert min(map(len, words)) >= 32


def test_a_fresh_token_leaves_the_session(tmp_path: Path) -> None:
    file = LinkFile.stored_or_new(tmp_path, 0)
    fresh = file.with_fresh_token()
    assert fresh.secrets.token != file.secrets.token
    assert (fresh.secrets.session, fresh.secrets.key) == (file.secrets.session, file.secrets.key)


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b"null", b'{"port": "x"}', b'{"link": 1}', b"\xff\xfe", b"{}"])
def test_a_damaged_file_is_as_good_as_none(tmp_path: Path, content: bytes) -> None:
    (tmp_path / NAME).write_bytes(content)
    assert not link_in(tmp_path).startswith("http")
    assert LinkFile.stored_or_new(tmp_path, 4711).port == 4711


def test_it_goes_when_the_page_ends(tmp_path: Path) -> None:
    file = LinkFile.stored_or_new(tmp_path, 0)
    file.write()
    file.remove()
    file.remove()
    assert link_in(tmp_path) == ""
