"""Files read within limits; what cannot be read is one `InputError` with its path, what was found and what helps."""

from __future__ import annotations

import stat
from pathlib import Path

from paramove.documents.input_error import InputError

MEBIBYTE = 2**20
TEXT_BYTES = 512 * MEBIBYTE
"""Of a text with numbers, such as BVH: an hour of 60 joints at 120 Hz has 250 MB."""


def size_of(
    path: Path, kind: str, raising: type[InputError] = InputError, max_bytes: int = TEXT_BYTES, remedy: str = ""
) -> int:
    """Size of a regular file in bytes.

    Args:
        path: Of the file.
        kind: What the file should be, for people.
        raising: Class of what is raised.
        max_bytes: Larger files are refused.
        remedy: What helps, for people.

    Raises `raising` for a missing file, a folder or device, and a file that is too large.
    """
    remedy = f"; {remedy}" if remedy else ""
    try:
        found = path.stat()
    except (FileNotFoundError, NotADirectoryError) as error:
        raise raising(f"there is no {kind} {path}{remedy}", missing=True) from error
    except (OSError, ValueError) as error:  # a ValueError tells of a NUL byte in the path
        raise raising(f"{path}: cannot be read: {error}{remedy}") from error
    if not stat.S_ISREG(found.st_mode):
        raise raising(f"{path}: expected a {kind}, found a folder or device{remedy}")
    if found.st_size > max_bytes:
        raise raising(
            f"{path}: expected a {kind} of at most {max_bytes / MEBIBYTE:.3g} MB, "
            f"found {found.st_size / MEBIBYTE:.1f} MB{remedy}"
        )
    return found.st_size


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
    """All of a UTF-8 text, without a byte order mark. Arguments and errors as of `size_of`; other text is refused."""
    try:
        return read_bytes(path, kind, raising, max_bytes, remedy).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise raising(f"{path}: expected a {kind}; it cannot be read as UTF-8 text: {error}") from error


def unreadable(path: Path, error: OSError) -> str:
    """The system's reason, and what helps."""
    if isinstance(error, PermissionError):
        return f"{path}: no right to read it; run 'chmod u+r {path}'"
    return f"{path}: cannot be read: {error.strerror or error}"
