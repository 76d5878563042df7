"""Files that a run needs from a person, such as a calibration, and the commands that make them."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from paramove.supervision.launch_file import Launch
from paramove.workspace import Workspace

_REFERENCE = re.compile(r"\{(\w+)\.(\w+)\}")
PROGRAM = "paramove"


@dataclass(frozen=True)
class MissingFile:
    """A file that is not there yet.

    Attributes:
        path: Where it belongs. about: What is in it.
        command: Words after `paramove` that make it.
    """

    path: Path
    about: str
    command: tuple[str, ...]

    @property
    def typed(self) -> str:
        """The command as one types it."""
        return shlex.join((PROGRAM, *self.command))


def missing_files(launch: Launch, workspace: Workspace) -> Iterator[MissingFile]:
    """Each file of the key `needs` that is not there, in the order of the launch file.

    Looks only when the next one is requested: a command may make several. Raises DocumentError for a reference
    `{node.parameter}` to nothing, and for a command of another program.
    """
    texts = {
        name: [_filled(launch, name, key) for key in ("file", "made_by")] for name in launch.file.needs
    }  # all, before the first command runs
    for name, (file, command) in texts.items():
        program, *words = shlex.split(command) or [""]
        if program != PROGRAM:
            raise launch.error(("needs", name, "made_by"), f"expected a command '{PROGRAM} …', found {command!r:.80}")
        path = workspace.find(file)
        if not path.exists():
            yield MissingFile(path, launch.file.needs[name].about, tuple(words))


def _filled(launch: Launch, name: str, key: str) -> str:
    """A text with the values of the parameters that it refers to."""

    def value(match: re.Match[str]) -> str:
        node, parameter = match.groups()
        settings = launch.file.nodes.get(node)
        if settings is None or parameter not in settings.parameters:
            message = f"there is no parameter '{node}.{parameter}' in the launch file and its overlays"
            raise launch.error(("needs", name, key), message)
        return str(settings.parameters[parameter])

    return _REFERENCE.sub(value, getattr(launch.file.needs[name], key))
