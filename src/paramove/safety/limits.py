"""The limits of commanded movement, and the first row that breaks one.

Rows of joint angles [N, J] in rad, one every `dt_s`, are judged as a whole: all joints or none. The period is the
nominal one, never a measured one: a loop that stalled must not be allowed a larger step.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Floats

# Accelerations are taken over two spans of this length; a span is at least one row. A single 1 ms difference of angles
# that were rounded to six decimals is noise of 1 rad/s²; over 4 ms it is 0.06 rad/s².
SPAN_S = 0.004
# Jerks are taken over three spans of this length. HOAP-3's planned movements are splines through points 5 ms apart:
# over 4 ms they reach 3.6 times robot.yaml's jerk, over 8 ms 1.3 times, over 12 ms 0.8 times. What is shorter does not
# reach a joint whose position loop has a time constant of 5 ms.
JERK_SPAN_S = 0.012
# What rounding to six decimals adds to a third difference, rad: half a unit times 1 + 3 + 3 + 1.
ROUNDING = 8 * 0.5e-6
# Slack for rounding: a movement planned exactly at a limit passes.
SLACK = 1.001
# A step of more than this many times the motors' fastest is a jump: a wrong number, not a fast movement.
JUMP_FACTOR = 1.5
# Joints outside their soft range may only come back, at this fraction of the operating velocity.
INWARD_FRACTION = 0.2
# A controlled stop has the path's own jerk and as much again for the slowing down.
STOP_JERK_FACTOR = 2.0
RULES = {
    "not_finite": "is not a finite number",
    "joint_limit": "leaves its range",
    "jump": "jumps",
    "velocity": "is too fast",
    "acceleration": "accelerates too hard",
    "jerk": "changes its acceleration too fast",
}
"""In the gate's order, and what breaks each, for people."""


@dataclass(frozen=True)
class Violation:
    """One value that breaks a rule. `requested` and `allowed` are in `unit`; `allowed` is the text of a limit or range.

    `step` is where a jump begins and ends, deg; None for other rules.
    """

    code: str
    row: int
    joint: str
    requested: float
    allowed: str
    unit: str
    step: tuple[float, float] | None = None

    @property
    def rank(self) -> int:
        """Of its rule in the gate's order."""
        return list(RULES).index(self.code)

    @property
    def message(self) -> str:
        """Cause, the requested value and what is allowed."""
        what = RULES[self.code]
        step = "" if self.step is None else f" from {self.step[0]:.4g} to {self.step[1]:.4g} deg"
        where = f"joint {self.joint} {what}{step} at row {self.row}"
        return f"{where}: requested {self.requested:.4g} {self.unit}, allowed {self.allowed}"


@dataclass(frozen=True, eq=False)
class MotionLimits:
    """Limits of J joints; arrays [J] in rad, rad/s, rad/s², rad/s³."""

    names: tuple[str, ...]
    lower: Floats
    upper: Floats
    motor_velocity: Floats
    velocity: Floats
    acceleration: Floats
    stop_acceleration: Floats
    jerk: Floats
    dt_s: float

    @property
    def span(self) -> int:
        """Rows over which differences for the acceleration are taken."""
        return max(1, round(SPAN_S / self.dt_s))

    @property
    def jerk_span(self) -> int:
        """Rows over which differences for the jerk are taken."""
        return max(1, round(JERK_SPAN_S / self.dt_s))

    @property
    def history(self) -> int:
        """Rows before the first that its judgement needs."""
        return 3 * self.jerk_span

    def first_violation(
        self, rows: Floats, before: Floats, *, rest_at_end: bool = False, stopping: bool = False
    ) -> Violation | None:
        """The first rule that `rows` break, in the gate's order, or None.

        Args:
            rows: Shape [N, J], rad, N >= 1.
            before: The rows commanded just before, [B, J], latest last, B >= 1; what lies before them is taken as rest.
            rest_at_end: Judge as if the last row were held after the end.
            stopping: Judge by what a controlled stop may use, with rest at the end.
        """
        for known in (before, rows):
            violation = self._first("not_finite", ~np.isfinite(known), known)
            if violation is not None:
                return violation
        history = self.history
        parts = [np.repeat(before[:1], max(0, history - len(before)), axis=0), before[-history:], rows]
        if rest_at_end or stopping:
            parts.append(np.repeat(rows[-1:], history, axis=0))
        whole = np.concatenate(parts)
        excess = np.maximum(np.maximum(self.lower - whole, whole - self.upper), 0.0)[history - 1 :]
        outward = (excess[1:] > 1e-9) & ~(excess[1:] <= excess[:-1])
        violation = self._first("joint_limit", outward, whole[history:])
        return violation or self._first_too_fast(whole, excess[:-1] > 1e-9, stopping)

    def _first_too_fast(self, whole: Floats, outside: NDArray[np.bool_], stopping: bool) -> Violation | None:
        """`whole` begins with the history; `outside` is true where the row before lies outside the soft range."""
        h, end = self.history, len(whole)
        span_s, jerk_span_s = self.span * self.dt_s, self.jerk_span * self.dt_s

        def earlier(rows: int) -> Floats:
            return whole[h - rows : end - rows]

        n, m = self.span, self.jerk_span
        steps = (earlier(0) - earlier(1)) / self.dt_s
        bends = (earlier(0) - 2.0 * earlier(n) + earlier(2 * n)) / span_s**2
        jerks = (earlier(0) - 3.0 * (earlier(m) - earlier(2 * m)) - earlier(3 * m)) / jerk_span_s**3
        acceleration = self.stop_acceleration if stopping else self.acceleration
        jerk = (STOP_JERK_FACTOR if stopping else 1.0) * SLACK * self.jerk + ROUNDING / jerk_span_s**3
        slow = np.where(outside, INWARD_FRACTION, 1.0)
        for code, values, limit, unit in (
            ("jump", steps, JUMP_FACTOR * self.motor_velocity, "deg/s"),
            ("velocity", steps, slow * SLACK * self.velocity, "deg/s"),
            ("acceleration", bends, SLACK * acceleration, "deg/s²"),
            ("jerk", jerks, jerk, "deg/s³"),
        ):
            # Written so that a NaN would be a violation too.
            violation = self._first(code, ~(np.abs(values) <= limit), np.abs(values), unit, limit)
            if violation is not None and code == "jump":
                step = whole[h + violation.row - 1 : h + violation.row + 1, self.names.index(violation.joint)]
                return replace(violation, step=(float(np.rad2deg(step[0])), float(np.rad2deg(step[1]))))
            if violation is not None:
                return violation
        return None

    def _first(
        self,
        code: str,
        bad: NDArray[np.bool_],
        values: Floats,
        unit: str = "deg",
        limit: Floats | float = np.nan,
    ) -> Violation | None:
        if not bad.any():
            return None
        row, joint = (int(i) for i in np.argwhere(bad)[0])
        maximum = np.broadcast_to(limit, bad.shape)[row, joint]
        low, high, maximum, value = np.rad2deg([self.lower[joint], self.upper[joint], maximum, values[row, joint]])
        texts = {"not_finite": "a finite number", "joint_limit": f"{low:.4g} to {high:.4g} deg"}
        return Violation(code, row, self.names[joint], float(value), texts.get(code, f"{maximum:.4g} {unit}"), unit)
