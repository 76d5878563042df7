"""The file with the page's link."""

from __future__ import annotations

import errno
import stat
from pathlib import Path

import pytest

from paramove.dashboard import link_file
from paramove.dashboard.link_file import NAME, LinkFile, link_in


def test_all_secrets_end_with_the_process_and_the_next_one_has_the_key_that_was_kept_for_it(tmp_path: Path) -> None:
    first = LinkFile.following(tmp_path, 0).at(4711)
    first.write()
    second = LinkFile.following(tmp_path, 0)
    assert second.port == 4711
    assert second.secrets.key == first.next_key
    used = {first.secrets.token, first.secrets.session, first.secrets.key}
    assert not used & {second.secrets.token, second.secrets.session, second.secrets.key, second.next_key}
    assert second.next_key != first.next_key


def test_the_file_has_no_secret_of_the_running_page_but_its_link(tmp_path: Path) -> None:
    file = LinkFile.following(tmp_path, 4711)
    file.write()
    assert link_in(tmp_path) == file.link == f"http://127.0.0.1:4711/?token={file.secrets.token}"
    content = (tmp_path / NAME).read_text()
    assert file.secrets.key not in content
    assert file.secrets.session not in content


def test_a_file_that_cannot_be_written_leaves_no_older_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    LinkFile.following(tmp_path, 4711).write()

    def fails(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(link_file, "replacing", fails)
    LinkFile.following(tmp_path, 4711).write()
    assert not (tmp_path / NAME).exists()


def test_only_its_owner_may_read_it_and_nothing_is_left_beside(tmp_path: Path) -> None:
    LinkFile.following(tmp_path, 4711).write()
    assert [path.name for path in tmp_path.iterdir()] == [NAME]
    assert stat.S_IMODE((tmp_path / NAME).stat().st_mode) == 0o600


def test_secrets_are_long_and_new_each_time(tmp_path: Path) -> None:
    files = [LinkFile.following(tmp_path, 0) for _ in range(20)]
    words = []
    for file in files:
        words += [file.secrets.token, file.secrets.session, file.secrets.key, file.next_key]
    assert len(set(words)) == 80
    assert min(map(len, words)) >= 32


def test_a_fresh_token_leaves_the_session(tmp_path: Path) -> None:
    file = LinkFile.following(tmp_path, 0)
    fresh = file.with_fresh_token()
    assert fresh.secrets.token != file.secrets.token
    assert (fresh.secrets.session, fresh.secrets.key) == (file.secrets.session, file.secrets.key)


@pytest.mark.parametrize(
    "content",
    [b"", b"{", b"[]", b"null", b'{"port": "x"}', b'{"link": 1}', b"\xff\xfe", b"{}", b'{"port": 1, "next_key": ""}'],
)
def test_a_damaged_file_is_as_good_as_none(tmp_path: Path, content: bytes) -> None:
    (tmp_path / NAME).write_bytes(content)
    assert not link_in(tmp_path).startswith("http")
    assert LinkFile.following(tmp_path, 4711).port == 4711


def test_it_goes_when_the_page_ends(tmp_path: Path) -> None:
    file = LinkFile.following(tmp_path, 0)
    file.write()
    file.remove()
    file.remove()
    assert link_in(tmp_path) == ""
