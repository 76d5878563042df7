"""Inputs and outputs of a step of the safety gate."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from paramove.documents import Floats

PERSON_STOP = "person_stop"
"""Code of the fault that a person's stop latches."""


class State(enum.Enum):
    """What the gate lets pass: rows only in ARMED, a stop ramp in STOPPING."""

    DISCONNECTED = "disconnected"  # the robot sends no data
    DISARMED = "disarmed"
    ARMED = "armed"
    STOPPING = "stopping"
    HOLD = "hold"  # at rest after a fault, which stays until a new arming request
    ESTOP = "emergency stop"  # pressed or without data; wins in every state and is left, disarmed, by its release alone


@dataclass(frozen=True)
class Fault:
    """Why the gate does not let pass. `joint` is "" where no single joint is at fault."""

    code: str
    joint: str
    detail: str


@dataclass(frozen=True, eq=False)
class Measured:
    """What the robot reports. Arrays [J], rad; `next_index` counts the stream's rows."""

    captured_ns: int
    positions: Floats
    commanded: Floats
    at_rest: bool
    next_index: int


@dataclass(frozen=True)
class ArmingRequest:
    """A request to arm or disarm; not `by_person`: from a program."""

    captured_ns: int
    source: str
    armed: bool
    by_person: bool = False


@dataclass(frozen=True, eq=False)
class Proposal:
    """Rows to be streamed from `first_index`, [N, J], rad; `ahead` [M, J] follow them and serve the stop ramp only."""

    captured_ns: int
    epoch: int
    joint_names: tuple[str, ...]
    first_index: int
    rows: Floats
    ahead: Floats


@dataclass(frozen=True, eq=False)
class Inputs:
    """All that a step may know.

    `stop` is a fault that the driver has detected, `arming_faults` are those that only forbid arming (ids, models,
    voltage, …), of checks that began at `checks_began_ns` (None: now). `emergency`: whether the emergency stop is
    pressed; None: its source sent nothing since the last step. `no_program`: why no program may arm this robot; "" only
    where the driver has verified that its own launch emulates the robot.
    """

    measured: Measured | None = None
    word: ArmingRequest | None = None
    proposal: Proposal | None = None
    stop: Fault | None = None
    arming_faults: tuple[Fault, ...] = ()
    emergency: bool | None = None
    checks_began_ns: int | None = None
    no_program: str = "nothing shows that its launch emulates the robot"


@dataclass(frozen=True, eq=False)
class Targets:
    """Rows that may be sent, [N, J], rad, the last `ramp_rows` of which are the stop ramp."""

    first_index: int
    rows: Floats
    ramp_rows: int

    @property
    def end_index(self) -> int:
        """Index after the last row."""
        return self.first_index + len(self.rows)


class Clearance(Protocol):
    """How near the robot's parts come to each other and to what is fixed around it."""

    def distances(self, q: Floats) -> tuple[float, str, str]:
        """The minimum distance in the pose `q` [J], rad: metres (negative: penetration) and the names of the two."""
        ...


@dataclass(frozen=True, eq=False)
class SafetySettings:
    """Ages in ms, angles in rad, rates per second.

    Attributes:
        word_age_ms: Of a request to arm, when it was received: when the checks began, which may take `checks_ms`.
        following: How far each joint may be from its commanded position, [J], for up to `following_ms`; inf for a joint
            that may stay away, such as fingers that hold something; None: not checked.
        emergency_timeout_ms: An emergency stop without data for so long counts as pressed; None if the robot has none.
        proposals_per_s, words_per_s: Nominal rates; 1.2 times as many within 250 ms pass. None: not counted.
    """

    measured_timeout_ms: float = 500.0
    proposal_age_ms: float = 250.0
    word_age_ms: float = 1000.0
    checks_ms: float = 3000.0
    lost_rows_ms: float = 500.0
    pose_tolerance: float = float(np.deg2rad(0.5))
    following: Floats | None = None
    following_ms: float = 100.0
    emergency_timeout_ms: float | None = None
    proposals_per_s: float | None = None
    words_per_s: float | None = 20.0
