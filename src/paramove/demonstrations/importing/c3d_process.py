"""Reads one C3D file into an NPZ file; run as a separate program (`c3d.py`), as a damaged file may hang or crash it.

python c3d_process.py FILE.c3d RESULT.npz
"""

import os
import resource
import sys
from typing import Any

import numpy as np

MEMORY_BYTES = 768 * 2**20
MEMORY_PER_BYTE = 40
"""Of the file."""
CPU_S = 4
HEADER_FRAMES = 65535
BLOCK_BYTES = 512
CPU_BYTES_PER_S = 2**20


def text(read: str) -> str:
    """Text of a C3D file, which does not define its encoding: UTF-8, else Latin-1."""
    try:
        read.encode("utf-8")
    except UnicodeEncodeError:
        return read.encode("utf-8", "surrogateescape").decode("latin-1")
    return read


def first_value(parameters: dict[str, Any], name: str) -> str:
    """First text of a parameter; "" where there is none."""
    values = parameters.get(name, {}).get("value", [])
    return values[0] if len(values) and isinstance(values[0], str) else ""


def true_length(source: str, read: dict[str, Any], n_read: int) -> int:
    """Number of frames that were captured; raises ValueError if `ezc3d` 1.7.2 has not read them all.

    The header counts to 65535. Longer captures have their length in TRIAL:ACTUAL_START_FIELD and ACTUAL_END_FIELD (low
    and high word) or in POINT:LONG_FRAMES; ezc3d reads as many frames as POINT:FRAMES says.
    """
    captured = stated_length(read["parameters"])
    if captured is None:
        if n_read < HEADER_FRAMES:
            return n_read
        captured = max(n_read, frames_in(source))
    if captured > n_read:
        raise ValueError(
            f"{captured} frames were captured, but its header counts only {n_read}; cut it into shorter ones"
        )
    return captured


def stated_length(parameters: dict[str, Any]) -> int | None:
    """Number of frames by the parameters for long captures; None without them."""
    trial = parameters.get("TRIAL", {})
    fields = [np.ravel(trial.get(f"ACTUAL_{end}_FIELD", {}).get("value", [])) for end in ("START", "END")]
    if all(len(field) == 2 for field in fields):
        first, last = (int(low) % 65536 + 65536 * (int(high) % 65536) for low, high in fields)
        if last >= first:
            return last - first + 1
    long_frames = np.ravel(parameters["POINT"].get("LONG_FRAMES", {}).get("value", []))
    return int(long_frames[0]) if len(long_frames) and 0 < long_frames[0] < 2**31 else None


def frames_in(source: str) -> int:
    """Minimum number of frames in a file by its size, whose last block may be partly empty (C3D user guide, Header)."""
    with open(source, "rb") as file:
        words = np.frombuffer(file.read(BLOCK_BYTES), dtype="<u2")
    value_bytes = 4 if words[6:8].view("<f4")[0] < 0.0 else 2
    frame_bytes = value_bytes * (4 * int(words[1]) + int(words[2]))
    data_bytes = os.stat(source).st_size - BLOCK_BYTES * (int(words[8]) - 1)
    return (data_bytes - BLOCK_BYTES) // max(1, frame_bytes)


def main(source: str, result: str) -> int:
    """Points, their names, unit, rate; 0, or 1 with the reader's complaint on standard error."""
    size = os.stat(source).st_size
    memory, seconds = MEMORY_BYTES + MEMORY_PER_BYTE * size, CPU_S + size // CPU_BYTES_PER_S
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
    import ezc3d

    try:
        read = ezc3d.c3d(source)
        about = read["parameters"]["POINT"]
        points = read["data"]["points"]
        lost = read["data"]["meta_points"]["residuals"][0] < 0.0
        points[:3, lost] = np.nan
        points = points[:, :, : true_length(source, read, points.shape[2])]
        labels = [name for key in sorted(about) if key.startswith("LABELS") for name in about[key]["value"]]
        units = about.get("UNITS", {}).get("value", [])
        np.savez(
            result,
            positions=np.moveaxis(points[:3], -1, 0).swapaxes(1, 2),
            points=np.array([text(label) for label in labels[: points.shape[1]]], dtype=np.str_),
            unit=text(units[0]) if units else "",
            up=text(first_value(about, "Y_SCREEN")),
            rate_hz=float(read["header"]["points"]["frame_rate"]),
        )
    except (OSError, RuntimeError, ValueError, LookupError, TypeError, AttributeError, MemoryError) as error:
        sys.stderr.write(f"{error}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
