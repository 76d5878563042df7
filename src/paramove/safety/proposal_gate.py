"""The checks of a proposal before its rows pass, in the order of `ProposalGate.judged`."""

from __future__ import annotations

import numpy as np

from paramove.documents import Floats
from paramove.safety.accepted_rows import AcceptedRows
from paramove.safety.clearance import clearance_fault
from paramove.safety.gate_io import Clearance, Fault, Measured, Proposal, SafetySettings
from paramove.safety.limits import MotionLimits
from paramove.safety.stopping import stop_ramp
from paramove.safety.watches import RateWatch

MAX_ROWS = 5000


class ProposalGate:
    """Judges proposals for the stream `epoch`; all joints and rows pass, or none."""

    def __init__(self, limits: MotionLimits, settings: SafetySettings, epoch: int, clearance: Clearance | None) -> None:
        self._limits = limits
        self._settings = settings
        self._epoch = epoch
        self._clearance = clearance
        self._rate = RateWatch(settings.proposals_per_s)
        self._counted_ns: int | None = None

    def judged(self, now_ns: int, proposal: Proposal, measured: Measured, accepted: AcceptedRows) -> Fault | Floats:
        """The first check that fails: form, age, rate, index, movement, the stop after it, clearance.

        Returns:
            If all pass, the stop that follows the proposal's rows, [M, J]; M = 0 where these end at rest.
        """
        fault = self._form(proposal) or self._time(now_ns, proposal)
        fault = fault or self._index(proposal, accepted.allowed_from(measured))
        return fault or self._movement(proposal, accepted.before(proposal.first_index, measured))

    def _form(self, proposal: Proposal) -> Fault | None:
        names, n_joints = self._limits.names, len(self._limits.names)
        if proposal.joint_names != names:
            message = f"the rows are of {len(proposal.joint_names)} other joints, allowed: {', '.join(names)}"
            return Fault("names", "", message)
        for rows in (proposal.rows, proposal.ahead):
            if rows.ndim != 2 or rows.shape[1] != n_joints or len(rows) > MAX_ROWS:
                return Fault("length", "", f"rows have shape {rows.shape}, allowed [up to {MAX_ROWS}, {n_joints}]")
        if not len(proposal.rows):
            return Fault("length", "", "the proposal is empty, at least one row is needed")
        if proposal.epoch != self._epoch:
            return Fault("epoch", "", f"rows of epoch {proposal.epoch}, allowed {self._epoch}: from before a restart")
        return None

    def _time(self, now_ns: int, proposal: Proposal) -> Fault | None:
        age_ms = (now_ns - proposal.captured_ns) * 1e-6
        if not 0.0 <= age_ms <= self._settings.proposal_age_ms:
            allowed = f"0 to {self._settings.proposal_age_ms:.0f} ms"
            return Fault("stale", "", f"the rows are {age_ms:.0f} ms old, allowed {allowed}")
        known, self._counted_ns = proposal.captured_ns == self._counted_ns, proposal.captured_ns
        if not known and self._rate.exceeded(now_ns):
            return Fault("rate", "", f"more proposals than allowed: {self._rate.allowed} within 250 ms")
        return None

    def _index(self, proposal: Proposal, allowed: tuple[int, int]) -> Fault | None:
        index, (first, last) = proposal.first_index, allowed
        if index < first:
            return Fault(
                "played", "", f"rows from index {index}, allowed from {first}: the robot has played those before"
            )
        return Fault("gap", "", f"rows from index {index}, allowed up to {last}: a gap") if index > last else None

    def _movement(self, proposal: Proposal, before: Floats) -> Fault | Floats:
        # The rows ahead are judged too: the stop ramp will run over them.
        rows = np.concatenate([proposal.rows, proposal.ahead])
        violation = self._limits.first_violation(rows, before, rest_at_end=not len(proposal.ahead))
        if violation is not None:
            return Fault(violation.code, violation.joint, violation.message)
        ramp = proposal.ahead
        if len(ramp):
            ramp = stop_ramp(proposal.rows[-1], ramp, self._limits)
        if len(ramp):
            until = np.concatenate([before, proposal.rows])
            violation = self._limits.first_violation(ramp, until, stopping=True)
            if violation is not None:
                return Fault(violation.code, violation.joint, f"in the stop after these rows: {violation.message}")
        if self._clearance is None:
            return ramp
        sent = np.concatenate([proposal.rows, ramp])
        return clearance_fault(self._clearance, before[-1], sent, self._limits, len(proposal.rows)) or ramp
