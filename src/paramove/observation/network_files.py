"""The files of the pose network: fetched once inside a published package, checked, stored in the user's cache."""

from __future__ import annotations

import hashlib
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

from platformdirs import user_cache_path

from paramove.documents import InputError, replacing
from paramove.observation.pose_network import PoseNetwork

PACKAGE = "mediapipe==0.10.21"
"""Apache-2.0. Later versions lack the files."""
SYSTEM = ("--platform", "manylinux_2_28_x86_64", "--python-version", "3.11", "--implementation", "cp", "--abi", "cp311")
"""Of the one wheel whose hash is known; nothing in it is run."""
WHEEL_SHA256 = "05dc4a9e593655a79558d05d6227d31018c2537a4bd3362b51e230cf22aecfe3"
NETWORKS = {
    "mediapipe/modules/pose_landmark/pose_landmark_full.tflite": (
        "e9a5c5cb17f736fafd4c2ec1da3b3d331d6edbe8a0d32395855aeb2cdfd64b9f"
    ),
    "mediapipe/modules/hand_landmark/hand_landmark_full.tflite": (
        "11c272b891e1a99ab034208e23937a8008388cf11ed2a9d776ed3d01d0ba00e3"
    ),
}
"""Name in the wheel -> SHA-256; of the body, of the hand."""
REMEDY = "`paramove webcam setup` fetches it once (35.6 MB)"


def default_folder() -> Path:
    """In the user's cache."""
    return user_cache_path("paramove") / "networks"


def stored_network(folder: Path | None = None) -> PoseNetwork:
    """The network of a folder, by default of the user's cache. Raises InputError if a file is missing or damaged."""
    folder = default_folder() if folder is None else folder
    pose, hand = (folder / Path(name).name for name in NETWORKS)
    for path, sha256 in zip((pose, hand), NETWORKS.values(), strict=True):
        try:
            content = path.read_bytes()
        except OSError as error:
            raise InputError(
                f"{path}: the pose network is not there ({error.strerror}); {REMEDY}", missing=True
            ) from error
        if hashlib.sha256(content).hexdigest() != sha256:
            raise InputError(f"{path}: damaged, {len(content)} bytes that are not those of the pose network; {REMEDY}")
    return PoseNetwork(pose, hand)


def fetch_networks(wheel: Path | None = None, folder: Path | None = None) -> Path:
    """Stores the networks of a wheel, by default one that pip downloads and shows the progress of; their folder.

    Raises InputError for a wheel that cannot be had or is another one.
    """
    folder = default_folder() if folder is None else folder
    if wheel is not None:
        _store(wheel, folder)
        return folder
    with tempfile.TemporaryDirectory() as temporary:
        command = [sys.executable, "-m", "pip", "--disable-pip-version-check", "download", "--no-deps"]
        command += ["--only-binary=:all:", *SYSTEM, "--dest", temporary, PACKAGE]
        if subprocess.run(command, check=False).returncode != 0:
            raise InputError(
                f"pip could not download {PACKAGE}; its message stands above. On a machine without network, copy the "
                "wheel for CPython 3.11 on x86_64 here and call `paramove webcam setup --wheel FILE`"
            )
        _store(next(Path(temporary).glob("*.whl")), folder)
    return folder


def _store(wheel: Path, folder: Path) -> None:
    try:
        content = wheel.read_bytes()
        if hashlib.sha256(content).hexdigest() != WHEEL_SHA256:
            raise InputError(
                f"{wheel}: {len(content)} bytes of another file; expected {PACKAGE} for CPython 3.11, x86_64"
            )
        folder.mkdir(parents=True, exist_ok=True)
        with zipfile.ZipFile(wheel) as archive:
            for name in NETWORKS:
                with replacing(folder / Path(name).name) as unfinished:
                    unfinished.write_bytes(archive.read(name))
    except OSError as error:
        raise InputError(f"{error.filename or wheel}: {error.strerror}", missing=not wheel.exists()) from error
