"""Distances and paths of dtw-python 1.9.0, stored so that nobody needs that library, whose licence is the GPL.

`pip install dtw-python==1.9.0 && python -m tests.alignment.dtw_python` writes them again.
"""

import json
from importlib import import_module
from pathlib import Path

import numpy as np

from paramove.alignment.warping import STEPS, StepPattern

REFERENCES = Path(__file__).with_name("dtw_python.json")


def pair(seed: int, n_first: int, n_second: int, dim: int) -> tuple[np.ndarray, np.ndarray]:
    """Two random walks."""
    rng = np.random.default_rng(seed)
    walks = [np.cumsum(rng.standard_normal((length, dim)), axis=0) for length in (n_first, n_second)]
    return walks[0], walks[1]


def reference(seed: int, pattern: StepPattern) -> dict[str, object]:
    """What dtw-python finds for walks of 20 to 39 frames and 1 to 21 coordinates."""
    n_first, n_second, dim = (int(number) for number in np.random.default_rng(seed).integers([20, 20, 1], [40, 40, 22]))
    rows = []  # number of the step, how far back in both, weight (-1: where the step comes from)
    for number, (back_in_first, back_in_second) in enumerate(STEPS[pattern], start=1):
        rows += [[number, back_in_first, back_in_second, -1], [number, 0, 0, 1]]
    steps = import_module("dtw.stepPattern").StepPattern(np.array(rows, dtype=np.float64), "NA")
    p, q = pair(seed, n_first, n_second, dim)
    found = import_module("dtw").dtw(p, q, dist_method="euclidean", step_pattern=steps)
    path = {"first": found.index1.tolist(), "second": found.index2.tolist()}
    sizes = {"n_first": n_first, "n_second": n_second, "dim": dim}
    return {"seed": seed, "pattern": pattern, **sizes, "distance": float(found.distance), **path}


if __name__ == "__main__":
    lines = [json.dumps(reference(seed, pattern)) for pattern in STEPS for seed in range(20)]
    REFERENCES.write_text("[\n" + ",\n".join(lines) + "\n]\n")
