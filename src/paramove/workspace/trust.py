"""Whose code runs: files of a folder count only where nobody but the user and root can have written them.

A folder in which other people may write, such as one below a shared disk, could hold a `nodes/recorder.py` of theirs,
which would run with this user's rights. Permissions of the file system decide; access control lists are not read.
"""

from __future__ import annotations

import functools
import grp
import os
import pwd
import stat
from collections.abc import Iterable, Iterator
from pathlib import Path

TRUSTED_VARIABLE = "PARAMOVE_TRUSTED_FOLDERS"
"""Environment variable: folders, separated by colons, whose files count whoever may write there."""


def why_distrusted(folder: Path, parts: Iterable[str]) -> str:
    """Why files of a folder are not used; "" if they are.

    The folder, its Python files, and everything in its parts must belong to the user, or to root, and nobody else may
    write there. No folder above it may let everybody rename what others own (mode 0777 without the sticky bit).

    Args:
        folder: That is searched for files of applications. parts: Names of its folders that hold them.
    """
    folder = folder.resolve()
    listed = (Path(entry) for entry in os.environ.get(TRUSTED_VARIABLE, "").split(os.pathsep) if entry)
    if any(folder.is_relative_to(one.resolve()) for one in listed):
        return ""
    try:
        for path in _files_of(folder, parts):
            is_lost_link = path.is_symlink() and not path.exists()  # such as an editor's lock
            reason = "" if is_lost_link else _why_others_may_write(path)
            if reason:
                return f"{path} {reason}"
        for above in folder.parents:
            if above.stat().st_mode & (stat.S_IWOTH | stat.S_ISVTX) == stat.S_IWOTH:
                return f"everybody may rename folders in {above}"
    except OSError as error:
        return f"{error.filename}: {error.strerror}"
    return ""


def _files_of(folder: Path, parts: Iterable[str]) -> Iterator[Path]:
    yield folder
    yield from sorted(folder.glob("*.py"))
    for part in parts:
        if (folder / part).is_dir():
            yield folder / part
            yield from sorted((folder / part).rglob("*"))


def _why_others_may_write(path: Path) -> str:
    """Why somebody else can have written a file or folder, which the caller names; "" if nobody else can."""
    status = path.stat()
    own = {0, os.geteuid()}
    if os.geteuid() == 0 and os.environ.get("SUDO_UID", "").isdecimal():
        own.add(int(os.environ["SUDO_UID"]))
    if status.st_uid not in own:
        return f"belongs to {_name_of(status.st_uid)}"
    if status.st_mode & stat.S_IWOTH:
        return "can be written by everybody"
    if status.st_mode & stat.S_IWGRP:
        others = _members(status.st_gid) - {_name_of(user) for user in own}
        if others:
            return f"can be written by {', '.join(sorted(others)[:3])}"
    return ""


def _name_of(user: int) -> str:
    try:
        return pwd.getpwuid(user).pw_name
    except KeyError:
        return f"user {user}"


@functools.cache  # all files of a workspace have one, and the list of users may come over the network
def _members(group: int) -> set[str]:
    """Names of the users in a group; a group of one user alone is usual, and so is one that nobody has named."""
    try:
        named = set(grp.getgrgid(group).gr_mem)
    except KeyError:
        named = set()
    return named | {user.pw_name for user in pwd.getpwall() if user.pw_gid == group}
