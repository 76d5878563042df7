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
from paramove.demonstrations.importing.conversion import RawTake
from paramove.documents import read_arrays, size_of

TIME_LIMIT_S = 120.0


def read_c3d(path: Path, time_limit_s: float = TIME_LIMIT_S) -> list[RawTake]:
    """Points, names, unit and rate. Analog channels are not read; C3D does not define the directions of its axes.

    Raises DemonstrationError if the file cannot be read, which names the reader's complaint.
    """
    size_of(path, "C3D file", DemonstrationError)
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
    names = tuple(str(name).strip() for name in arrays["points"])
    rate_hz = float(arrays["rate_hz"])
    if positions.shape[1] != len(names) or len(set(names)) < len(names) or not positions.size:
        raise DemonstrationError(
            f"{path} has {len(positions)} frames of {positions.shape[1]} points with {len(set(names))} names; "
            "expected points that have a name each"
        )
    time = np.arange(len(positions)) / rate_hz if np.isfinite(rate_hz) and rate_hz > 0.0 else None
    return [RawTake(path.stem, time, positions, names, str(arrays["unit"]).strip() or None)]
