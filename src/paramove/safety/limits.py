"""What commanded movement must keep to, and the first place where it does not.

Rows of joint angles [N, J] in rad, one every `dt_s`, are judged as a whole: all joints or none. The period is the
nominal one, never a measured one: a loop that stalled must not be allowed a larger step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from paramove.robots.description import RobotDescription

FloatArray = NDArray[np.float64]

# Accelerations are taken over two spans of this many rows. A single 1 ms difference of angles that were rounded to six
# decimals is noise of 1 rad/s²; over 4 ms it is 0.06 rad/s².
SPAN = 4
# Slack for rounding: a movement planned exactly at a limit passes.
SLACK = 1.001
# A step of more than this many times the motors' fastest is a jump: a wrong number, not a fast movement.
JUMP_FACTOR = 1.5


@dataclass(frozen=True)
class Violation:
    """One value that breaks a rule. `asked` and `allowed` are in `unit`; `allowed` is the text of a limit or range."""

    code: str
    row: int
    joint: str
    asked: float
    allowed: str
    unit: str

    @property
    def sentence(self) -> str:
        """Cause, what was found and what is allowed."""
        what = {
            "not_finite": "is not a finite number",
            "joint_limit": "leaves its range",
            "jump": "jumps",
            "velocity": "is too fast",
            "acceleration": "accelerates too hard",
        }[self.code]
        return (
            f"joint {self.joint} {what} at row {self.row}: asked {self.asked:.4g} {self.unit}, allowed {self.allowed}"
        )


@dataclass(frozen=True, eq=False)
class MotionLimits:
    """Limits of J joints; arrays [J] in rad, rad/s, rad/s², rad/s³."""

    names: tuple[str, ...]
    lower: FloatArray
    upper: FloatArray
    motor_velocity: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    stop_acceleration: FloatArray
    jerk: FloatArray
    dt_s: float

    @classmethod
    def of(cls, description: RobotDescription) -> MotionLimits:
        """The soft position range and the operating limits of a robot, at its stream's period."""
        return cls(
            names=description.joint_names,
            lower=description.soft_lower,
            upper=description.soft_upper,
            motor_velocity=description.velocity,
            velocity=description.operating_velocity,
            acceleration=description.operating_acceleration,
            stop_acceleration=description.stop_acceleration,
            jerk=description.jerk,
            dt_s=description.stream.period_us * 1e-6,
        )

    def first_violation(self, rows: FloatArray, before: FloatArray, *, rest_at_end: bool = False) -> Violation | None:
        """The first rule that `rows` break, in the gate's order, or None.

        Args:
            rows: Shape [N, J], rad.
            before: The rows commanded just before, [B, J], newest last, B >= 1; shorter than 2 SPAN is taken as rest.
            rest_at_end: Judge as if the last row were held after the end.
        """
        found = self._first("not_finite", ~np.isfinite(rows), rows, "a finite number", 1.0, "")
        if found is not None:
            return found
        outside = (rows < self.lower - 1e-9) | (rows > self.upper + 1e-9)
        found = self._first("joint_limit", outside, rows, "{low:.4g} to {high:.4g} deg", 180 / np.pi, "deg")
        return found or self._first_too_fast(rows, before, rest_at_end)

    def _first_too_fast(self, rows: FloatArray, before: FloatArray, rest_at_end: bool) -> Violation | None:
        steps = np.abs(np.diff(np.concatenate([before[-1:], rows]), axis=0)) / self.dt_s
        for code, limit in (("jump", JUMP_FACTOR * self.motor_velocity), ("velocity", SLACK * self.velocity)):
            found = self._first(code, steps > limit, steps, "{limit:.4g} deg/s", 180 / np.pi, "deg/s", limit)
            if found is not None:
                return found
        accelerations = self._accelerations(rows, before, rest_at_end)
        limit = SLACK * self.acceleration
        return self._first(
            "acceleration", accelerations > limit, accelerations, "{limit:.4g} deg/s²", 180 / np.pi, "deg/s²", limit
        )

    def _accelerations(self, rows: FloatArray, before: FloatArray, rest_at_end: bool) -> FloatArray:
        """Magnitudes over two spans, one row each for the row in which the newer span ends, [N(+2 SPAN), J]."""
        missing = max(0, 2 * SPAN - len(before))
        parts = [np.repeat(before[:1], missing, axis=0), before[-2 * SPAN :], rows]
        if rest_at_end and len(rows):
            parts.append(np.repeat(rows[-1:], 2 * SPAN, axis=0))
        whole = np.concatenate(parts)
        span_s = SPAN * self.dt_s
        second = whole[2 * SPAN :] - 2.0 * whole[SPAN:-SPAN] + whole[: -2 * SPAN]
        return np.asarray(np.abs(second) / span_s**2)

    def _first(
        self,
        code: str,
        bad: NDArray[np.bool_],
        values: FloatArray,
        allowed: str,
        scale: float,
        unit: str,
        limit: FloatArray | None = None,
    ) -> Violation | None:
        if not bad.any():
            return None
        row, joint = (int(i) for i in np.argwhere(bad)[0])
        text = allowed.format(
            low=scale * self.lower[joint],
            high=scale * self.upper[joint],
            limit=scale * limit[joint] if limit is not None else np.nan,
        )
        return Violation(code, row, self.names[joint], float(scale * values[row, joint]), text, unit)
