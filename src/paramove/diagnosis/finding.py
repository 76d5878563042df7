"""One thing that was looked at: whether it is well, what was found, and what mends it."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path


class Level(StrEnum):
    """How a thing is. Only with a problem something cannot work."""

    OK = "ok"
    WARNING = "warning"
    PROBLEM = "problem"


class Part(StrEnum):
    """Of a machine, in the order in which they are looked at."""

    INSTALLATION = "installation"
    GRAPHICS = "graphics"
    RESOURCES = "resources"
    CAMERAS = "cameras"
    SERIAL = "serial"
    SERVOS = "servos"


@dataclass(frozen=True)
class Fix:
    """What mends a thing without being root.

    Attributes:
        words: What would be done, for a person who is asked whether it shall be.
        do: Does it; raises OSError or subprocess.CalledProcessError if it cannot be done.
    """

    words: str
    do: Callable[[], None]


@dataclass(frozen=True)
class Finding:
    """What was found of one thing.

    Attributes:
        subject: The thing, in a word or two.
        sentence: What was found, with its cause.
        remedy: Lines that mend it: commands for a shell, or what a person has to do.
        fix: The same by a call, where the user may do it.
        facts: Numbers and names of the sentence, for programs; unit in the name.
    """

    subject: str
    level: Level
    sentence: str
    remedy: tuple[str, ...] = ()
    fix: Fix | None = None
    facts: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True)
class Machine:
    """Where is looked; the defaults are this machine.

    Attributes:
        folder: The clone, or any folder in one.
        devices, sysfs: Of the system.
        by_id: Links to the serial ports that are looked at. None: those that the system makes, by the names of
            adapters, and ports of USB that have no such link.
        baud_rates: At which servos are asked, bit/s; empty: the usual ones.
    """

    folder: Path = field(default_factory=Path.cwd)
    devices: Path = Path("/dev")
    sysfs: Path = Path("/sys")
    by_id: Path | None = None
    baud_rates: tuple[int, ...] = ()


def as_root(command: str) -> str:
    """The command for a shell of this user, who may be root."""
    return command if os.geteuid() == 0 else f"sudo {command}"
