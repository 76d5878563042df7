"""The result of one check of a machine, with its cause and remedy."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

from paramove.documents import renamed_attribute


class Level(StrEnum):
    """Severity. Only with a problem something cannot work."""

    OK = "ok"
    WARNING = "warning"
    PROBLEM = "problem"


class Part(StrEnum):
    """Of a machine, in the order of the checks."""

    INSTALLATION = "installation"
    GRAPHICS = "graphics"
    RESOURCES = "resources"
    CAMERAS = "cameras"
    SERIAL = "serial"
    SERVOS = "servos"


@dataclass(frozen=True)
class Fix:
    """A remedy that needs no root.

    Attributes:
        words: What would be done, for a person who has to confirm it.
        do: Does it; raises OSError or subprocess.CalledProcessError if it cannot be done.
    """

    words: str
    do: Callable[[], None]


@dataclass(frozen=True)
class Finding:
    """The result of checking one thing.

    Attributes:
        subject: The thing, in a word or two.
        detail: The result, with its cause.
        remedy: Lines that fix it: commands for a shell, or what a person has to do.
        fix: The same by a call, where the user may do it.
        facts: Numbers and names of the message, for programs; unit in the name.
    """

    subject: str
    level: Level
    detail: str
    remedy: tuple[str, ...] = ()
    fix: Fix | None = None
    facts: Mapping[str, object] = field(default_factory=dict)
    sentence = renamed_attribute("sentence", "detail")


@dataclass(frozen=True)
class Machine:
    """What is checked; the defaults are this machine.

    Attributes:
        folder: The clone, or any folder in one.
        devices, sysfs: Of the system.
        by_id: Links to the serial ports that are checked. None: those that the system makes, by the names of
            adapters, and ports of USB that have no such link.
        baud_rates: At which a scan looks for servos, bit/s; empty: the usual ones.
    """

    folder: Path = field(default_factory=Path.cwd)
    devices: Path = Path("/dev")
    sysfs: Path = Path("/sys")
    by_id: Path | None = None
    baud_rates: tuple[int, ...] = ()


def as_root(command: str) -> str:
    """The command for a shell of this user, who may be root."""
    return command if os.geteuid() == 0 else f"sudo {command}"
