"""Keys of hosts: made once, private, pinned."""

from __future__ import annotations

import stat
from pathlib import Path

import pytest

from paramove.hosts import HostKeyError, HostKeys

KEY, OTHER = "a" * 40, "b" * 40


@pytest.fixture
def keys(tmp_path):
    return HostKeys(tmp_path / "hosts")


def test_the_own_pair_is_made_once_and_is_private(keys):
    pair = keys.own()
    assert keys.own() == pair
    assert len(pair.public) == len(pair.secret) == 40
    assert stat.S_IMODE((keys.folder / "own.key").stat().st_mode) == 0o600
    assert stat.S_IMODE(keys.folder.stat().st_mode) == 0o700


@pytest.mark.parametrize("mode", [0o644, 0o640, 0o602])
def test_a_secret_key_that_others_can_read_is_rejected(keys, mode):
    keys.own()
    (keys.folder / "own.key").chmod(mode)
    with pytest.raises(HostKeyError, match="chmod 600"):
        keys.own()


def test_a_damaged_pair_is_rejected(keys):
    keys.own()
    (keys.folder / "own.key").write_text("nothing of use")
    with pytest.raises(HostKeyError, match=r"own\.key"):
        keys.own()


def test_a_key_is_pinned_and_a_changed_one_is_rejected_with_both(keys):
    assert keys.trusted() == {}
    assert keys.trust("lab-cam", KEY)
    assert not keys.trust("lab-cam", KEY)
    assert keys.trust("robot", OTHER)
    with pytest.raises(HostKeyError, match=f"{KEY}.*{OTHER}"):
        keys.trust("lab-cam", OTHER)
    assert keys.trusted() == {"lab-cam": KEY, "robot": OTHER}


@pytest.mark.parametrize(
    ("name", "key"), [("", KEY), ("a b", KEY), ("a\nb", KEY), ("lab", "short"), ("lab", "\n" * 40)]
)
def test_what_is_no_name_or_no_key_is_rejected(keys, name, key):
    with pytest.raises(HostKeyError):
        keys.trust(name, key)
    assert keys.trusted() == {}


def test_a_damaged_list_is_rejected_with_the_line(keys):
    keys.trust("lab-cam", KEY)
    with (keys.folder / "trusted").open("a") as file:
        file.write("what is this\n")
    with pytest.raises(HostKeyError, match=":2:"):
        keys.trusted()


@pytest.mark.parametrize(
    "thing", ["a file for the folder", "no folder can be made", "a folder for the pair", "a folder for the trusted"]
)
def test_a_folder_of_keys_that_cannot_be_used_is_named(tmp_path, thing):
    folder = Path("/proc/nowhere/hosts") if thing == "no folder can be made" else tmp_path / "hosts"
    if thing == "a file for the folder":
        folder.write_text("")
    elif thing == "a folder for the pair":
        (folder / "own.key").mkdir(parents=True)
        (folder / "own.key").chmod(0o700)
    elif thing == "a folder for the trusted":
        (folder / "trusted").mkdir(parents=True)
    keys = HostKeys(folder)
    with pytest.raises(HostKeyError, match=str(folder)):
        keys.trust("other", keys.own().public)
