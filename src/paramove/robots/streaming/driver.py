"""The arm driver's logic: accepted trajectories to batches of the robot's stream, through the safety gate.

One `tick` a camera period. A trajectory is checked whole and expanded to rows of 1 ms when it arrives (thesis 5.2.1:
the components outside the trajectory keep their pose), in slices, because a stop may not wait for it. Each tick then
sends the rows from a guard behind the latest known index on, about 300 ms of them, and the gate adds the stop ramp. If
ticks or batches stop, the robot rests by itself.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates

from paramove.msgs.joint_trajectory_pb2 import JointTrajectory, TrajectoryStatus
from paramove.msgs.safety_state_pb2 import ArmRequest, LinkState, SafetyFault, SafetyState, StopRequest
from paramove.robots import RobotDescription
from paramove.robots.streaming.execution import Execution, RobotReport
from paramove.robots.streaming.stream import StreamBatch, StreamState
from paramove.robots.streaming.trajectory_check import TrajectoryCheck
from paramove.safety import (
    PERSON_STOP,
    TOUCHED,
    ArmingRequest,
    Clearance,
    Fault,
    Inputs,
    Proposal,
    SafetyCore,
    SafetySettings,
    State,
    TrajectoryRejectedError,
    longest_path_s,
)

SAFETY_STATES = {
    State.DISCONNECTED: SafetyState.STATE_DISCONNECTED,
    State.DISARMED: SafetyState.STATE_DISARMED,
    State.ARMED: SafetyState.STATE_ARMED,
    State.STOPPING: SafetyState.STATE_STOPPING,
    State.HOLD: SafetyState.STATE_HOLD,
    State.ESTOP: SafetyState.STATE_ESTOP,
}
# A trajectory received later than this after it was made is a replay or comes from a queue that was stuck.
MAX_TRAJECTORY_AGE_S = 1.0
# The check of a trajectory takes longer only on a machine that is much too slow or busy.
MAX_CHECK_S = 3.0
# One from the future has a clock of its own; a publisher's clock may be ahead by as much as this.
MAX_TRAJECTORY_LEAD_S = 0.05
# A driver that did nothing for longer has let the robot run out of rows; the messages that waited for it are dropped.
MAX_STALL_S = 0.5
# Batches that came too late make the guard longer, for this trajectory, and so a stop as much later.
GUARD_STEP_MS = 70
LONGEST_GUARD_MS = 240
PROGRAM = "program "
"""The source of a stop begins so where no person pressed."""
TICKS_PER_PROGRESS = 5


@dataclass(frozen=True)
class DriverOutput:
    """The output of a tick; `stream` and `joint_states` are None where there is nothing new."""

    stream: StreamBatch | None
    joint_states: JointStates | None
    statuses: tuple[TrajectoryStatus, ...]
    safety: SafetyState


class ArmDriver:
    """Drives all joints of a robot that plays a stream of rows: HOAP-3, or a servo arm by its loop.

    Pass messages to the `on_…` methods, then call `tick`.

    Args:
        description: Of the robot.
        settings: Of the safety gate.
        clearance: For the gate; None: it does not check how near parts of the robot come to each other.
        no_program: Called whenever a program requests to arm: why none may; "" only where it is verified that the
            launch of this driver emulates the robot.
        link_timeout_s: When commands come from another host: after so long without a reply from there the link counts
            as lost, which stops the robot, and nobody arms. None: there is no other host.
        checks_in_slices: Whether trajectories are checked by `check_on`, which is to be called while nothing else is to
            be done, and begin with the tick after it; by default `tick` checks them whole, as in lockstep, where
            time stands still meanwhile.

    The driver begins with its first tick and ignores arming requests and trajectories from before it. So a restarted
    driver is disarmed; the stream's epoch is made of that tick's time. A stop has no age: whatever time its sender has
    written into it, it stops the robot. Only one that was sent again to a driver which has not been armed since it
    began may have stopped an earlier one: it is not reported as a reason, but after it only a person arms.
    """

    def __init__(
        self,
        description: RobotDescription,
        settings: SafetySettings | None = None,
        clearance: Clearance | None = None,
        no_program: Callable[[], str] = lambda: Inputs.no_program,
        link_timeout_s: float | None = None,
        checks_in_slices: bool = False,
    ) -> None:
        self._description = description
        self._checks_in_slices = checks_in_slices
        self._check: TrajectoryCheck | None = None
        self._armed_ns = 0
        self._link_timeout_s = link_timeout_s
        self._link: tuple[int | None, str] = (None, "the other host")
        self._no_program = no_program
        self._settings = settings
        self._clearance = clearance
        self._limits = description.motion_limits
        self._ahead_rows = int(np.ceil(longest_path_s(self._limits) / self._limits.dt_s))
        # Fingers that hold something are measured far from where they are commanded, and only this driver knows the
        # command. The movement from there to the trajectory is judged like the rest of it.
        self._start_tolerance = np.full(description.n_joints, np.deg2rad(description.stream.start_tolerance_deg))
        self._start_tolerance[list(description.gripper_indices)] = np.inf
        self._begin_at(0)
        self._report: RobotReport | None = None
        self._reported = False
        self._arming_requests: list[ArmingRequest] = []
        self._trajectories: list[tuple[JointTrajectory, int]] = []
        self._stop: Fault | None = None
        self._person_stops: deque[tuple[Fault, bool]] = deque()  # filled by another thread
        self._stopped_before = False
        self._arming_faults: tuple[Fault, ...] = ()
        self._checks_began_ns: int | None = None
        self._emergency: bool | None = None
        self._execution: Execution | None = None
        self._statuses: list[TrajectoryStatus] = []
        self._last_status: dict[str, TrajectoryStatus] = {}
        self._ticks = 0
        self._rejected = 0
        self._guard_ms = description.stream.guard_ms

    def _begin_at(self, start_ns: int) -> None:
        d = self._description
        self._epoch = 1 + (start_ns // 1_000_000) % (2**32 - 1)
        self._now_ns = start_ns
        self._core = SafetyCore(
            self._limits, (d.lower, d.upper), self._epoch, start_ns, self._settings, self._clearance
        )

    @property
    def state(self) -> State:
        """Of the safety gate."""
        return self._core.state

    @property
    def detail(self) -> str:
        """The state of the gate, for people."""
        if self._core.state is State.DISCONNECTED:
            return "disarmed, waiting for the robot"
        return f"safety gate: {self._core.state.value}"

    def on_robot_state(self, state: StreamState, captured_ns: int) -> None:
        """Take the robot's report on its stream and joints; one that cannot be read counts as none."""
        report = RobotReport.of(state, captured_ns, self._description, self._report)
        if report is not None:
            before, execution = self._report, self._execution
            # A first batch is sent until it is known to be played; those rejected meanwhile were not late.
            begun = before is not None and execution is not None and before.stream.next_index > execution.start_index
            if before is not None and begun and report.stream.rejected_batches > before.stream.rejected_batches:
                self._guard_ms = min(self._guard_ms + GUARD_STEP_MS, LONGEST_GUARD_MS)
            self._report = report
            self._reported = True

    def on_arm_request(self, message: ArmRequest, captured_ns: int) -> None:
        """Take the arming request of a person or, for an emulated robot, of a program."""
        self._arming_requests.append(ArmingRequest(captured_ns, message.source, message.armed, message.by_person))

    def on_stop(self, message: StopRequest, resent: bool = False) -> None:
        """Take a person's stop: the next `tick` begins a controlled stop and latches it, whatever the gate does.

        May be called from another thread than `tick`.

        Args:
            message: The request; its time does not count.
            resent: Whether it was published before the driver had subscribed (see `Received.resent`).
        """
        source = message.source or "bus"
        whose = "" if source.startswith(PROGRAM) else " by a person"
        fault = Fault(PERSON_STOP, "", f"stopped from the {source}{whose}")
        self._person_stops.append((fault, resent))

    def on_link(self, message: LinkState, captured_ns: int) -> None:
        """Take that the other hosts have answered a request that was sent at `captured_ns`."""
        self._link = captured_ns, ", ".join(message.hosts)

    def is_cut_off(self, now_ns: int) -> bool:
        """Whether the next `tick` stops the robot because the link to another host is lost."""
        return self._core.state is State.ARMED and self._fault_of_link(now_ns) is not None

    @property
    def wants_to_arm(self) -> bool:
        """Whether a request waits for the next `tick` that may arm."""
        return any(one.armed and (one.by_person or not self._why_no_program()) for one in self._arming_requests)

    @property
    def has_stop(self) -> bool:
        """Whether a person's stop waits for the next `tick`."""
        return bool(self._person_stops)

    def _why_no_program(self) -> str:
        touched = self._stopped_before or not self._core.untouched
        return self._no_program() or (TOUCHED if touched else "")

    def on_fault(self, fault: Fault) -> None:
        """Take a fault of the robot: the next `tick` begins a controlled stop and latches it."""
        self._stop = fault

    def on_arming_checks(self, faults: tuple[Fault, ...], began_ns: int | None = None) -> None:
        """Take the checks of the robot that fail now, and when they began; while one fails, nobody arms."""
        self._arming_faults, self._checks_began_ns = faults, began_ns

    def on_emergency(self, pressed: bool) -> None:
        """Take the state of the emergency stop; pressed once since the last `tick` counts as pressed."""
        self._emergency = pressed or bool(self._emergency)

    def on_trajectory(self, message: JointTrajectory, captured_ns: int) -> None:
        """Take a trajectory: `tick` accepts or rejects it by its own time.

        A trajectory whose id is known is not played again; its latest status is sent once more.
        """
        self._trajectories.append((message, captured_ns))

    def tick(self, now_ns: int) -> DriverOutput:
        """One camera period: what to send to the robot and what to publish of it."""
        if not self._ticks:
            self._begin_at(now_ns)
        stalled_s = (now_ns - self._now_ns) * 1e-9
        stalled_s = stalled_s if stalled_s > MAX_STALL_S else 0.0
        self._now_ns = now_ns
        self._ticks += 1
        self._take_checked()
        self._judge_trajectories(stalled_s)
        self._judge_stops()
        was_armed = self._core.state is State.ARMED
        requests: list[ArmingRequest | None] = [*self._arming_requests] or [None]
        self._arming_requests.clear()
        measured = self._report.measured(self._epoch) if self._report else None
        cut_off = self._fault_of_link(now_ns)
        stop = self._stop or self._fault_of_stall(stalled_s) or self._fault_of_stream(now_ns)
        if self._core.state is State.ARMED:
            stop = stop or cut_off
        arming_faults = self._arming_faults if cut_off is None else (*self._arming_faults, cut_off)
        proposal = self._proposal(now_ns)
        targets = None
        for request in requests:
            checks = arming_faults, self._emergency, self._checks_began_ns
            by_program = request is not None and request.armed and not request.by_person
            no_program = self._why_no_program() if by_program else ""
            inputs = Inputs(measured, request, proposal, stop, *checks, no_program)
            accepted, _, _ = self._core.step(now_ns, inputs)
            targets = accepted or targets
        if not was_armed:
            self._armed_ns = now_ns
        self._emergency = self._checks_began_ns = None
        if self._core.state is not State.DISCONNECTED:  # there a stop waits for data from the robot
            self._stop = None
        stream = None
        if targets is not None:
            stream = StreamBatch.of(
                self._description, self._epoch, targets.first_index, targets.rows, targets.ramp_rows
            )
        self._follow(now_ns)
        statuses, self._statuses = tuple(self._statuses), []
        joint_states = (
            self._report.joint_states(self._description.joint_names) if self._report and self._reported else None
        )
        self._reported = False
        return DriverOutput(stream, joint_states, statuses, self._safety_state(now_ns))

    def _judge_stops(self) -> None:
        """Latch stops; one that was sent again to a driver that was never armed may have stopped an earlier one."""
        for _ in range(len(self._person_stops)):
            fault, resent = self._person_stops.popleft()
            if resent and self._core.untouched:
                self._stopped_before = True
            else:
                self._stop = fault

    def _judge_trajectories(self, stalled_s: float) -> None:
        """Accept or reject what came since the last tick."""
        trajectories, self._trajectories = self._trajectories, []
        for message, captured_ns in trajectories:
            known = self._last_status.get(message.id)
            if known is not None:
                self._statuses.append(known)
                continue
            if self._check is not None and self._check.trajectory_id == message.id:
                continue
            try:
                if stalled_s:
                    allowed = f"up to {MAX_STALL_S:g} s; send it again"
                    raise TrajectoryRejectedError(
                        "stale", -1, "", f"a driver that stalled for {stalled_s:.2f} s", allowed
                    )
                self._begin_check(message, captured_ns)
            except TrajectoryRejectedError as error:
                self._reject(message.id, error)
            if not self._checks_in_slices and self._check is not None:
                self._check.go_on(float("inf"))
                self._take_checked()

    def _reject(self, trajectory_id: str, error: TrajectoryRejectedError) -> None:
        self._rejected += 1
        self._add_status(trajectory_id, TrajectoryStatus.STATE_REJECTED, 0.0, 0.0, str(error), error.code)

    def _begin_check(self, message: JointTrajectory, captured_ns: int) -> None:
        report = self._report
        if self._core.state is not State.ARMED or report is None:
            state = self._core.state.value
            raise TrajectoryRejectedError("not_armed", -1, "", f"a movement while {state}", "only while armed")
        if not message.id:
            raise TrajectoryRejectedError("id", -1, "", "an empty id", "a name for the trajectory")
        under_way = self._execution or self._check
        if under_way is not None:
            allowed = f"one at a time; {under_way.trajectory_id} is executed"
            raise TrajectoryRejectedError("busy", -1, "", "a second trajectory", allowed)
        if captured_ns < self._armed_ns:
            raise TrajectoryRejectedError("stale", -1, "", "a movement from before the arm was armed", "later ones")
        age_s = (self._now_ns - captured_ns) * 1e-9
        if not -MAX_TRAJECTORY_LEAD_S <= age_s <= MAX_TRAJECTORY_AGE_S:
            allowed = f"{-MAX_TRAJECTORY_LEAD_S:g} to {MAX_TRAJECTORY_AGE_S:g} s"
            raise TrajectoryRejectedError("stale", -1, "", f"age {age_s:.2f} s", allowed)
        next_index = report.next_index(self._epoch)
        held = self._core.held(next_index) if report.stream.epoch == self._epoch else None
        self._check = TrajectoryCheck(
            message,
            self._now_ns,
            next_index,
            report.commanded if held is None else held,
            self._limits,
            self._start_tolerance,
        )

    def check_on(self) -> bool:
        """Checks a waiting trajectory for some milliseconds; returns whether there is more to check.

        May be called from another thread than `tick`.
        """
        check = self._check
        return check is not None and check.go_on()

    def _take_checked(self) -> None:
        """Begin a trajectory whose check is over, or reject it; reject one whose check takes too long."""
        check, report = self._check, self._report
        if check is None or report is None:
            return
        try:
            self._raise_if_outdated(check, report)
            if check.error is not None:
                raise check.error
        except TrajectoryRejectedError as error:
            self._check = None
            self._reject(check.trajectory_id, error)
            return
        if check.path is None:
            return
        self._check = None
        self._guard_ms = self._description.stream.guard_ms
        path = check.path
        self._execution = Execution(check.trajectory_id, path.rows, path.dt_s, check.start_index, self._now_ns)
        self._add_status(check.trajectory_id, TrajectoryStatus.STATE_ACCEPTED, 0.0, path.duration_s, "")

    def _raise_if_outdated(self, check: TrajectoryCheck, report: RobotReport) -> None:
        """What was checked no longer fits: the arm was stopped meanwhile, or it moved, or the check takes too long."""
        if self._core.state is not State.ARMED:
            state = self._core.state.value
            raise TrajectoryRejectedError("not_armed", -1, "", f"a movement while {state}", "only while armed")
        if report.next_index(self._epoch) != check.start_index:
            raise TrajectoryRejectedError("start", -1, "", "another row of the stream", "one from where the robot is")
        check_s = (self._now_ns - check.begun_ns) * 1e-9
        if check_s > MAX_CHECK_S:
            allowed = f"up to {MAX_CHECK_S:g} s; see what keeps this computer busy"
            raise TrajectoryRejectedError("stale", -1, "", f"a check of {check_s:.1f} s", allowed)

    def _proposal(self, now_ns: int) -> Proposal | None:
        execution, report = self._execution, self._report
        if execution is None or report is None:
            return None
        stream = self._description.stream
        guard, cover = (ms * 1000 // stream.period_us for ms in (self._guard_ms, stream.cover_ms))
        rows, ahead, first_index = execution.window(report.next_index(self._epoch), guard, cover, self._ahead_rows)
        if not len(rows):
            return None
        return Proposal(now_ns, self._epoch, self._description.joint_names, first_index, rows, ahead)

    def _fault_of_stall(self, stalled_s: float) -> Fault | None:
        if not stalled_s or self._execution is None or self._core.state is not State.ARMED:
            return None
        message = (
            f"the driver itself stalled for {stalled_s:.2f} s, allowed {MAX_STALL_S:g} s, so the next rows are too "
            "old; the robot comes to rest by its stop ramp; arm again"
        )
        return Fault("driver_stalled", "", message)

    def _fault_of_link(self, now_ns: int) -> Fault | None:
        confirmed_ns, hosts = self._link
        if self._link_timeout_s is None:
            return None
        age_ms, allowed_ms = float("inf"), 1e3 * self._link_timeout_s
        if confirmed_ns is not None:
            age_ms = 1e-6 * abs(now_ns - confirmed_ns)  # one from the future has a clock of its own
        if age_ms <= allowed_ms:
            return None
        since = "" if confirmed_ns is None else f" for {age_ms:.0f} ms"
        message = f"no reply from {hosts}{since}, allowed {allowed_ms:.0f} ms: once the link is back, arm again"
        return Fault("link_lost", "", message)

    def _fault_of_stream(self, now_ns: int) -> Fault | None:
        if self._execution is None or self._report is None or self._core.state is not State.ARMED:
            return None
        return self._execution.fault(self._report, self._epoch, now_ns)

    def _follow(self, now_ns: int) -> None:
        """Report the progress of the trajectory; end it when the robot reports its end."""
        execution, report = self._execution, self._report
        if execution is None or report is None:
            return
        time_s = execution.time_s(report, self._epoch)
        name, duration_s = execution.trajectory_id, execution.duration_s
        if self._core.state is State.STOPPING:
            return
        if self._core.state is not State.ARMED:
            reason = "; ".join(fault.detail for fault in self._core.faults) or "disarmed"
            self._add_status(name, TrajectoryStatus.STATE_STOPPED, time_s, duration_s, reason)
            self._execution = None
            return
        ending = execution.ending(report, self._epoch, now_ns, self._description)
        if ending is not None:
            state = TrajectoryStatus.STATE_STOPPED if ending else TrajectoryStatus.STATE_SUCCEEDED
            self._add_status(name, state, duration_s, duration_s, ending)
            self._execution = None
        elif self._ticks % TICKS_PER_PROGRESS == 0:
            self._add_status(name, TrajectoryStatus.STATE_EXECUTING, time_s, duration_s, "")

    def _add_status(
        self,
        name: str,
        state: TrajectoryStatus.State,
        time_s: float,
        duration_s: float,
        reason: str,
        code: str = "",
    ) -> None:
        status = TrajectoryStatus(
            trajectory_id=name, state=state, time_s=time_s, duration_s=duration_s, reason=reason, code=code
        )
        status.captured.FromNanoseconds(self._now_ns)
        self._statuses.append(status)
        if state != TrajectoryStatus.STATE_REJECTED:  # a rejected one that is sent again is judged again
            self._last_status[name] = status
            while len(self._last_status) > 100:
                del self._last_status[next(iter(self._last_status))]

    def _safety_state(self, now_ns: int) -> SafetyState:
        message = SafetyState(state=SAFETY_STATES[self._core.state], rejected_trajectories=self._rejected)
        message.captured.FromNanoseconds(now_ns)
        message.faults.extend(
            SafetyFault(code=fault.code, joint=fault.joint, detail=fault.detail) for fault in self._core.faults
        )
        return message
