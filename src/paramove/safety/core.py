"""The one gate between a commanded movement and a motor: a pure function of time and inputs.

No clock, no input or output, no threads. Not armed by default, and it never arms itself: only a person's arming request
from after the start of this gate, and after its last fault, arms it. A program's request does so only for a robot that
the driver has verified to be emulated by its own launch, and only until this gate was armed, stopped or at fault for
the first time.

Each step takes the rows proposed for the stream and gives the rows that may be sent. Whatever it gives ends at rest:
the rows are followed by their own stop ramp, so a sender that dies leaves a robot that stops by itself.

Gates, in order: 1 names, length, epoch and age; 2 rate; 3 continuity with what was accepted; 4 finite values, soft
position range, jump, velocity, acceleration and jerk with the nominal period; 5 the same for the stop that follows; 6
clearance of both. A violation is answered by a controlled stop along the path that was accepted before, then HOLD with
the fault latched.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from paramove.documents import Floats
from paramove.safety.accepted_rows import AcceptedRows
from paramove.safety.gate_io import (
    ArmingRequest,
    Clearance,
    Fault,
    Inputs,
    Measured,
    Proposal,
    SafetySettings,
    State,
    Targets,
)
from paramove.safety.limits import MotionLimits
from paramove.safety.proposal_gate import ProposalGate
from paramove.safety.watches import EmergencyWatch, FollowingWatch, RateWatch

TOUCHED = "it has been armed, stopped or at fault before"
"""Why no program may arm an emulated robot either."""


class SafetyCore:
    """The gate's state machine for one robot.

    Args:
        limits: Of all joints of the robot.
        mechanical: Lower and upper mechanical limits, each [J], rad, for the check of the pose at arming.
        epoch: Of the stream that this gate serves.
        start_ns: Arming requests captured at or before this time are ignored: they were for an earlier gate.
        clearance: Measures how near parts of the robot come to each other; None: not checked.

    Attributes:
        untouched: Whether this gate was never armed, stopped or at fault.
    """

    def __init__(
        self,
        limits: MotionLimits,
        mechanical: tuple[Floats, Floats],
        epoch: int,
        start_ns: int,
        settings: SafetySettings | None = None,
        clearance: Clearance | None = None,
    ) -> None:
        self.limits = limits
        self.settings = settings or SafetySettings()
        self.state = State.DISCONNECTED
        self.faults: tuple[Fault, ...] = ()
        self.untouched = True
        self._mechanical = mechanical
        self._now_ns = start_ns
        self._requests_after_ns = start_ns  # only later arming requests count
        self._measured_ns = start_ns
        self._stopping_since_ns = start_ns
        self._disarm_after_stop = False
        self._played = 0
        self._accepted = AcceptedRows(limits)
        self._gate = ProposalGate(limits, self.settings, epoch, clearance)
        self._emergency = EmergencyWatch(self.settings.emergency_timeout_ms, start_ns)
        self._following = FollowingWatch(limits.names, self.settings.following, self.settings.following_ms)
        self._requests = RateWatch(self.settings.words_per_s)

    def step(self, now_ns: int, inputs: Inputs) -> tuple[Targets | None, State, tuple[Fault, ...]]:
        """Advance to `now_ns`; returns the rows that may be sent (None: send nothing), the state and the faults."""
        stop = self._clock_fault(now_ns) or inputs.stop
        pressed = self._emergency.fault(now_ns, inputs.emergency)
        if pressed is not None:
            targets = self._emergency_stop(now_ns, pressed, inputs)
        else:
            if self.state is State.ESTOP:
                self.state = State.STOPPING  # and disarmed once it rests
            targets = self._step(now_ns, inputs.measured, replace(inputs, stop=stop))
        self.untouched &= self.state in (State.DISCONNECTED, State.DISARMED) and stop is None
        return targets, self.state, self.faults

    def held(self, next_index: int) -> Floats | None:
        """The last accepted row [J] if the robot has played them all: its own report of it is rounded to its units."""
        return self._accepted.held(next_index)

    def _step(self, now_ns: int, measured: Measured | None, inputs: Inputs) -> Targets | None:
        if not self._connected(now_ns, measured) or measured is None:
            return None
        targets: Targets | None = None
        if inputs.word is not None:
            targets = self._handle_request(now_ns, inputs.word, measured, inputs)
        if self.state is State.ARMED:
            targets = self._armed(now_ns, measured, inputs)
        elif inputs.stop is not None:
            self._latch(now_ns, inputs.stop)
        if self.state is State.STOPPING and targets is None:
            self._rest(now_ns, measured)
        return targets

    def _clock_fault(self, now_ns: int) -> Fault | None:
        back_ms = (self._now_ns - now_ns) * 1e-6
        self._now_ns = now_ns
        if back_ms <= 0.0:
            return None
        return Fault("clock", "", f"the time went back by {back_ms:.0f} ms, allowed 0 ms; arm again")

    def _emergency_stop(self, now_ns: int, pressed: Fault, inputs: Inputs) -> Targets | None:
        """Latch ESTOP; if something moves, the rows of a stop that begins as early as the stream allows."""
        targets = None
        if self.state is State.ARMED:
            targets = self._early_ramp(inputs.proposal, inputs.measured)
        self.state = State.ESTOP
        self._add(pressed)
        if inputs.stop is not None:
            self._add(inputs.stop)
        self._requests_after_ns = max(self._requests_after_ns, now_ns)  # arming needs a request from after the release
        self._stopping_since_ns = now_ns
        self._disarm_after_stop = True
        return targets

    def _connected(self, now_ns: int, measured: Measured | None) -> bool:
        if measured is not None:
            self._measured_ns = measured.captured_ns
        age_ms = abs(now_ns - self._measured_ns) * 1e-6
        if age_ms > self.settings.measured_timeout_ms:
            if self.state is not State.DISCONNECTED:
                self._disconnect(age_ms)
            return False
        if self.state is State.DISCONNECTED and measured is not None:
            self.state = State.DISARMED
        return True

    def _disconnect(self, age_ms: float) -> None:
        """Latched faults stay: one that came first, such as a lost port, is why the robot sends no data."""
        if self.state is State.DISARMED:
            self.faults = ()
        message = (
            f"no data from the robot for {age_ms:.0f} ms, allowed {self.settings.measured_timeout_ms:.0f} ms; it comes "
            "to rest by itself; arm again once it is back"
        )
        self._add(Fault("robot_silent", "", message))
        self.untouched = False
        self.state = State.DISCONNECTED
        self._disarm_after_stop = False
        self._accepted.clear()

    def _handle_request(
        self, now_ns: int, request: ArmingRequest, measured: Measured, inputs: Inputs
    ) -> Targets | None:
        if not request.armed:  # whoever disarms is obeyed, whatever clock there is: only permission to move expires
            return self._disarm(now_ns, measured, inputs)
        if request.captured_ns <= self._requests_after_ns:
            return None
        # One from the future must not shut out later ones.
        self._requests_after_ns = max(self._requests_after_ns, min(request.captured_ns, now_ns))
        too_often = self._requests.exceeded(now_ns)
        if self.state in (State.DISARMED, State.HOLD):
            self.faults = (*inputs.arming_faults, *self._arming_faults(now_ns, inputs, request, measured))
            if too_often:
                message = f"more arming requests than allowed: {self._requests.allowed} within 250 ms; wait"
                self._add(Fault("arming_rate", "", message))
            if not self.faults:
                self.state = State.ARMED
                self._accepted.clear()
                self._played = max(0, measured.next_index)
        return None

    def _disarm(self, now_ns: int, measured: Measured, inputs: Inputs) -> Targets | None:
        self._requests.exceeded(now_ns)  # counted, and never too many
        self._requests_after_ns = max(self._requests_after_ns, now_ns)  # arming needs a request from after this one
        if self.state is State.STOPPING:
            self._disarm_after_stop = True
        elif self.state is State.ARMED and self._moving(measured):
            return self._stop(now_ns, None, inputs.proposal, measured)
        else:
            self.state = State.DISARMED
        return None

    def _arming_faults(self, now_ns: int, inputs: Inputs, request: ArmingRequest, measured: Measured) -> list[Fault]:
        """Every check that fails; none means that the gate may be armed."""
        faults = []
        # A request to arm counts only while the person who sent it still looks; one to disarm always counts.
        began_ns = now_ns if inputs.checks_began_ns is None else inputs.checks_began_ns
        received_ns = min(max(began_ns, request.captured_ns), now_ns)  # at once, if sent during the checks
        age_ms, allowed_ms = (received_ns - request.captured_ns) * 1e-6, self.settings.word_age_ms
        if abs(age_ms) > allowed_ms:
            message = f"the arming request is {age_ms:.0f} ms old, allowed {allowed_ms:.0f} ms; arm again"
            faults.append(Fault("arming_stale", "", message))
        checks_ms, allowed_ms = (now_ns - received_ns) * 1e-6, self.settings.checks_ms
        if checks_ms > allowed_ms:
            message = (
                f"the checks before arming took {checks_ms:.0f} ms, allowed {allowed_ms:.0f} ms; see what keeps the "
                "bus or this computer busy, then arm again"
            )
            faults.append(Fault("arming_slow", "", message))
        no_program = inputs.no_program or ("" if self.untouched else TOUCHED)
        if no_program and not request.by_person:
            message = f"{request.source} is a program and may not arm: {no_program}; a person may: paramove arm enable"
            faults.append(Fault("arming_program", "", message))
        if not request.source:
            faults.append(Fault("arming_source", "", "the arming request has no source; name who arms"))
        if not measured.at_rest:
            faults.append(Fault("arming_moving", "", "the robot is moving; arm it at rest"))
        lower, upper = self._mechanical
        tolerance = self.settings.pose_tolerance
        for what, pose in (("measured", measured.positions), ("commanded", measured.commanded)):
            if pose.shape != lower.shape or not np.isfinite(pose).all():
                faults.append(Fault("arming_pose_unknown", "", f"the {what} pose is unknown: {pose}"))
                continue
            for joint in np.flatnonzero((pose < lower - tolerance) | (pose > upper + tolerance)):
                message = (
                    f"joint {self.limits.names[joint]} is {what} at {np.rad2deg(pose[joint]):.2f} deg, allowed "
                    f"{np.rad2deg(lower[joint]):.2f} to {np.rad2deg(upper[joint]):.2f} deg; move it inside by hand"
                )
                faults.append(Fault("arming_pose_outside", self.limits.names[joint], message))
        if not faults:
            away = [self.limits.names[joint] for joint in np.flatnonzero(self._following.away(measured))]
            if away:
                message = (
                    f"not at their commanded position: {', '.join(away)}; see what blocks them, or command their "
                    "present position"
                )
                faults.append(Fault("arming_following", away[0], message))
        return faults

    def _armed(self, now_ns: int, measured: Measured, inputs: Inputs) -> Targets | None:
        proposal = inputs.proposal
        fault = inputs.stop or self._report_fault(measured) or self._following.fault(measured)
        if fault is not None:
            return self._stop(now_ns, fault, proposal, measured)
        if proposal is None:
            return None
        judged = self._gate.judged(now_ns, proposal, measured, self._accepted)
        if isinstance(judged, Fault):
            return self._stop(now_ns, judged, proposal, measured)
        return self._accepted.accept(proposal.first_index, proposal.rows, judged, measured)

    def _report_fault(self, measured: Measured) -> Fault | None:
        """A report that cannot be true."""
        shape, end = (len(self.limits.names),), self._accepted.end_index
        if measured.positions.shape != shape or measured.commanded.shape != shape:
            shapes = f"{measured.positions.shape} and {measured.commanded.shape}"
            return Fault("report", "", f"the robot reports poses of shape {shapes}, allowed {shape}")
        if not self._played <= measured.next_index <= end:
            message = f"the robot is at row {measured.next_index}, allowed {self._played} to {end}; was it restarted?"
            return Fault("report", "", message)
        self._played = measured.next_index
        return None

    def _stop(self, now_ns: int, fault: Fault | None, proposal: Proposal | None, measured: Measured) -> Targets | None:
        """Latch the fault; give the rows of a stop that begins as early as the stream allows."""
        if fault is not None:
            self._add(fault)
        self.state = State.STOPPING
        self._stopping_since_ns = now_ns
        targets = self._early_ramp(proposal, measured)
        if fault is not None and fault.code == "following":
            return self._accepted.move_to_measured(targets, measured)
        return targets

    def _early_ramp(self, proposal: Proposal | None, measured: Measured | None) -> Targets | None:
        """From where the proposal may begin, along what was accepted: nothing else of the proposal is used.

        Where that is not possible, nothing: what was sent before ends in its own ramp.
        """
        if proposal is None or measured is None:
            return None
        return self._accepted.early_ramp(proposal.first_index, measured)

    def _add(self, fault: Fault) -> None:
        if all(fault.code != known.code or fault.joint != known.joint for known in self.faults):
            self.faults = (*self.faults, fault)

    def _latch(self, now_ns: int, fault: Fault) -> None:
        """A fault while nothing is let through: it stays until an arming request from after it."""
        self._disarm_after_stop = False
        if self.state is State.DISARMED:  # faults of an earlier arming are of no more interest
            self.state, self.faults = State.HOLD, ()
        self._add(fault)
        self._requests_after_ns = max(self._requests_after_ns, now_ns)

    def _moving(self, measured: Measured) -> bool:
        """Whether rows are played or still to be played: a report of rest can be older than the rows just sent."""
        return not measured.at_rest or self._accepted.unplayed(measured.next_index)

    def _rest(self, now_ns: int, measured: Measured) -> None:
        """Leave STOPPING once the robot reports that it rests."""
        # Rows that were sent and lost will never be played; they are waited for no longer than this.
        lost = now_ns - self._stopping_since_ns >= self.settings.lost_rows_ms * 1e6
        if self._moving(measured) and not (lost and measured.at_rest):
            return
        self._accepted.clear()
        self._requests_after_ns = max(self._requests_after_ns, now_ns)  # arming needs a request from after the stop
        self.state = State.HOLD if self.faults else State.DISARMED
        if self._disarm_after_stop:
            self.state = State.DISARMED
        self._disarm_after_stop = False
