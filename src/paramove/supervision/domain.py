"""The folder in which the sockets of one run lie: one run per domain at a time."""

from __future__ import annotations

import contextlib
import fcntl
import os
import re
import shutil
import stat
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from paramove.bus import default_folder, lock_of

LONGEST_FOLDER = 70
"""Bytes of a folder's path; a socket's path may have 107 and the longest topic name needs the rest."""
HIDDEN = "truth-"
"""Beginning of the name of the folder in which the truth of a domain lies hidden."""


class DomainError(RuntimeError):
    """The domain cannot be used: its name, its folder, or another run in it."""


class DomainNameError(DomainError):
    """Invalid name of a domain."""


@dataclass(frozen=True)
class Domain:
    """Folders of sockets.

    Attributes:
        folder: Sockets of the bus.
        truth_folder: Sockets of the ground truth; has a random name below a folder that cannot be listed (mode 0300).
    """

    folder: Path
    truth_folder: Path


def _made(folder: Path) -> Path:
    """The folder above the domains, made with mode 0700; raises DomainError if it belongs to another user."""
    folder.mkdir(mode=0o700, exist_ok=True)
    folder_stat = folder.lstat()
    if folder_stat.st_uid != os.getuid() or not stat.S_ISDIR(folder_stat.st_mode):
        raise DomainError(
            f"{folder} is not a folder of yours; remove it or set XDG_RUNTIME_DIR to a folder of your own"
        )
    return folder


def check_name(name: str) -> None:
    """Raises DomainNameError if the name is invalid."""
    if not re.fullmatch(r"[a-z0-9_-]{1,40}", name) or name.startswith(HIDDEN):
        remedy = "unset PARAMOVE_DOMAIN or set it to a name such as 'second'"
        form = f"expected up to 40 lower-case letters, digits, '_' or '-', not beginning with {HIDDEN}"
        raise DomainNameError(f"domain {name!r}: {form}; {remedy}")


@contextlib.contextmanager
def held_domain(name: str, holder: str) -> Iterator[Domain]:
    """Makes the folders of a domain and holds them until the block ends.

    Args:
        name: Lower-case letters, digits, `_` and `-`.
        holder: Who holds it, for the error that another run in the same domain gets.

    Raises DomainError if another run holds it.
    """
    check_name(name)
    folder = default_folder(name)
    runtime = _made(folder.parent)
    if len(os.fsencode(folder)) > LONGEST_FOLDER:
        raise DomainError(f"{folder} is too long for sockets; set XDG_RUNTIME_DIR to a shorter path, such as /tmp/r")
    with lock_of(folder).open("a+", encoding="utf-8") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            lock.seek(0)
            other = lock.read().strip() or "another process"
            raise DomainError(
                f"domain '{name}' is held by {other}; end that run or choose another domain with PARAMOVE_DOMAIN=..."
            ) from error
        lock.truncate(0)
        lock.write(f"pid {os.getpid()} ({holder})")
        lock.flush()
        hidden = runtime / f"{HIDDEN}{name}"
        _remove(folder, hidden)  # of a run that was killed
        try:
            folder.mkdir(mode=0o700)
            hidden.mkdir(mode=0o300)
            yield Domain(folder, Path(tempfile.mkdtemp(prefix="", dir=hidden)))
        finally:
            _remove(folder, hidden)
            lock.truncate(0)


def _remove(folder: Path, hidden: Path) -> None:
    with contextlib.suppress(FileNotFoundError):
        hidden.chmod(0o700)  # otherwise its owner could not list it either
    for one in (folder, hidden):
        shutil.rmtree(one, ignore_errors=True)
