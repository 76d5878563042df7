"""Many values in three numbers."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np


def summary_statistics(values: Iterable[float]) -> dict[str, float | int | None]:
    """Median, largest and number of values; None where there are none."""
    array = np.asarray(list(values), dtype=np.float64)
    if not array.size:
        return {"median": None, "max": None, "samples": 0}
    return {"median": float(np.median(array)), "max": float(array.max()), "samples": int(array.size)}
