"""Speed of dynamic time warping compared with the C of dtaidistance: demonstrations of 200 frames, 21 coordinates.

    python benchmarks/dtw.py [--json FILE] [--repetitions N]

Both measure the sum of Euclidean distances (step pattern (A)) and agree to 1e-9. Ours also returns the path and rejects
values that are not finite. One thread. Other benchmarks of models take the rows from `measure`.
"""

import argparse
import json
import os
import platform
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from dtaidistance import dtw_ndim  # type: ignore[import-untyped]
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from paramove.alignment import warp
from paramove.demonstrations import demonstrations_at, reaching_cuboid
from paramove.hmm import resample

FRAMES = 200


def measure(repetitions: int = 200) -> dict[str, float]:
    """Median times in s of alternating calls, and how many times as fast ours is. Raises ValueError on disagreement."""
    target = reaching_cuboid().theta(np.array([0.5, 0.5, 0.0]))
    demonstrations = demonstrations_at(target, np.random.default_rng(0), repetitions=2).sequences
    p, q = (resample(one, FRAMES) for one in demonstrations)
    tasks: dict[str, Callable[[], object]] = {
        "dtw_a_with_path_paramove_s": lambda: warp(p, q, "A"),
        "dtw_b_with_path_paramove_s": lambda: warp(p, q, "B"),
        "dtw_a_distance_dtaidistance_s": lambda: dtw_ndim.distance(p, q, use_c=True, inner_dist="euclidean"),
        "dtw_a_squared_dtaidistance_s": lambda: dtw_ndim.distance(p, q, use_c=True),
        "dtw_a_squared_with_path_dtaidistance_s": lambda: dtw_ndim.warping_path(p, q, use_c=True),
    }
    ours, theirs = warp(p, q, "A").distance, dtw_ndim.distance(p, q, use_c=True, inner_dist="euclidean")
    if not abs(ours - theirs) <= 1e-9 * ours:
        raise ValueError(f"the distances differ: paramove {ours!r}, dtaidistance {theirs!r}")
    times: dict[str, list[float]] = {name: [] for name in tasks}
    with threadpool_limits(1):
        for number in range(repetitions + 5):
            for name, task in tasks.items():
                start = time.perf_counter()
                task()
                if number >= 5:
                    times[name].append(time.perf_counter() - start)
    result = {name: float(np.median(values)) for name, values in times.items()}
    result["dtw_times_as_fast"] = result["dtw_a_distance_dtaidistance_s"] / result["dtw_a_with_path_paramove_s"]
    return result


def main() -> None:
    """Measure, print, and write JSON if requested."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="write the times to this file")
    parser.add_argument("--repetitions", type=int, default=200)
    arguments = parser.parse_args()
    times = measure(arguments.repetitions)
    for name, value in times.items():
        text = f"{1e3 * value:10.3f} ms" if name.endswith("_s") else f"{value:10.1f} times"
        sys.stdout.write(f"{name:40s} {text}\n")
    if arguments.json is not None:
        machine = {"machine": platform.machine(), "python": platform.python_version(), "cores": os.cpu_count()}
        arguments.json.write_text(json.dumps({"benchmark": "dtw", **machine, "times": times}, indent=2) + "\n")


if __name__ == "__main__":
    main()
