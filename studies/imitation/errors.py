"""The errors of thesis 5.2.7, state by state, in the scale of the robot.

Of a target there are two movements: the one synthesised by the interpolative model, with elbows q and grippers r, and
the reference q̂, r̂ of a local model trained on demonstrations of this very target. q′ and q̂′ are their elbows as the
robot sets them (5.2.4).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from paramove.alignment import warp
from paramove.documents import Floats, Ints
from paramove.motion import ArmPoses

SIGNIFICANT = (20, 60)
"""The significant states, first and last, counted from 1 (5.2.7): outside them base poses differ by themselves."""


@dataclass(frozen=True)
class RobotArm:
    """A movement as the robot's arm makes it.

    Attributes:
        elbow: q′, [N, 3], m.
        gripper: Where the gripper is, [N, 3], m.
        elbow_turn: How far a joint limit turned the elbow about the shoulder-gripper line, [N], rad.
    """

    elbow: Floats
    gripper: Floats
    elbow_turn: Floats


@dataclass(frozen=True)
class Movement:
    """A converted movement (5.7) and what the robot makes of it.

    Attributes:
        proposed: q, r and o.
        closed_form: Elbows of 5.2.4 without regard to joint limits, as the thesis analyses them.
        within_limits: The same as it is executed: gripper as near as the elbow can bend, elbow turned at a limit.
        outside: By how much each joint of the closed form lies outside its limits, [N, 5], rad; 0 inside.
    """

    proposed: ArmPoses
    closed_form: RobotArm
    within_limits: RobotArm
    outside: Floats

    @property
    def limited(self) -> NDArray[np.bool_]:
        """States in which a joint limit moves the elbow, [N]."""
        return np.asarray((self.outside > 0.0).any(axis=1))


@dataclass(frozen=True)
class Errors:
    """Errors of K pairs of states, mm. Without alignment pair k is state k of both movements.

    Attributes:
        state: State of the synthesised movement, counted from 1, [K].
        gripper: Synthesis error of the gripper ‖r − r̂‖ (figures 5.15, 5.16).
        elbow: Synthesis error of the elbow ‖q − q̂‖ by interpolation (blue in figures 5.17, 5.18).
        effective: Effective synthesis error ‖q′ − q̂′‖ of the elbow that is set (red).
        min_imitation: Imitation error ‖q̂′ − q̂‖ of the reference (black): the best possible with this robot.
        imitation: Imitation error ‖q′ − q̂‖ of the synthesised movement (magenta).
        limited: Whether a joint limit moves the elbow of either movement.
    """

    state: Ints
    gripper: Floats
    elbow: Floats
    effective: Floats
    min_imitation: Floats
    imitation: Floats
    limited: NDArray[np.bool_]

    @property
    def significant(self) -> NDArray[np.bool_]:
        """Pairs whose state is one of the significant ones."""
        return np.asarray((self.state >= SIGNIFICANT[0]) & (self.state <= SIGNIFICANT[1]))


def errors_of(synthesised: Movement, reference: Movement, *, aligned: bool, executed: bool = False) -> Errors:
    """Errors of a synthesised movement against the reference of its target (5.2.7).

    Args:
        synthesised: Movement of the interpolative model.
        reference: Movement of the local model trained for the same target, with as many states.
        aligned: Whether the sequences of gripper positions are first brought together by time warping (B.8).
        executed: Take the arm within its joint limits instead of the closed form.
    """
    i, j = pairs(synthesised.proposed.gripper, reference.proposed.gripper, aligned)
    ours = synthesised.within_limits if executed else synthesised.closed_form
    theirs = reference.within_limits if executed else reference.closed_form
    person = reference.proposed
    gripper = ours.gripper if executed else synthesised.proposed.gripper
    return Errors(
        state=i + 1,
        gripper=_mm(gripper[i], person.gripper[j]),
        elbow=_mm(synthesised.proposed.elbow[i], person.elbow[j]),
        effective=_mm(ours.elbow[i], theirs.elbow[j]),
        min_imitation=_mm(theirs.elbow[j], person.elbow[j]),
        imitation=_mm(ours.elbow[i], person.elbow[j]),
        limited=synthesised.limited[i] | reference.limited[j],
    )


def pairs(first: Floats, second: Floats, aligned: bool) -> tuple[Ints, Ints]:
    """Which states of two sequences [N, 3] are compared: the same, or those that time warping (B.8) brings together."""
    if aligned:
        path = warp(first, second, "B")
        return path.first, path.second
    same = np.arange(len(first), dtype=np.int64)
    return same, same


def largest(values: Floats, where: NDArray[np.bool_]) -> float | None:
    """The largest of the chosen values; None where there are none."""
    chosen = values[where]
    return float(chosen.max()) if chosen.size else None


def ranges(states: Ints) -> str:
    """States in words: "20-24, 57, 59-60"."""
    found = np.unique(states)
    if not found.size:
        return "none"
    breaks = np.flatnonzero(np.diff(found) > 1) + 1
    parts = [(int(part[0]), int(part[-1])) for part in np.split(found, breaks)]
    return ", ".join(f"{a}" if a == b else f"{a}-{b}" for a, b in parts)


def _mm(a: Floats, b: Floats) -> Floats:
    return np.asarray(1000.0 * np.linalg.norm(a - b, axis=1))
