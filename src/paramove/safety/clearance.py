"""Rows that bring parts of the robot too close to each other or to what stands around it.

Below 20 mm parts may approach only so fast that 0.2 s would be left until 5 mm; below 5 mm only apart, and slowly. What
is faster is rejected, not slowed down: that is the planner's business. Every 20 ms and at the end a row is checked.
"""

from __future__ import annotations

import numpy as np

from paramove.documents import Floats
from paramove.safety.gate_io import Clearance, Fault
from paramove.safety.limits import INWARD_FRACTION, MotionLimits

CHECK_EVERY_S = 0.02
STOP_M = 0.005
SLOW_M = 0.020
TIME_LEFT_S = 0.2
# Distances between meshes are computed by iteration: an approach of 0.1 mm/s may be none.
STILL_M_S = 1e-4


def clearance_fault(
    clearance: Clearance, last: Floats, rows: Floats, limits: MotionLimits, n_proposed: int
) -> Fault | None:
    """The first of `rows` [N, J] after `last` [J], rad, that comes too close; from `n_proposed` on they stop."""
    stride = max(1, round(CHECK_EVERY_S / limits.dt_s))
    before, row_before = last, -1
    distance_before = clearance.distances(last)[0]
    for row in [*range(stride - 1, len(rows) - 1, stride), len(rows) - 1]:
        distance, one, other = clearance.distances(rows[row])
        gap_s = (row - row_before) * limits.dt_s
        approach = (distance_before - distance) / gap_s
        allowed = STILL_M_S + max(distance - STOP_M, 0.0) / TIME_LEFT_S
        slow = bool((np.abs(rows[row] - before) <= INWARD_FRACTION * limits.velocity * gap_s).all())
        if not (distance >= SLOW_M or (approach <= allowed and (slow or distance >= STOP_M))):
            where = "in the stop after these rows" if row >= n_proposed else f"at row {row}"
            message = (
                f"{one} and {other} come within {1e3 * distance:.1f} mm {where}, at {1e3 * approach:.0f} mm/s, allowed "
                f"{1e3 * allowed:.0f} mm/s there, and below {1e3 * STOP_M:.0f} mm only slowly apart"
            )
            return Fault("clearance", "", message)
        before, row_before, distance_before = rows[row], row, distance
    return None
