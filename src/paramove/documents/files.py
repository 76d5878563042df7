"""Files read within limits; one that cannot be read raises an `InputError` with its path, the finding and a remedy."""

from __future__ import annotations

import errno
import stat
from pathlib import Path

from paramove.documents.input_error import InputError

FULL_DISK = frozenset({errno.ENOSPC, errno.EDQUOT})
"""Numbers of errors of a disk that is full, and of a user's part of it."""
MEBIBYTE = 2**20
TEXT_BYTES = 512 * MEBIBYTE
"""Limit for a text with numbers, such as BVH: an hour of 60 joints at 120 Hz has 250 MB."""


def size_of(
    path: Path, kind: str, raising: type[InputError] = InputError, max_bytes: int = TEXT_BYTES, remedy: str = ""
) -> int:
    """Size of a regular file in bytes.

    Args:
        path: Of the file.
        kind: What the file should be, for people.
        raising: Class of what is raised.
        max_bytes: Larger files are rejected.
        remedy: What helps, for people.

    Raises `raising` for a missing file, a folder or device, and a file that is too large.
    """
    remedy = f"; {remedy}" if remedy else ""
    try:
        status = path.stat()
    except (FileNotFoundError, NotADirectoryError) as error:
        raise raising(f"there is no {kind} {path}{remedy}", missing=True) from error
    except (OSError, ValueError) as error:  # ValueError: a NUL byte in the path
        raise raising(f"{path}: cannot be read: {error}{remedy}") from error
    if not stat.S_ISREG(status.st_mode):
        raise raising(f"{path}: expected a {kind}, found a folder or device{remedy}")
    if status.st_size > max_bytes:
        raise raising(
            f"{path}: expected a {kind} of at most {max_bytes / MEBIBYTE:.3g} MB, "
            f"found {status.st_size / MEBIBYTE:.1f} MB{remedy}"
        )
    return status.st_size


def read_bytes(
    path: Path, kind: str, raising: type[InputError] = InputError, max_bytes: int = TEXT_BYTES, remedy: str = ""
) -> bytes:
    """All of a file. Arguments and errors as of `size_of`; a file that may not be read is an error too."""
    size_of(path, kind, raising, max_bytes, remedy)
    try:
        with path.open("rb") as file:
            return file.read(max_bytes)
    except OSError as error:
        raise raising(unreadable(path, error)) from error


def read_text(
    path: Path, kind: str, raising: type[InputError] = InputError, max_bytes: int = TEXT_BYTES, remedy: str = ""
) -> str:
    """All of a UTF-8 text, without a byte order mark. Arguments and errors as of `size_of`; other text is rejected."""
    try:
        return read_bytes(path, kind, raising, max_bytes, remedy).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise raising(f"{path}: expected a {kind}; it cannot be read as UTF-8 text: {error}") from error


def unreadable(path: Path, error: OSError) -> str:
    """Message: the system's reason and the remedy."""
    if isinstance(error, PermissionError):
        return f"{path}: no right to read it; run 'chmod u+r {path}'"
    return f"{path}: cannot be read: {error.strerror or error}"
