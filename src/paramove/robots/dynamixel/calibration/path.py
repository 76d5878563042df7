"""Where the calibration of an arm is stored."""

from __future__ import annotations

import errno
import itertools
import os
import re
import shutil
from pathlib import Path

from platformdirs import user_data_path

DATA_VARIABLE = "PARAMOVE_DATA"


def calibration_path(serial: str, data: Path | None = None) -> Path:
    """Where the calibration of the arm behind this adapter is stored.

    Args:
        serial: USB serial number of the adapter, or what takes its place.
        data: Folder; default $PARAMOVE_DATA, else that of the system for the user's data.
    """
    folder = data or Path(os.environ.get(DATA_VARIABLE) or user_data_path("paramove"))
    return folder / "calibration" / f"arm_{re.sub(r'[^A-Za-z0-9.-]', '_', serial)}.yaml"


def keep_earlier(path: Path) -> Path | None:
    """Copy a calibration that is about to be replaced to a new file beside it; None where there is none.

    Raises OSError.
    """
    if not path.exists():
        return None
    numbers = itertools.count(1)
    kept = next(other for number in numbers if not (other := path.with_suffix(f".{number}.yaml")).exists())
    shutil.copy2(path, kept)
    return kept


def check_writable(path: Path) -> None:
    """Check that a calibration can be written there, before a person begins it. Raises OSError."""
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_suffix(".part")
    try:
        unfinished.write_bytes(b" ")
    finally:
        unfinished.unlink(missing_ok=True)
