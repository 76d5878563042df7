"""The files of the pose network: fetched once inside a published package, checked, stored in the user's cache."""

from __future__ import annotations

import contextlib
import hashlib
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from platformdirs import user_cache_path

from paramove.documents import InputError, replacing
from paramove.observation.pose_network import PoseNetwork

PIP = (sys.executable, "-P", "-m", "pip", "--disable-pip-version-check", "download", "--no-deps", "--only-binary=:all:")
SYSTEM = ("--platform", "manylinux_2_28_x86_64", "--python-version", "3.11", "--implementation", "cp", "--abi", "cp311")
"""Of the one wheel whose hash is known; nothing in it is run."""


@dataclass(frozen=True)
class Package:
    """A published package with networks in it.

    Attributes:
        name: With its version, as its program names it.
        sha256: Of its file.
        networks: Name in it -> SHA-256.
        command: Downloads it, followed by a folder and the name.
        option: Of `paramove webcam setup` that takes the file instead.
        remedy: How to get it.
    """

    name: str
    sha256: str
    networks: dict[str, str]
    command: Sequence[str]
    option: str
    remedy: str


USUAL = Package(
    name="mediapipe==0.10.21",  # Apache-2.0; later versions lack the files
    sha256="05dc4a9e593655a79558d05d6227d31018c2537a4bd3362b51e230cf22aecfe3",
    networks={
        "mediapipe/modules/pose_landmark/pose_landmark_full.tflite": (
            "e9a5c5cb17f736fafd4c2ec1da3b3d331d6edbe8a0d32395855aeb2cdfd64b9f"
        ),
        "mediapipe/modules/hand_landmark/hand_landmark_full.tflite": (
            "11c272b891e1a99ab034208e23937a8008388cf11ed2a9d776ed3d01d0ba00e3"
        ),
    },
    command=(*PIP, *SYSTEM, "--dest"),
    option="--wheel FILE",
    remedy="`paramove webcam setup` fetches it once (35.6 MB)",
)
"""Of the body and of the hand."""
HEAVY = Package(
    name="@mediapipe/pose@0.5.1675469404",  # Apache-2.0
    sha256="8bb349a7b3a3ba699df23be804ddd3b3eab810b50b15406894be257859388a84",
    networks={"package/pose_landmark_heavy.tflite": "59e42d71bcd44cbdbabc419f0ff76686595fd265419566bd4009ef703ea8e1fe"},
    command=("npm", "pack", "--pack-destination"),
    option="--heavy-package FILE",
    remedy="`paramove webcam setup --heavy` fetches it once (41 MB, needs npm)",
)
"""Of the body, four times as slow and more exact: for recordings, not for live images."""


def default_folder() -> Path:
    """In the user's cache."""
    return user_cache_path("paramove") / "networks"


def stored_network(folder: Path | None = None, *, offline: bool = False) -> PoseNetwork:
    """The network of a folder, by default of the user's cache; offline the heavy one for the body, if it is there.

    Raises InputError if a file is missing or damaged.
    """
    return PoseNetwork(*checked_networks(folder, offline=offline))


def checked_networks(folder: Path | None = None, *, offline: bool = False) -> tuple[Path, Path]:
    """The files of body and hand that `stored_network` loads. Raises InputError if one is missing or damaged."""
    folder = default_folder() if folder is None else folder
    pose, hand = _checked(folder, USUAL)
    if offline and has_heavy(folder):
        (pose,) = _checked(folder, HEAVY)
    return pose, hand


def has_heavy(folder: Path | None = None) -> bool:
    """Whether the heavy network is stored."""
    folder = default_folder() if folder is None else folder
    return all((folder / Path(name).name).exists() for name in HEAVY.networks)


def fetch_networks(file: Path | None = None, folder: Path | None = None, package: Package = USUAL) -> Path:
    """Stores the networks of a package's file, by default one that is downloaded with its progress; their folder.

    What is stored already and sound is not downloaded again.

    Raises InputError for a file that cannot be had or is another one.
    """
    folder = default_folder() if folder is None else folder
    if file is not None:
        _store(file, folder, package)
        return folder
    with contextlib.suppress(InputError):
        _checked(folder, package)
        return folder
    with tempfile.TemporaryDirectory() as temporary:
        try:
            failed = subprocess.run([*package.command, temporary, package.name], check=False).returncode != 0
        except FileNotFoundError:
            failed = True
        if failed:
            raise InputError(
                f"{package.command[0]} could not download {package.name}. Copy its file from another machine and call "
                f"`paramove webcam setup {package.option}`",
                missing=True,
            )
        _store(next(Path(temporary).iterdir()), folder, package)
    return folder


def _checked(folder: Path, package: Package) -> list[Path]:
    paths = [folder / Path(name).name for name in package.networks]
    for path, sha256 in zip(paths, package.networks.values(), strict=True):
        try:
            content = path.read_bytes()
        except OSError as error:
            raise InputError(
                f"{path}: the pose network is not there ({error.strerror}); {package.remedy}", missing=True
            ) from error
        if hashlib.sha256(content).hexdigest() != sha256:
            raise InputError(
                f"{path}: damaged, {len(content)} bytes that are not those of the pose network; {package.remedy}"
            )
    return paths


def _store(file: Path, folder: Path, package: Package) -> None:
    try:
        content = file.read_bytes()
        if hashlib.sha256(content).hexdigest() != package.sha256:
            raise InputError(f"{file}: {len(content)} bytes of another file; that of {package.name} expected")
        folder.mkdir(parents=True, exist_ok=True)
        for name in package.networks:
            with replacing(folder / Path(name).name) as unfinished:
                unfinished.write_bytes(_member(file, name))
    except OSError as error:
        raise InputError(f"{error.filename or file}: {error.strerror}", missing=not file.exists()) from error


def _member(file: Path, name: str) -> bytes:
    if zipfile.is_zipfile(file):
        with zipfile.ZipFile(file) as archive:
            return archive.read(name)
    with tarfile.open(file) as archive:
        member = archive.extractfile(name)
        assert member is not None, "the hash of the file is known, so the member is there"
        return member.read()
