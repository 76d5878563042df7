"""Files that appear whole or not at all, and are still there after a power failure."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path


@contextlib.contextmanager
def replacing(path: Path, mode: int = 0o666) -> Iterator[Path]:
    """Yields a temporary file to write to, which replaces `path` at the end of the block.

    Until then nothing at `path` changes, and an error within the block leaves it as it was. The temporary
    file has the same ending, as some libraries derive the format from it, and exists already with its permissions.

    Args:
        path: Of the finished file.
        mode: Permissions, less the umask.

    Raises OSError if it cannot be written.
    """
    unfinished = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    unfinished.unlink(missing_ok=True)
    os.close(os.open(unfinished, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, mode))
    try:
        yield unfinished
        rename_durably(unfinished, path)
    finally:
        unfinished.unlink(missing_ok=True)


def rename_durably(unfinished: Path, path: Path) -> None:
    """Renames a complete file: first its content reaches the disk, then the name does."""
    _sync(unfinished)
    unfinished.replace(path)
    with contextlib.suppress(OSError):  # not every file system supports this; the file has its name
        _sync(path.parent)


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
