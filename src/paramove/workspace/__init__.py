"""The workspace: launch files, nodes, simulation and robot descriptions.

It is layered. Files of the current folder come first; each one that is missing there is taken from the installed
workspace: that of the clone, or the one that the wheel installs next to this file.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

PARTS = ("launch", "nodes", "robot_description", "sim")
"""Folders of a workspace."""
_IN_WHEEL = Path(__file__).resolve().parent


@dataclass(frozen=True)
class Workspace:
    """Folders that are searched for the files of applications.

    Attributes:
        folders: The first one first. It is the working directory of the nodes, and runs are recorded below it.
    """

    folders: tuple[Path, ...]

    @classmethod
    def at(cls, folder: Path) -> Workspace:
        """The workspace of the working directory `folder`.

        Its first layer is the nearest folder at or above that holds `launch/` and `nodes/`, or else `folder` itself.
        """
        above = (one for one in (folder, *folder.parents) if _is_whole(one))
        return cls(tuple(dict.fromkeys((next(above, folder), *_installed()))))

    @classmethod
    def here(cls) -> Workspace:
        """The workspace for the working directory."""
        return cls.at(Path.cwd())

    @property
    def root(self) -> Path:
        """The first layer."""
        return self.folders[0]

    @property
    def clone(self) -> Path | None:
        """The clone that the library is installed from in place; None for a wheel."""
        return self.folders[-1] if self.folders[-1] != _IN_WHEEL else None

    def find(self, path: str | Path) -> Path:
        """The file or folder at a relative path in the first layer that has it; in the root where none has it."""
        candidates = [folder / path for folder in self.folders]
        return next((candidate for candidate in candidates if candidate.exists()), candidates[0])

    def names(self, folder: str | Path, pattern: str = "*.yaml") -> list[str]:
        """Names, without suffix, of the files in a folder of any layer."""
        return sorted({file.stem for layer in self.folders for file in (layer / folder).glob(pattern)})

    def robots(self) -> list[str]:
        """Names of the robots that are described."""
        files = (file for layer in self.folders for file in layer.glob("robot_description/*/robot.yaml"))
        return sorted({file.parent.name for file in files})

    def files(self) -> dict[str, Path]:
        """Every file of the workspace by its relative path, each in the first layer that has it."""
        files: dict[str, Path] = {}
        for layer in reversed(self.folders):
            for part in PARTS:
                for file in sorted((layer / part).rglob("*")):
                    if file.is_file() and file.suffix != ".pyc":
                        files[file.relative_to(layer).as_posix()] = file
        return dict(sorted(files.items()))

    @cached_property
    def digest(self) -> str:
        """Twelve hexadecimal digits of the names and contents of all files: with the seed they determine a run."""
        digest = hashlib.sha256()
        for name, file in self.files().items():
            content = file.read_bytes()
            digest.update(b"%s\0%d\0%s" % (name.encode(), len(content), content))
        return digest.hexdigest()[:12]

    def __str__(self) -> str:
        return ", then ".join(map(str, self.folders))


def _is_whole(folder: Path) -> bool:
    return (folder / "launch").is_dir() and (folder / "nodes").is_dir()


def _installed() -> list[Path]:
    """The workspace in the wheel, or the clone that the library is in."""
    return [folder for folder in (_IN_WHEEL, _IN_WHEEL.parents[2]) if _is_whole(folder)][:1]
