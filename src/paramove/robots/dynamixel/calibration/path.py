"""Where the calibration of an arm is stored."""

from __future__ import annotations

import errno
import os
import re
from pathlib import Path

from platformdirs import user_data_path

DATA_VARIABLE = "PARAMOVE_DATA"


def calibration_path(serial: str, data: Path | None = None) -> Path:
    """Where the calibration of the arm behind this adapter is stored.

    Args:
        serial: USB serial number of the adapter.
        data: Folder; default $PARAMOVE_DATA, else that of the system for the user's data.
    """
    folder = data or Path(os.environ.get(DATA_VARIABLE) or user_data_path("paramove"))
    return folder / "calibration" / f"arm_{re.sub(r'[^A-Za-z0-9.-]', '_', serial)}.yaml"


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
