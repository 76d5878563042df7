"""A synthetic arm of three joints at 100 Hz, its gate, and what its driver says."""

from __future__ import annotations

import numpy as np

from benchmarks.safety_steps import EPOCH, MECHANICAL, MS, NAMES, limits_at
from paramove.safety.core import SafetyCore
from paramove.safety.gate_io import ArmingRequest, Clearance, Inputs, Measured, Proposal, SafetySettings, State, Targets
from paramove.safety.stopping import straight_move

LIMITS = limits_at(0.01)
START_NS = 5_000 * MS
HOME = np.zeros(3)
PATH = straight_move(HOME, np.array([1.0, -0.8, 0.5]), LIMITS)


class SmallArm:
    """A gate and a robot that plays what it is given; time moves by `step`."""

    def __init__(self, settings: SafetySettings | None = None, clearance: Clearance | None = None) -> None:
        mechanical = (np.full(3, -MECHANICAL), np.full(3, MECHANICAL))
        self.core = SafetyCore(LIMITS, mechanical, EPOCH, START_NS, settings, clearance)
        self.now = START_NS
        self.stream = HOME[None]  # row 0 is the pose before index 0
        self.played = 0
        self.push = np.zeros(3)

    @property
    def at_rest(self) -> bool:
        return self.played >= len(self.stream) - 1

    def measured(self) -> Measured:
        commanded = self.stream[self.played]
        return Measured(self.now, commanded + self.push, commanded, self.at_rest, self.played)

    def proposal(self, path: np.ndarray = PATH, start: int = 0, rows: int = 30, guard: int = 2) -> Proposal:
        """What a driver says that plays `path` from the index `start` on."""
        first = max(start, self.played + guard) if self.played > start else start
        part = path[first - start :]
        return Proposal(self.now, EPOCH, NAMES, first, part[:rows], part[rows : rows + 60])

    def step(self, ms: int = 10, **said: object) -> tuple[Targets | None, State, tuple[str, ...]]:
        """Play for `ms`, then one step of the gate; `said` are fields of its inputs."""
        self.played = min(self.played + ms // 10, len(self.stream) - 1)
        self.now += ms * MS
        said.setdefault("measured", self.measured())
        proposal = said.get("proposal")
        if callable(proposal):
            said["proposal"] = proposal()
        targets, state, faults = self.core.step(self.now, Inputs(**said))  # type: ignore[arg-type]
        if targets is not None:
            self.stream = np.concatenate([self.stream[: targets.first_index + 1], targets.rows])
        return targets, state, tuple(fault.code for fault in faults)

    def arm(self, **said: object) -> tuple[Targets | None, State, tuple[str, ...]]:
        return self.step(word=ArmingRequest(self.now + 10 * MS, "a person", True, by_person=True), **said)

    def follow(self, path: np.ndarray, steps: int) -> None:
        """Propose `path` as a driver does, as long as the gate stays armed."""
        for _ in range(steps):
            left = self.proposal(path)
            if self.core.state is State.ARMED:
                self.step(proposal=(lambda: self.proposal(path)) if len(left.rows) > 1 else None)

    def in_motion(self, steps: int = 40) -> None:
        self.arm()
        for _ in range(steps):
            self.step(proposal=self.proposal)
        assert self.core.state is State.ARMED
        assert not self.at_rest
