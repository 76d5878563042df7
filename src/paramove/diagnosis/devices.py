"""Whether this user may use a device, and which program has it open."""

from __future__ import annotations

import contextlib
import grp
import os
import pwd
import stat
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
    found = device.stat()
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
    found = []
    for process in psutil.process_iter():
        if process.pid == os.getpid():
            continue
        with contextlib.suppress(OSError, psutil.Error):  # it has just ended, or is not ours to look into
            if _holds(process.pid, real):
                found.append(Holder(process.pid, _program(process)))
    return found


def _program(process: psutil.Process) -> str:
    """Of a Python process the module that it runs: `python` names nobody."""
    words = process.cmdline()
    place = words.index("-m") + 1 if "-m" in words and process.name().startswith("python") else len(words)
    return str(words[place] if place < len(words) else process.name())


def _holds(pid: int, device: Path) -> bool:
    folder = Path(f"/proc/{pid}")
    links = {one.name: _target(one) for one in (folder / "fd").iterdir()}
    if str(device) not in links.values():
        return False
    masters = [number for number, target in links.items() if target.endswith("/ptmx")]
    return not any(_is_other_end(folder / "fdinfo" / number, device) for number in masters)


def _is_other_end(info: Path, device: Path) -> bool:
    """Whether a descriptor is the other end of a pseudo-terminal: who has it serves the terminal and holds it open."""
    lines = dict(line.split(":", 1) for line in info.read_text(encoding="utf-8").splitlines() if ":" in line)
    return device.parent.name == "pts" and lines.get("tty-index", "").strip() == device.name


def _target(descriptor: Path) -> str:
    try:
        return os.readlink(descriptor)
    except OSError:  # closed meanwhile
        return ""
