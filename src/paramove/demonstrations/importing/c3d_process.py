"""Reads one C3D file into an NPZ file; run as a separate program (`c3d.py`), as a damaged file may hang or crash it.

python c3d_process.py FILE.c3d RESULT.npz
"""

import os
import resource
import sys

import numpy as np

MEMORY_BYTES = 768 * 2**20
MEMORY_PER_BYTE = 40
"""Of the file."""
CPU_S = 4
CPU_BYTES_PER_S = 2**20


def text(read: str) -> str:
    """Text of a C3D file, which does not define its encoding: UTF-8, else Latin-1."""
    try:
        read.encode("utf-8")
    except UnicodeEncodeError:
        return read.encode("utf-8", "surrogateescape").decode("latin-1")
    return read


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
        labels = [name for key in sorted(about) if key.startswith("LABELS") for name in about[key]["value"]]
        units = about.get("UNITS", {}).get("value", [])
        np.savez(
            result,
            positions=np.moveaxis(points[:3], -1, 0).swapaxes(1, 2),
            points=np.array([text(label) for label in labels[: points.shape[1]]], dtype=np.str_),
            unit=text(units[0]) if units else "",
            rate_hz=float(read["header"]["points"]["frame_rate"]),
        )
    except (OSError, RuntimeError, ValueError, LookupError, TypeError, AttributeError, MemoryError) as error:
        sys.stderr.write(f"{error}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
