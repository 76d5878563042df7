"""The workspace: launch files, nodes, simulation and robot descriptions.

It is layered. Files of the current folder come first; each one that is missing there is taken from the installed
workspace: that of the clone, or the one that the wheel installs next to this file. A folder in which other people may
write is left out, see `trust`.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from paramove.workspace.trust import TRUSTED_VARIABLE, why_distrusted

PARTS = ("launch", "nodes", "robot_description", "sim")
"""Folders of a workspace."""
OWN_PARTS = (*PARTS, "msgs")
"""Those of a user's: messages and topics of the installed one are code of the library."""
_IN_WHEEL = Path(__file__).resolve().parent


@dataclass(frozen=True)
class Workspace:
    """Folders that are searched for the files of applications.

    Attributes:
        root: The working directory of the nodes; runs are recorded below it.
        layers: The folders that are searched, the first one first: the root, unless it is left out, and what is
            installed.
        left_out: Why a folder with files of applications is not searched, a sentence each.
    """

    root: Path
    layers: tuple[Path, ...]
    left_out: tuple[str, ...] = ()

    @classmethod
    def at(cls, folder: Path) -> Workspace:
        """The workspace of the working directory `folder`.

        Its root is the nearest folder at or above that holds `launch/` and `nodes/`, or else `folder` itself. One in
        which other people may write is passed over.
        """
        installed = _installed()
        whole = (one for one in (folder, *folder.parents) if _is_whole(one))
        left_out: list[str] = []
        for root in dict.fromkeys((*whole, folder)):
            reason = "" if root in installed else why_distrusted(root, OWN_PARTS)
            if not reason:
                return cls(root, tuple(dict.fromkeys((root, *installed))), tuple(left_out))
            if any((root / part).is_dir() for part in PARTS):
                remedy = f"correct that, or set {TRUSTED_VARIABLE}={root}"
                left_out.append(f"files of {root} are not used: {reason}; {remedy}")
        return cls(folder, installed, tuple(left_out))

    @classmethod
    def here(cls) -> Workspace:
        """The workspace for the working directory."""
        return cls.at(Path.cwd())

    @property
    def clone(self) -> Path | None:
        """The clone that the library is installed from in place; None for a wheel."""
        return self.layers[-1] if self.layers[-1] != _IN_WHEEL else None

    def find(self, path: str | Path) -> Path:
        """The file or folder at a relative path in the first layer that has it; in the first layer if none has it."""
        candidates = [folder / path for folder in self.layers]
        return next((candidate for candidate in candidates if candidate.exists()), candidates[0])

    def names(self, folder: str | Path, pattern: str = "*.yaml") -> list[str]:
        """Names, without suffix, of the files in a folder of any layer."""
        return sorted({file.stem for layer in self.layers for file in (layer / folder).glob(pattern)})

    def robots(self) -> list[str]:
        """Names of the robots that are described."""
        files = (file for layer in self.layers for file in layer.glob("robot_description/*/robot.yaml"))
        return sorted({file.parent.name for file in files})

    def files(self) -> dict[str, Path]:
        """Every file of the workspace by its relative path, each in the first layer that has it."""
        files: dict[str, Path] = {}
        for layer in reversed(self.layers):
            files |= _files_of(layer, PARTS if layer == self.layers[-1] else OWN_PARTS)
        return dict(sorted(files.items()))

    def replaced(self) -> list[str]:
        """Files of nodes, launch files and simulation, and folders of robots, that replace installed ones."""
        names = set()
        for layer in self.layers[:-1]:
            for name in _files_of(layer, PARTS):
                if (self.layers[-1] / name).is_file():
                    parts = Path(name).parts
                    names.add("/".join(parts[:2]) if parts[0] == "robot_description" else name)
        return sorted(names)

    @cached_property
    def digest(self) -> str:
        """Twelve hexadecimal digits of the names and contents of all files: with the seed they determine a run."""
        digest = hashlib.sha256()
        for name, file in self.files().items():
            content = file.read_bytes()
            digest.update(b"%s\0%d\0%s" % (os.fsencode(name), len(content), content))
        return digest.hexdigest()[:12]

    def __str__(self) -> str:
        return ", then ".join(map(str, self.layers))


def _is_whole(folder: Path) -> bool:
    return (folder / "launch").is_dir() and (folder / "nodes").is_dir()


def _files_of(layer: Path, parts: Iterable[str]) -> dict[str, Path]:
    """Every file of one layer by its relative path."""
    files = (file for part in parts for file in sorted((layer / part).rglob("*")))
    return {file.relative_to(layer).as_posix(): file for file in files if file.is_file() and file.suffix != ".pyc"}


def _installed() -> tuple[Path, ...]:
    """The workspace in the wheel, or the clone that the library is in."""
    return tuple(folder for folder in (_IN_WHEEL, _IN_WHEEL.parents[2]) if _is_whole(folder))[:1]
