"""The rows that the gate has let pass and the robot has yet to play, with a little of what it played."""

from __future__ import annotations

import numpy as np

from paramove.documents import Floats
from paramove.safety.gate_io import Measured, Targets
from paramove.safety.limits import MotionLimits
from paramove.safety.stopping import stop_ramp, straight_move


class AcceptedRows:
    """They end at rest, always. There are none at first and after `clear`: then the robot holds its commanded pose.

    Attributes:
        end_index: After the last row ever given; the robot cannot have played more.
    """

    def __init__(self, limits: MotionLimits) -> None:
        self.end_index = 0
        self._limits = limits
        self._sent: Targets | None = None

    def clear(self) -> None:
        """Forget them, once the robot has played them or never will."""
        self._sent = None

    def held(self, next_index: int) -> Floats | None:
        """The last row [J] if the robot has played them all."""
        return None if self._sent is None or self.unplayed(next_index) else np.asarray(self._sent.rows[-1])

    def unplayed(self, next_index: int) -> bool:
        """Whether some are still to be played from `next_index` on."""
        return self._sent is not None and next_index < self._sent.end_index

    def allowed_from(self, measured: Measured) -> tuple[int, int]:
        """First and last index at which new rows may begin: not yet played, and no gap."""
        if self._sent is None:
            return measured.next_index, measured.next_index
        return max(measured.next_index, self._sent.first_index + 1), self._sent.end_index

    def before(self, first_index: int, measured: Measured) -> Floats:
        """Those just before `first_index`, [B, J]; the commanded pose where there are none."""
        if self._sent is None:
            return measured.commanded[None]
        upto = first_index - self._sent.first_index
        return self._sent.rows[max(0, upto - self._limits.history) : upto]

    def accept(self, first_index: int, rows: Floats, ramp: Floats, measured: Measured) -> Targets:
        """Replace all rows from `first_index` on by `rows` and the `ramp` after them."""
        targets = Targets(first_index, np.concatenate([rows, ramp]), len(ramp))
        history_index, history = first_index - 1, measured.commanded[None]
        if self._sent is not None:
            history_index = max(self._sent.first_index, measured.next_index - self._limits.history)
            history = self._sent.rows[history_index - self._sent.first_index : first_index - self._sent.first_index]
        self._sent = Targets(history_index, np.concatenate([history, targets.rows]), targets.ramp_rows)
        self.end_index = max(self.end_index, targets.end_index)
        return targets

    def early_ramp(self, first_index: int, measured: Measured) -> Targets | None:
        """A stop along them from `first_index`; None where they end as soon in the ramp that they have."""
        first, last = self.allowed_from(measured)
        if self._sent is None or not first <= first_index < last:
            return None
        upto = first_index - self._sent.first_index
        before, path = self._sent.rows[:upto], self._sent.rows[upto:]
        ramp = stop_ramp(before[-1], path, self._limits)
        if not len(ramp) or self._limits.first_violation(ramp, before, stopping=True) is not None:
            return None
        return self.accept(first_index, ramp[:0], ramp, measured)

    def move_to_measured(self, ramp: Targets | None, measured: Measured) -> Targets | None:
        """After `ramp`, a movement to the measured pose: motors do not push against what blocks a joint."""
        index = self.allowed_from(measured)[1]
        start = self._sent.rows[-1] if self._sent else measured.commanded
        goal = np.clip(measured.positions, self._limits.lower, self._limits.upper)
        rows = straight_move(start, goal, self._limits) if np.isfinite(goal).all() else goal[None]
        if self._limits.first_violation(rows, start[None]) is not None:
            return ramp
        targets = self.accept(index, rows[:0], rows, measured)
        if ramp is None:
            return targets
        return Targets(ramp.first_index, np.concatenate([ramp.rows, rows]), ramp.ramp_rows + len(rows))
