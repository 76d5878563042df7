"""Whether this user may use a device, and which program has it open."""

from __future__ import annotations

import contextlib
import grp
import os
import pwd
import stat
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import psutil

GROUP_MAY = stat.S_IRGRP | stat.S_IWGRP


@dataclass(frozen=True)
class Holder:
    """A process that has a device open."""

    pid: int
    program: str

    def __str__(self) -> str:
        return f"pid {self.pid} ({self.program})"


def may_use(device: Path) -> bool:
    """Whether this user may read and write it."""
    return os.access(device, os.R_OK | os.W_OK)


def access_remedy(device: Path, group: str, kernel_name: str) -> tuple[str, ...]:
    """What gives this user the right to read and write a device.

    Args:
        device: Not a link.
        group: That such devices usually belong to, for one that belongs to no group of its own.
        kernel_name: Pattern of such devices' names, for a rule of udev.
    """
    try:
        found = device.stat()
    except FileNotFoundError:
        return ("plug it in again: it went away just now",)
    name = _group_name(found.st_gid)
    if stat.S_IMODE(found.st_mode) & GROUP_MAY != GROUP_MAY or not name or found.st_gid == 0:
        rule = f'KERNEL=="{kernel_name}", MODE="0660", GROUP="{group}"'
        return (
            f"echo '{rule}' | sudo tee /etc/udev/rules.d/99-paramove-{group}.rules",
            "sudo udevadm control --reload-rules && sudo udevadm trigger",
            *_join(group),
        )
    return _join(name)


def serial_remedy(device: Path) -> tuple[str, ...]:
    """As `access_remedy`, for a serial port, not a link."""
    return access_remedy(device, "dialout", device.name.rstrip("0123456789") + "*")


def _join(group: str) -> tuple[str, ...]:
    """Nothing but a new session where this user is of the group already."""
    with contextlib.suppress(KeyError):
        if pwd.getpwuid(os.getuid()).pw_name in grp.getgrnam(group).gr_mem:
            return (f"log out and in again: this session is older than your being in the group {group}",)
    return (f"sudo usermod -aG {group} $USER", "log out and in again")


def _group_name(number: int) -> str:
    try:
        return grp.getgrgid(number).gr_name
    except KeyError:
        return ""


def holders(device: Path) -> list[Holder]:
    """Other processes that have a device open; those of other users are seen by root only."""
    real = device.resolve()
    return [one for one in _with_open(str(real)) if one.pid != os.getpid() and not _serves(one.pid, real)]


def serving(terminal: Path) -> list[Holder]:
    """Processes that hold the other end of a pseudo-terminal; those of other users are seen by root only."""
    return [one for one in _with_open("/dev/ptmx", "/dev/pts/ptmx") if _serves(one.pid, terminal)]


def opened_files(pid: int) -> dict[str, str]:
    """What each open descriptor of a process leads to, by its number; {} where we may not look."""
    with contextlib.suppress(OSError):
        return {one.name: _target(one) for one in Path(f"/proc/{pid}/fd").iterdir()}
    return {}


def _with_open(*names: str) -> Iterator[Holder]:
    for process in psutil.process_iter():
        if not {*names}.isdisjoint(opened_files(process.pid).values()):
            with contextlib.suppress(psutil.Error):  # it has just ended
                yield Holder(process.pid, _program(process))


def _program(process: psutil.Process) -> str:
    """Of a Python process the module that it runs: `python` names nobody."""
    words = process.cmdline()
    place = words.index("-m") + 1 if "-m" in words and process.name().startswith("python") else len(words)
    return str(words[place] if place < len(words) else process.name())


def _serves(pid: int, terminal: Path) -> bool:
    """Whether a process holds the other end of a pseudo-terminal; then it also holds the terminal itself open."""
    masters = [number for number, target in opened_files(pid).items() if target.endswith("/ptmx")]
    return terminal.parent.name == "pts" and any(_index(pid, number) == terminal.name for number in masters)


def _index(pid: int, descriptor: str) -> str:
    """Number of the pseudo-terminal whose other end it is; "" if it was closed meanwhile."""
    with contextlib.suppress(OSError):
        for line in Path(f"/proc/{pid}/fdinfo/{descriptor}").read_text(encoding="utf-8").splitlines():
            if line.startswith("tty-index:"):
                return line.partition(":")[2].strip()
    return ""


def _target(descriptor: Path) -> str:
    try:
        return os.readlink(descriptor)
    except OSError:  # closed meanwhile
        return ""
