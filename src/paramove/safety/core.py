"""The one gate between a commanded movement and a motor: a pure function of time and inputs.

No clock, no input or output, no threads. Not armed by default, and it never arms itself: only an arm word that a person
(in simulation the operator node) said after this gate began, and after its last fault, arms it.

Each step takes the rows proposed for the stream and gives the rows that may be sent. Whatever it gives ends at rest:
the rows are followed by their own stop ramp, so a sender that dies leaves a robot that stops by itself.

Gates, in order: 1 names, length, finite values; 2 epoch and age; 3 continuity with what was accepted; 4 soft position
range; 5 jump; 6 velocity and acceleration with the nominal period. A violation is answered by a controlled stop along
the path, then HOLD with the fault latched.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from paramove.safety.gate_io import (
    ArmWord,
    Fault,
    Inputs,
    Measured,
    Proposal,
    SafetySettings,
    State,
    Targets,
)
from paramove.safety.limits import SPAN, MotionLimits
from paramove.safety.stop_ramp import stop_ramp

FloatArray = NDArray[np.float64]


class SafetyCore:
    """The gate's state machine for one robot.

    Args:
        limits: Of all joints of the robot.
        mechanical: Lower and upper mechanical limits, each [J], rad, for the check of the pose at arming.
        epoch: Of the stream that this gate serves.
        start_ns: Arm words captured at or before this time are another life's and are not heard.
    """

    def __init__(
        self,
        limits: MotionLimits,
        mechanical: tuple[FloatArray, FloatArray],
        epoch: int,
        start_ns: int,
        settings: SafetySettings | None = None,
    ) -> None:
        self.limits = limits
        self.settings = settings or SafetySettings()
        self.state = State.DISCONNECTED
        self.faults: tuple[Fault, ...] = ()
        self._mechanical = mechanical
        self._epoch = epoch
        self._heard_ns = start_ns  # only later arm words count
        self._sent: Targets | None = None
        self._disarm_after_stop = False
        self._stopping_since_ns = 0

    def step(self, now_ns: int, inputs: Inputs) -> tuple[Targets | None, State, tuple[Fault, ...]]:
        """Advance to `now_ns`; returns the rows that may be sent (None: send nothing), the state and the faults."""
        if not self._connected(now_ns, inputs.measured):
            return None, self.state, self.faults
        measured = inputs.measured
        assert measured is not None  # _connected
        targets: Targets | None = None
        if inputs.word is not None:
            targets = self._hear(now_ns, inputs.word, measured, inputs.proposal)
        if self.state is State.ARMED:
            targets = self._armed(now_ns, measured, inputs)
        elif inputs.stop is not None:
            self._latch(now_ns, inputs.stop)
        if self.state is State.STOPPING and targets is None:
            self._rest(now_ns, measured)
        return targets, self.state, self.faults

    def held(self, next_index: int) -> FloatArray | None:
        """The last accepted row [J] if the robot has played them all: its own report of it is rounded to its units."""
        if self._sent is None or next_index < self._sent.end_index:
            return None
        return np.asarray(self._sent.rows[-1])

    def _connected(self, now_ns: int, measured: Measured | None) -> bool:
        if measured is None:
            return False
        age_ms = (now_ns - measured.captured_ns) * 1e-6
        if age_ms > self.settings.measured_timeout_ms:
            if self.state is not State.DISCONNECTED:
                allowed = f"{self.settings.measured_timeout_ms:.0f} ms"
                sentence = (
                    f"the robot was last heard {age_ms:.0f} ms ago, allowed {allowed}; it comes to rest by itself; "
                    "arm again once it is back"
                )
                self._disconnect(Fault("robot_silent", "", sentence))
            return False
        if self.state is State.DISCONNECTED:
            self.state = State.DISARMED
        return True

    def _disconnect(self, fault: Fault) -> None:
        self.state = State.DISCONNECTED
        self.faults = (fault,)
        self._sent = None

    def _hear(self, now_ns: int, word: ArmWord, measured: Measured, proposal: Proposal | None) -> Targets | None:
        if word.captured_ns <= self._heard_ns:
            return None
        self._heard_ns = word.captured_ns
        if not word.armed:
            if self.state is State.STOPPING:
                self._disarm_after_stop = True
            elif self.state is State.ARMED and self._moving(measured):
                self._disarm_after_stop = True
                return self._stop(now_ns, None, proposal, measured)
            else:
                self.state = State.DISARMED
        elif self.state in (State.DISARMED, State.HOLD):
            refusals = (*self._age_fault(now_ns, word), *self.arming_faults(word, measured))
            self.faults = refusals
            if not refusals:
                self.state = State.ARMED
                self._sent = None
        return None

    def _age_fault(self, now_ns: int, word: ArmWord) -> tuple[Fault, ...]:
        """A word to arm counts only while the person who said it still looks; one to disarm always counts."""
        age_ms, allowed_ms = (now_ns - word.captured_ns) * 1e-6, self.settings.word_age_ms
        if age_ms <= allowed_ms:
            return ()
        sentence = f"the arm word was said {age_ms:.0f} ms ago, allowed {allowed_ms:.0f} ms; say it again"
        return (Fault("arming_stale", "", sentence),)

    def arming_faults(self, word: ArmWord, measured: Measured) -> tuple[Fault, ...]:
        """Every check that fails; none means that the gate may be armed."""
        faults = []
        if not word.source:
            faults.append(Fault("arming_source", "", "the arm word names no source; say who arms"))
        if not measured.at_rest:
            faults.append(Fault("arming_moving", "", "the robot is moving; arm it at rest"))
        lower, upper = self._mechanical
        tolerance = self.settings.pose_tolerance
        pairs = (("measured", measured.positions), ("commanded", measured.commanded))
        for what, pose in pairs:
            if pose.shape != lower.shape or not np.isfinite(pose).all():
                faults.append(Fault("arming_pose_unknown", "", f"the {what} pose is not known: {pose}"))
                continue
            for joint in np.flatnonzero((pose < lower - tolerance) | (pose > upper + tolerance)):
                sentence = (
                    f"joint {self.limits.names[joint]} is {what} at {np.rad2deg(pose[joint]):.2f} deg, allowed "
                    f"{np.rad2deg(lower[joint]):.2f} to {np.rad2deg(upper[joint]):.2f} deg; move it inside by hand"
                )
                faults.append(Fault("arming_pose_outside", self.limits.names[joint], sentence))
        return tuple(faults)

    def _armed(self, now_ns: int, measured: Measured, inputs: Inputs) -> Targets | None:
        proposal = inputs.proposal
        if inputs.stop is not None:
            return self._stop(now_ns, inputs.stop, proposal, measured)
        if proposal is None:
            return None
        fault = self._judge(now_ns, proposal, measured)
        if fault is not None:
            return self._stop(now_ns, fault, proposal, measured)
        ahead = proposal.ahead
        ramp = stop_ramp(proposal.rows[-1], ahead, self.limits) if len(ahead) else ahead
        return self._accept(proposal.first_index, proposal.rows, ramp, measured)

    def _judge(self, now_ns: int, proposal: Proposal, measured: Measured) -> Fault | None:
        """The first gate that refuses."""
        fault = self._judge_form(now_ns, proposal) or self._judge_place(proposal, measured)
        if fault is not None:
            return fault
        # The rows ahead are judged too: the stop ramp will run over them.
        rows = np.concatenate([proposal.rows, proposal.ahead])
        before = self._before(proposal.first_index, measured)
        violation = self.limits.first_violation(rows, before, rest_at_end=not len(proposal.ahead))
        return Fault(violation.code, violation.joint, violation.sentence) if violation else None

    def _judge_form(self, now_ns: int, proposal: Proposal) -> Fault | None:
        names, n_joints = self.limits.names, len(self.limits.names)
        if proposal.joint_names != names:
            return Fault(
                "names", "", f"rows are for {len(proposal.joint_names)} other joints, allowed: {', '.join(names)}"
            )
        for rows in (proposal.rows, proposal.ahead):
            if rows.ndim != 2 or rows.shape[1] != n_joints:
                return Fault("length", "", f"rows have shape {rows.shape}, allowed [N, {n_joints}]")
        if not len(proposal.rows):
            return Fault("length", "", "the proposal is empty, at least one row is needed")
        if proposal.epoch != self._epoch:
            return Fault("epoch", "", f"rows of epoch {proposal.epoch}, allowed {self._epoch}: of an earlier life")
        age_ms = (now_ns - proposal.captured_ns) * 1e-6
        if not 0.0 <= age_ms <= self.settings.proposal_age_ms:
            allowed = f"0 to {self.settings.proposal_age_ms:.0f} ms"
            return Fault("stale", "", f"rows were made {age_ms:.0f} ms ago, allowed {allowed}")
        return None

    def _judge_place(self, proposal: Proposal, measured: Measured) -> Fault | None:
        first, end = proposal.first_index, self._sent.end_index if self._sent else measured.next_index
        if first < measured.next_index:
            sentence = f"rows from index {first}, allowed from {measured.next_index}: earlier ones are played"
            return Fault("played", "", sentence)
        if first > end:
            return Fault("gap", "", f"rows from index {first}, allowed up to {end}: no gap")
        return None

    def _before(self, first_index: int, measured: Measured) -> FloatArray:
        """The rows already accepted just before `first_index`; the commanded pose where there are none."""
        sent = self._sent
        if sent is None:
            return measured.commanded[None]
        upto = first_index - sent.first_index
        return sent.rows[max(0, upto - 2 * SPAN) : upto]

    def _accept(self, first_index: int, rows: FloatArray, ramp: FloatArray, measured: Measured) -> Targets:
        """Give the rows and their ramp; keep all that the robot has yet to play and a little of what it played."""
        targets = Targets(first_index, np.concatenate([rows, ramp]), len(ramp))
        sent = self._sent
        if sent is None:
            kept_index, kept = first_index - 1, measured.commanded[None]
        else:
            kept_index = max(sent.first_index, measured.next_index - 2 * SPAN)
            kept = sent.rows[kept_index - sent.first_index : first_index - sent.first_index]
        self._sent = Targets(kept_index, np.concatenate([kept, targets.rows]), targets.ramp_rows)
        return targets

    def _stop(self, now_ns: int, fault: Fault | None, proposal: Proposal | None, measured: Measured) -> Targets | None:
        """Latch the fault; give the rows of a stop that begins as early as the stream allows.

        Without good rows to stop along, nothing: what was sent before ends in its own ramp.
        """
        if fault is not None:
            self.faults = (*self.faults, fault)
        self.state = State.STOPPING
        self._stopping_since_ns = now_ns
        if proposal is None or self._judge_form(now_ns, proposal) or self._judge_place(proposal, measured):
            return None
        before = self._before(proposal.first_index, measured)
        path = np.concatenate([proposal.rows, proposal.ahead])
        while len(path) and (violation := self.limits.first_violation(path, before)) is not None:
            path = path[: violation.row]
        if not len(path):
            return None
        ramp = stop_ramp(before[-1], path, self.limits)
        return self._accept(proposal.first_index, ramp[:0], ramp, measured) if len(ramp) else None

    def _latch(self, now_ns: int, fault: Fault) -> None:
        """A fault while nothing is let through: it stays until a new arm word, and so nobody arms by an older one."""
        if fault not in self.faults:
            self.faults = (*self.faults, fault)
        self._disarm_after_stop = False
        if self.state is State.DISARMED:
            self.state = State.HOLD
        self._heard_ns = max(self._heard_ns, now_ns)

    def _moving(self, measured: Measured) -> bool:
        """Whether rows are played or still to be played: a report of rest can be older than the rows just sent."""
        return not measured.at_rest or (self._sent is not None and measured.next_index < self._sent.end_index)

    def _rest(self, now_ns: int, measured: Measured) -> None:
        """Leave STOPPING once the robot says that it rests."""
        # Rows that were sent and lost will never be played; they are waited for no longer than this.
        lost = now_ns - self._stopping_since_ns >= self.settings.lost_rows_ms * 1e6
        if self._moving(measured) and not (lost and measured.at_rest):
            return
        self._sent = None
        self._heard_ns = max(self._heard_ns, now_ns)  # a new arm word must be said after the stop
        self.state = State.HOLD if self.faults else State.DISARMED
        if self._disarm_after_stop:
            self.state = State.DISARMED
        self._disarm_after_stop = False
