"""Poses in which a servo arm's hand is at a position, clear of the table; or the nearest reachable position."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats
from paramove.motion.clearance import ClearanceChecker
from paramove.motion.plans import FARTHEST_M, metres
from paramove.robots import Chain, OutOfReachError

MIN_HEIGHT = 0.0005
"""m; of the hand's lowest point above the table."""
_PITCHES_A_BAND = 41
_GRID_M = 0.005
_TRIED_POSITIONS = 100


class HandPoses:
    """Finds end poses of a servo arm.

    Args:
        chain: The arm.
        clearance: Of the table.
        gripper: Angle of the gripper for which the table is kept clear, rad.
        base: Angles of the arm in the base pose, [J], rad: poses with the elbow on the same side come first, as the way
            to others leads through the stretched arm.
    """

    def __init__(self, chain: Chain, clearance: ClearanceChecker, gripper: float, base: Floats) -> None:
        self._chain, self._clearance, self._gripper = chain, clearance, gripper
        arm = chain.kinematics
        rest = arm.forward(base)
        away = np.abs(arm.all_joint_angles(rest.position, float(rest.pitch)) - base).sum(axis=-1)
        self._usual = 0 if np.isnan(away).all() else int(np.nanargmin(away))

    def pitch_at(self, target: ArrayLike, preferred: float, band: Floats) -> float:
        """The pitch in a band, nearest to the preferred one, that reaches a position clear of the table; rad.

        Args:
            target: Shape [3], frame of the base, m.

        Raises:
            OutOfReachError: There is none; with the reason and the nearest reachable position.
        """
        goal = np.asarray(target, dtype=np.float64)
        if goal.shape != (3,) or not np.isfinite(goal).all() or np.abs(goal).max() > FARTHEST_M:
            raise OutOfReachError(
                f"{goal.tolist()} is no position: expected three numbers x, y, z in m, up to {FARTHEST_M:g} m away"
            )
        pitches, angles = self._poses(goal, preferred, band)
        obstacles = []
        for pitch, row in zip(pitches, angles, strict=True):
            obstacle = self._obstacle(row)
            if not obstacle:
                return float(pitch)
            obstacles.append(obstacle)
        raise self._out_of_reach(goal, preferred, band, obstacles)

    def ahead(self, height: float, band: Floats) -> Floats:
        """The positions of a row straight ahead at this height that are reached with a pitch of a band, [N, 3], m."""
        ahead = np.arange(0.02, 0.5, _GRID_M)
        positions = np.stack([ahead, np.zeros_like(ahead), np.full_like(ahead, height)], axis=1)
        return self._reached(positions, np.linspace(band[0], band[1], 13))

    def _reached(self, positions: Floats, pitches: Floats) -> Floats:
        """Those of the positions [N, 3] that are reached with one of the pitches [P]."""
        solutions = self._chain.kinematics.all_joint_angles(positions[:, None], pitches[None])
        return np.asarray(positions[np.isfinite(solutions).all(axis=-1).any(axis=-1).any(axis=-1)])

    def _poses(self, goal: Floats, preferred: float, band: Floats) -> tuple[Floats, Floats]:
        """Pitches in order of their distance from the preferred one, with the joint angles, [P] and [P, J].

        Those of the usual posture come first.
        """
        pitches = np.unique([*np.linspace(band[0], band[1], _PITCHES_A_BAND), np.clip(preferred, band[0], band[1])])
        pitches = pitches[np.argsort(np.abs(pitches - preferred), kind="stable")]
        solutions = self._chain.kinematics.all_joint_angles(goal, pitches)
        good = np.asarray(np.isfinite(solutions).all(axis=-1))
        usual = good[:, self._usual]
        other = np.asarray(good.any(axis=-1)) & ~usual
        rows = [solutions[usual, self._usual], solutions[np.flatnonzero(other), np.argmax(good[other], axis=-1)]]
        return np.concatenate([pitches[usual], pitches[other]]), np.concatenate(rows)

    def _obstacle(self, row: Floats) -> str:
        """What the arm would touch in a pose; empty if nothing."""
        pose = np.append(row, self._gripper)[None]
        if float(self._clearance.heights(pose)[0]) < MIN_HEIGHT:
            return "the arm would touch the table there"
        touching = self._clearance.touching(pose)
        return "" if touching is None else f"its {touching[0]} would touch its {touching[1]} there"

    def _out_of_reach(self, goal: Floats, preferred: float, band: Floats, obstacles: Sequence[str]) -> OutOfReachError:
        lowest, highest = np.rad2deg(band)
        cause = " or ".join(dict.fromkeys(obstacles)) or self._cause(goal, preferred)
        message = f"{metres(goal)} cannot be reached with the hand {lowest:.0f} to {highest:.0f} deg down: {cause}"
        nearest = self._nearest(goal, preferred, band)
        if nearest is None:
            return OutOfReachError(f"{message}; no position in that direction can be reached")
        return OutOfReachError(
            f"{message}; the nearest position that can be reached is {metres(nearest)}", None, nearest
        )

    def _cause(self, goal: Floats, preferred: float) -> str:
        try:
            pitch = self._chain.kinematics.nearest_pitch(goal, preferred)
        except OutOfReachError as error:
            return str(error).split("is out of reach: ")[-1].split("; ")[0]
        return f"the hand would have to be {np.rad2deg(pitch):.0f} deg down"

    def _nearest(self, goal: Floats, preferred: float, band: Floats) -> Floats | None:
        """Nearest position of a grid in the upright plane through the arm's axis and the goal that can be reached."""
        axis = np.array([*self._chain.kinematics.yaw_axis, 0.0])
        ahead, side = (goal - axis)[:2]
        azimuth = np.arctan2(side, ahead)
        grid = np.stack(np.meshgrid(np.arange(0.03, 0.45, _GRID_M), np.arange(0.0, 0.45, _GRID_M)), axis=-1)
        radius, height = grid.reshape(-1, 2).T
        for turned in (azimuth, 0.75 * azimuth, 0.5 * azimuth):
            positions = axis + np.stack([radius * np.cos(turned), radius * np.sin(turned), height], axis=-1)
            reached = self._reached(positions, np.linspace(band[0], band[1], 9))
            for position in reached[np.argsort(np.linalg.norm(reached - goal, axis=-1))][:_TRIED_POSITIONS]:
                if any(not self._obstacle(row) for row in self._poses(position, preferred, band)[1]):
                    return np.asarray(position)
        return None
