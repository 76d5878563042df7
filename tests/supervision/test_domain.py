"""Folders of sockets, one run each."""

import os
import stat

import pytest

from paramove.supervision.domain import DomainError, held_domain


@pytest.fixture
def runtime(tmp_path, monkeypatch):
    path = tmp_path / "r"
    path.mkdir(mode=0o700)
    monkeypatch.setattr("paramove.supervision.domain.LONGEST_FOLDER", 500)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(path))
    return path


def test_folders_are_private_and_gone_afterwards(runtime):
    with held_domain("one", "a test") as domain:
        assert domain.folder == runtime / "paramove" / "one"
        for folder in (domain.folder, domain.truth_folder, domain.folder.parent):
            assert stat.S_IMODE(folder.stat().st_mode) == 0o700
        assert stat.S_IMODE(domain.truth_folder.parent.stat().st_mode) == 0o300
        assert domain.truth_folder.parent == runtime / "paramove" / "truth-one"
        first = domain.truth_folder.name
        assert not domain.truth_folder.is_relative_to(domain.folder)
    assert [path.name for path in (runtime / "paramove").iterdir()] == ["one.lock"]
    with held_domain("one", "a test") as domain:
        assert domain.truth_folder.name != first


def test_second_holder_is_told_of_the_first(runtime):
    with (
        held_domain("one", "a test"),
        pytest.raises(DomainError, match=rf"held by pid {os.getpid()} \(a test\).*PARAMOVE_DOMAIN"),
        held_domain("one", "another"),
    ):
        pass
    with held_domain("one", "a third"), held_domain("two", "beside it"):
        pass


def test_leftovers_of_a_killed_run_are_removed(runtime):
    (runtime / "paramove" / "one").mkdir(parents=True, mode=0o700)
    (runtime / "paramove" / "one" / "clock").touch()
    (runtime / "paramove" / "truth-one" / "xyz").mkdir(parents=True)
    (runtime / "paramove" / "truth-one").chmod(0o300)
    with held_domain("one", "a test") as domain:
        assert list(domain.folder.iterdir()) == []
        domain.truth_folder.parent.chmod(0o700)
        assert list(domain.truth_folder.parent.iterdir()) == [domain.truth_folder]


@pytest.mark.parametrize("name", ["", "..", "a/b", "A", "a" * 41, "a b"])
def test_bad_name_is_refused(runtime, name):
    with pytest.raises(DomainError, match="expected up to 40"), held_domain(name, "a test"):
        pass


@pytest.mark.parametrize("value", ["", "relative/path", "/no/such/folder"])
def test_unusable_runtime_folder_is_replaced(tmp_path, monkeypatch, value):
    monkeypatch.setenv("XDG_RUNTIME_DIR", value)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr("paramove.supervision.domain.LONGEST_FOLDER", 500)
    with held_domain("one", "a test") as domain:
        assert domain.folder == tmp_path / f"paramove-{os.getuid()}" / "one"


def test_too_long_path_is_refused_with_a_way_out(tmp_path, monkeypatch):
    long = tmp_path / ("x" * 80)
    long.mkdir()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(long))
    with pytest.raises(DomainError, match="too long for sockets; set XDG_RUNTIME_DIR"), held_domain("one", "a test"):
        pass
