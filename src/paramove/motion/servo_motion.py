"""Sizes of a servo arm's reaching, and its motion while it is planned."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from paramove.documents.array_types import Floats


@dataclass(frozen=True)
class ServoReachingOptions:
    """Sizes, m, s, m/s, deg."""

    table_z: float = 0.0  # frame of the base
    pitch_deg: float = 90.0  # of the hand at the target: straight down
    reach_band_deg: tuple[float, float] = (-90.0, 120.0)
    grasp_band_deg: tuple[float, float] = (50.0, 110.0)  # further from straight down an open gripper strikes the object
    lift: float = 0.05  # learned movements end and begin so far above an object
    speed: float = 0.06  # of straight lines, at most
    way_duration: float = 1.6  # of a learned movement, at least
    patience: float = (
        6.0  # s; where a learned movement takes longer, because the joints turn far, a milder one is tried
    )
    gripper_duration: float = 0.8
    settle_duration: float = 0.4  # the closed gripper is given so long to press
    work_opening: float = 0.6  # ξ
    closed_opening: float = 0.0
    clearance: float = 0.005  # of every part from the table on the way
    carry_clearance: float = 0.02
    near: float = 0.03  # so near the ends of a way the hand may be as low as it is there
    limit_share: float = 0.8  # of the operating velocity, acceleration and jerk


@dataclass
class MotionRows:
    """A motion under construction: rows of joint angles, rad."""

    rows: list[Floats]
    holding: list[NDArray[np.bool_]] = field(default_factory=list)
    phases: list[tuple[str, int]] = field(default_factory=list)

    @property
    def end(self) -> Floats:
        """The last row [J]."""
        return np.asarray(self.rows[-1][-1])

    def add(self, name: str, rows: Floats, holding: bool) -> None:
        """More rows, of which the first repeats the last one that is there."""
        if not self.phases or self.phases[-1][0] != name:
            self.phases.append((name, sum(map(len, self.rows)) - 1))
        self.rows.append(rows[1:])
        self.holding.append(np.full(len(rows) - 1, holding))
