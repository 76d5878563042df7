"""Reads one C3D file into an NPZ file; run as a program of its own (`c3d.py`), which a damaged file may hang or crash.

python c3d_process.py FILE.c3d RESULT.npz
"""

import resource
import sys

import numpy as np

MEMORY_BYTES = 8 * 2**30


def main(source: str, result: str) -> int:
    """Points, their names, unit, rate; 0, or 1 with the reader's complaint on standard error."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
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
            points=np.array(labels[: points.shape[1]], dtype=np.str_),
            unit=units[0] if units else "",
            rate_hz=float(read["header"]["points"]["frame_rate"]),
        )
    except (OSError, RuntimeError, ValueError, KeyError, IndexError, MemoryError) as error:
        sys.stderr.write(f"{error}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
