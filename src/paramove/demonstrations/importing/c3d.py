"""C3D files, the exchange format of motion capture; read by ezc3d in its own process.

A damaged file can hang or crash ezc3d, so the process has a time limit.
"""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from paramove.demonstrations import DemonstrationError
from paramove.demonstrations.importing import c3d_process
from paramove.demonstrations.importing.checking import RawTake
from paramove.documents import read_arrays, size_of, unreadable

TIME_LIMIT_S = 120.0
BLOCK_BYTES = 512
BIG_ENDIAN = 86
"""Processor type of C3D files of SGI and MIPS machines; 84 is Intel, 85 is DEC (C3D user guide, Parameter section)."""
AXES_WITH_UP = {
    "+X": "up,forward,left",
    "+Y": "left,up,forward",
    "+Z": "forward,left,up",
    "-X": "down,forward,right",
    "-Y": "right,down,forward",
    "-Z": "forward,right,down",
}
"""Axes by the one that points up. The others follow `PRESETS`: X_SCREEN is to the right on the screen, which may be any
direction of the person's."""


def read_c3d(path: Path, time_limit_s: float = TIME_LIMIT_S) -> list[RawTake]:
    """Points, names, unit, rate and, by Y_SCREEN, which axis is up. Analog channels are not read.

    Raises DemonstrationError if the file cannot be read, which names the reader's complaint.
    """
    size_of(path, "C3D file", DemonstrationError)
    if _processor(path) == BIG_ENDIAN:
        raise DemonstrationError(
            f"{path} has the big-endian byte order of SGI and MIPS machines, which its reader does not read; "
            "convert it to Intel (little-endian) byte order, or export it as Intel C3D or CSV"
        )
    if importlib.util.find_spec("ezc3d") is None:
        raise DemonstrationError(f"{path} is a C3D file; install its reader with: pip install 'paramove[c3d]'")
    with tempfile.TemporaryDirectory(prefix="paramove-c3d-") as folder:
        result = Path(folder) / "result.npz"
        command = [sys.executable, c3d_process.__file__, str(path), str(result)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=time_limit_s, check=False)
        except subprocess.TimeoutExpired as error:
            raise DemonstrationError(f"{path} is not read within {time_limit_s:g} s: a damaged C3D file") from error
        if done.returncode != 0 or not result.is_file():
            complaint = " ".join(done.stderr.split())[-300:] or f"the reader ended with {done.returncode}"
            raise DemonstrationError(f"{path} cannot be read as C3D: {complaint}; export it again")
        arrays = read_arrays(result, raising=DemonstrationError)
    positions = np.asarray(arrays["positions"], dtype=np.float64)
    names = [str(name).strip() for name in arrays["points"]]
    names += [""] * (positions.shape[1] - len(names))
    if positions.shape[1] != len(names) or not positions.size:
        raise DemonstrationError(f"{path} has {len(positions)} frames of {positions.shape[1]} points; expected points")
    rate_hz = float(arrays["rate_hz"])
    time = np.arange(len(positions)) / rate_hz if np.isfinite(rate_hz) and rate_hz > 0.0 else None
    up = str(arrays["up"]).strip().upper()
    axes = AXES_WITH_UP.get(up if up[:1] in "+-" else f"+{up}")
    return [
        RawTake(
            path.stem,
            time,
            positions,
            tuple(names),
            str(arrays["unit"]).strip() or None,
            axes,
            axes_are_known=axes is not None,
            time_unit_s=1.0,
        )
    ]


def _processor(path: Path) -> int:
    """Processor type of a C3D file, in the fourth byte of its parameter section; 0 where there is none."""
    try:
        with path.open("rb") as file:
            block = file.read(1)
            file.seek(BLOCK_BYTES * (max(1, block[0] if block else 1) - 1) + 3)
            found = file.read(1)
    except OSError as error:
        raise DemonstrationError(unreadable(path, error)) from error
    return found[0] if found else 0
