"""From goals to trajectories: executes one goal after the other with the learned movement and reports its progress."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates

from paramove.documents import Floats
from paramove.motion.arm_pose import UnreachablePoseError
from paramove.motion.arm_state import ArmState
from paramove.motion.plans import (
    FARTHEST_M,
    Grasp,
    MisfitError,
    MotionPlans,
    NoPlanError,
    PlannedMotion,
    RestPose,
    centimetres,
)
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory, TrajectoryPhase, TrajectoryPoint, TrajectoryStatus
from paramove.msgs.relocation_pb2 import Position, RelocationGoal, RelocationStatus
from paramove.robots import OutOfReachError

LARGEST = 1e6
RESEND_NS = 400_000_000
REMEMBERED_GOALS = 200
STALE_TRIES = 3
STATUS_TIMEOUT_NS = 10_000_000_000
RESTARTED = "the synthesizer was restarted; its motion ran to its end; send a new goal"

_STOPPED = {TrajectoryStatus.STATE_STOPPED: "stopped", TrajectoryStatus.STATE_REJECTED: "rejected"}


@dataclass(frozen=True)
class SynthesizerOutput:
    """The output of one tick."""

    trajectories: tuple[JointTrajectory, ...]
    statuses: tuple[RelocationStatus, ...]


_Course = Generator[PlannedMotion, None, str]
"""Yields a motion, is resumed when it has been executed, and returns why the goal has failed; empty if it succeeded."""


@dataclass
class _Running:
    """The goal being executed: its course, the current motion and its state."""

    goal: RelocationGoal
    course: _Course
    motion: PlannedMotion | None = None
    message: JointTrajectory | None = None
    acknowledged: bool = False
    sent_ns: int = 0
    received_ns: int | None = None  # of a status, or of the first tick after the motion was planned: that may take long
    time_s: float = 0.0
    phase: str = ""
    motions: int = 0
    stale: int = 0
    elbow_turn: float = 0.0


class Synthesizer:
    """Executes one goal at a time. Pass messages to the `on_…` methods, then call `tick` once per iteration.

    Args:
        plans: Builds motions by the learned movement that keep clear of table, body and standing objects.
    """

    def __init__(self, plans: MotionPlans) -> None:
        self._plans = plans
        self._arm = plans.arm
        self._hand = ArmState(self._arm)
        self._running: _Running | None = None
        self._waiting: RelocationGoal | None = None
        self._hulls: dict[str, tuple[RelocationStatus.Hull, RelocationStatus.Hull]] = {}
        self._latest: dict[str, RelocationStatus] = {}
        self._statuses: list[RelocationStatus] = []
        self._trajectories: list[JointTrajectory] = []
        self._now_ns = 0
        self._courses: dict[int, Callable[[RelocationGoal], _Course]] = {
            RelocationGoal.KIND_RELOCATE: partial(self._fetch, then=self._plans.deliver),
            RelocationGoal.KIND_FETCH: partial(self._fetch, then=self._plans.hold),
            RelocationGoal.KIND_OFFER_HAND: self._offer_hand,
            RelocationGoal.KIND_TAKE: self._take,
            RelocationGoal.KIND_RELEASE: self._release,
            RelocationGoal.KIND_PLACE_HELD: self._place_held,
            RelocationGoal.KIND_REST: self._rest,
        }

    @property
    def holding(self) -> bool:
        """Whether the hand is commanded to be closed and its fingers feel something."""
        return self._commanded_opening() < self._arm.felt_opening < self._hand.measured

    @property
    def detail(self) -> str:
        """A description of its state, for people."""
        if self._running is not None:
            return f"goal {self._running.goal.id}: {self._running.phase or 'begins'}"
        if self._waiting is not None:
            return f"goal {self._waiting.id} waits until the arm rests: its pose is not known yet"
        return "waiting for a goal"

    def on_goal(self, goal: RelocationGoal) -> None:
        """Accepts or rejects a goal. The same id again is answered with its latest status and not executed twice.

        While the pose of the arm is unknown (see `ArmState`), the latest goal waits until the arm rests.
        """
        known = self._latest.get(goal.id)
        if known is not None:
            self._statuses.append(known)
        elif goal.asked_again:
            self._report(goal.id, RelocationStatus.STATE_FAILED, reason=RESTARTED)
        elif self._running is None and not goal.plan_only and not self._hand.estimate_pose(self._now_ns):
            self._waiting = goal
            self._reject_for_another_arm()
        else:
            self._begin_or_reject(goal)

    def on_joint_states(self, message: JointStates) -> None:
        """Updates with the measured joints: the arm's pose, and from the fingers whether an object is held."""
        if not self._hand.handle(message, self._now_ns):
            self._reject_for_another_arm()
            return
        running = self._running
        if running is not None and running.motion is not None and self._should_hold(running.motion, running.time_s):
            self._hand.lost |= self._hand.measured <= self._arm.felt_opening

    def on_trajectory_status(self, status: TrajectoryStatus) -> None:
        """Updates with the driver's progress in the current motion."""
        running = self._running
        if running is None or running.message is None or status.trajectory_id != running.message.id:
            self._on_status_of_others(status)
            return
        if status.state == TrajectoryStatus.STATE_REJECTED and status.code == "stale" and running.stale < STALE_TRIES:
            running.stale += 1  # planning took longer than the driver waits: it is sent again with the current time
            running.acknowledged, running.sent_ns = False, self._now_ns - RESEND_NS
            return
        if not math.isfinite(status.time_s):
            return
        running.acknowledged, running.received_ns = True, self._now_ns
        running.time_s = status.time_s
        if status.state == TrajectoryStatus.STATE_SUCCEEDED:
            self._next_motion(running)
        elif status.state in _STOPPED:
            reason = status.reason or "it gives no reason"
            self._stopped(running, f"the arm's driver {_STOPPED[status.state]} the motion: {reason}")
        else:
            self._report_phase(running)

    def tick(self, now_ns: int) -> SynthesizerOutput:
        """One iteration: returns the messages to publish."""
        self._now_ns = now_ns
        if self._waiting is not None and self._running is None and self._hand.estimate_pose(now_ns):
            waiting, self._waiting = self._waiting, None
            self._begin_or_reject(waiting)
        running = self._running
        if running is not None:
            self._await_status(running)
        output = SynthesizerOutput(tuple(self._trajectories), tuple(self._statuses))
        self._trajectories, self._statuses = [], []
        return output

    def _await_status(self, running: _Running) -> None:
        """Send the motion again until the driver acknowledges it, and give up a driver that reports nothing."""
        running.received_ns = self._now_ns if running.received_ns is None else running.received_ns
        if self._now_ns - running.received_ns > STATUS_TIMEOUT_NS:
            timeout_s = round(1e-9 * STATUS_TIMEOUT_NS)
            self._stopped(running, f"no status of the motion from the arm's driver for {timeout_s} s")
        elif running.message is not None and not running.acknowledged and self._now_ns - running.sent_ns >= RESEND_NS:
            running.message.captured.FromNanoseconds(self._now_ns)
            self._trajectories.append(running.message)
            running.sent_ns = self._now_ns

    def _reject_for_another_arm(self) -> None:
        """A goal that waits for the arm's pose will never get it from the joints of another arm."""
        if self._waiting is not None and self._hand.missing:
            missing, waiting, self._waiting = ", ".join(self._hand.missing), self._waiting, None
            reason = f"the arm has no joint {missing}: give the synthesizer the same `robot` as the arm's driver"
            self._report(waiting.id, RelocationStatus.STATE_REJECTED, reason=reason)

    def _on_status_of_others(self, status: TrajectoryStatus) -> None:
        """A motion that an earlier process began, or one that was abandoned here, moves the arm."""
        if status.state in (TrajectoryStatus.STATE_ACCEPTED, TrajectoryStatus.STATE_EXECUTING):
            self._hand.moved_by_others(self._now_ns)
            if self._running is None:
                self._hand.forget()

    # The courses of the goals

    def _fetch(self, goal: RelocationGoal, then: Callable[[RestPose, Floats, Floats], PlannedMotion]) -> _Course:
        source, target, standing = point_of(goal, "from"), point_of(goal, "to"), standing_of(goal)
        known = target if goal.kind == RelocationGoal.KIND_RELOCATE else None
        width, height, length = (size_of(goal, name) for name in ("width", "height", "length"))
        grasp = Grasp(known, goal.attempt, width, height, turn_of(goal), length)
        fetch = self._plans.fetch(source, standing, self._start_of(goal), grasp)
        onwards = then(fetch.end, target, standing)  # known to be possible before the arm moves
        yield fetch
        if not self.holding:
            felt = self._hand.felt
            yield self._plans.leave(fetch.end, self._hand.opening, standing)
            return f"felt nothing in the hand at {centimetres(source[:2])}: {felt}"
        yield onwards
        return self._placed(target)

    def _offer_hand(self, goal: RelocationGoal) -> _Course:
        yield self._plans.reach(point_of(goal, "from"), standing_of(goal), self._start_of(goal))
        return ""

    def _take(self, goal: RelocationGoal) -> _Course:
        here, plans = self._waits_at(), self._plans
        yield plans.fingers(here, self._hand.opening, plans.closed_opening, standing_of(goal))
        if self.holding:
            return ""
        felt = self._hand.felt
        yield plans.fingers(here, self._hand.opening, plans.offer_opening, standing_of(goal))
        return f"closed the hand and felt nothing: {felt}"

    def _release(self, goal: RelocationGoal) -> _Course:
        opening = self._plans.offer_opening
        yield self._plans.fingers(self._waits_at(), self._hand.opening, opening, standing_of(goal))
        return ""

    def _place_held(self, goal: RelocationGoal) -> _Course:
        target = point_of(goal, "to")
        if not self.holding:
            raise GoalRejectedError("nothing is held; take an object first")
        yield self._plans.deliver(self._waits_at(), target, standing_of(goal))
        return self._placed(target)

    def _rest(self, goal: RelocationGoal) -> _Course:
        if self._hand.pose is not None:
            yield self._plans.home(self._hand.pose, self._hand.opening, self.holding, standing_of(goal))
        return ""

    def _placed(self, target: Floats) -> str:
        if self._hand.lost:
            return f"the object slipped out of the hand on the way to {centimetres(target[:2])}"
        return ""

    def _begin_or_reject(self, goal: RelocationGoal) -> None:
        if self._running is None:
            self._hulls = {goal.id: (hull_of(goal, "from", self._plans), hull_of(goal, "to", self._plans))}
        try:
            self._begin(goal)
        except _NO_PLAN as error:
            self._report(goal.id, RelocationStatus.STATE_REJECTED, reason=str(error))
            if isinstance(error, NoPlanError):
                self._latest[goal.id].in_the_way.extend(sorted(error.in_the_way))
                self._latest[goal.id].misfit = isinstance(error, MisfitError)

    def _begin(self, goal: RelocationGoal) -> None:
        if not goal.id:
            raise GoalRejectedError("a goal without an id; give each goal its own id")
        if self._running is not None:
            raise GoalRejectedError(f"busy with goal {self._running.goal.id}; one goal at a time")
        if goal.frame != self._arm.frame:
            raise GoalRejectedError(f"positions in frame {goal.frame!r}; this arm's goals are in {self._arm.frame!r}")
        course = self._courses.get(goal.kind)
        if course is None:
            kinds = [name.removeprefix("KIND_") for name in RelocationGoal.Kind.keys()[1:]]
            raise GoalRejectedError(f"kind {goal.kind} is none of {', '.join(kinds)}")
        running = _Running(goal, course(goal))
        first = self._advance(running)
        if goal.plan_only:
            running.course.close()
            self._report(goal.id, RelocationStatus.STATE_SUCCEEDED, reason="planned from the base pose, not executed")
            return
        self._running = running
        self._hand.lost = False
        self._report(goal.id, RelocationStatus.STATE_ACCEPTED)
        self._start_or_end(running, first)

    def _advance(self, running: _Running) -> PlannedMotion | str:
        """The next motion of its course, or how that has ended."""
        try:
            return next(running.course)
        except StopIteration as end:
            return str(end.value)

    def _next_motion(self, running: _Running) -> None:
        assert running.motion is not None
        self._hand.ended(running.motion)
        try:
            self._start_or_end(running, self._advance(running))
        except _NO_PLAN as error:
            self._end(running, str(error))

    def _start_or_end(self, running: _Running, step: PlannedMotion | str) -> None:
        if isinstance(step, str):
            self._end(running, step)
            return
        running.motions += 1
        running.motion, running.acknowledged, running.time_s, running.stale = step, False, 0.0, 0
        running.elbow_turn = max(running.elbow_turn, step.elbow_turn)
        name = f"{running.goal.id}/{running.motions}"
        running.message = motion_message(name, self._arm.joints, step, self._now_ns)
        running.sent_ns, running.received_ns = self._now_ns, None
        self._trajectories.append(running.message)

    def _stopped(self, running: _Running, reason: str) -> None:
        """The motion ended at an unknown pose."""
        self._hand.forget()
        self._end(running, reason)

    def _end(self, running: _Running, failure: str) -> None:
        running.course.close()
        self._running = None
        state = RelocationStatus.STATE_FAILED if failure else RelocationStatus.STATE_SUCCEEDED
        self._report(running.goal.id, state, running.phase, failure, running.elbow_turn)

    def _report_phase(self, running: _Running) -> None:
        assert running.motion is not None
        phase = [name for name, start in running.motion.phases if start <= running.time_s][-1]
        if phase != running.phase:
            running.phase = phase
            self._report(running.goal.id, RelocationStatus.STATE_EXECUTING, phase, "", running.elbow_turn)

    def _report(
        self, goal_id: str, state: RelocationStatus.State, phase: str = "", reason: str = "", elbow_turn: float = 0.0
    ) -> None:
        status = RelocationStatus(
            goal_id=goal_id, state=state, phase=phase, reason=reason, holding=self.holding, elbow_turn_rad=elbow_turn
        )
        status.captured.FromNanoseconds(self._now_ns)
        if goal_id in self._hulls:
            status.from_hull, status.to_hull = self._hulls[goal_id]
        self._statuses.append(status)
        self._latest[goal_id] = status
        while len(self._latest) > REMEMBERED_GOALS:
            del self._latest[next(iter(self._latest))]

    def _should_hold(self, motion: PlannedMotion, time_s: float) -> bool:
        """Whether the motion holds an object from half a second before to half a second after `time_s`."""
        around = np.searchsorted(motion.times, [time_s - 0.5, time_s + 0.5])
        return bool(motion.holding[around[0] : max(around[1], around[0] + 1)].all()) and around[0] > 0

    def _commanded_opening(self) -> float:
        running = self._running
        if running is None or running.motion is None:
            return self._hand.opening
        sample = min(int(np.searchsorted(running.motion.times, running.time_s)), len(running.motion.times) - 1)
        return self._arm.opening_of(float(running.motion.angles[sample, -1]))

    def _start_of(self, goal: RelocationGoal) -> RestPose | None:
        """Where a motion begins; of a goal that is only planned, at the base pose."""
        return None if goal.plan_only else self._hand.pose

    def _waits_at(self) -> RestPose:
        if self._hand.pose is None:
            raise GoalRejectedError("the arm is at its base pose; offer the hand first")
        return self._hand.pose


class GoalRejectedError(ValueError):
    """A goal cannot be executed; the message gives the reason and the remedy."""


_NO_PLAN = (GoalRejectedError, NoPlanError, UnreachablePoseError, OutOfReachError)


def point_of(goal: RelocationGoal, name: str) -> Floats:
    """Position `name` ("from" or "to") of a goal, [3], m; raises GoalRejectedError if it lacks or is not finite."""
    if not goal.HasField(name):
        raise GoalRejectedError(f"the goal lacks its position {name!r}")
    position: Position = getattr(goal, name)
    point = np.array([position.x, position.y, position.z])
    if not np.isfinite(point).all():
        raise GoalRejectedError(f"position {name!r} is {point.tolist()}; finite numbers in m are needed")
    if np.abs(point).max() > FARTHEST_M:
        raise GoalRejectedError(
            f"position {name!r} is {point.tolist()} m; an arm reaches no farther than {FARTHEST_M:g} m"
        )
    return point


def hull_of(goal: RelocationGoal, name: str, plans: MotionPlans) -> RelocationStatus.Hull:
    """Whether position `name` of a goal lies within the training of the movement; unspecified where it lacks."""
    try:
        within = plans.within_training(point_of(goal, name))
    except (ArithmeticError, ValueError):  # `point_of` rejects the goal elsewhere; LinAlgError is a ValueError
        return RelocationStatus.HULL_UNSPECIFIED
    if within is None:
        return RelocationStatus.HULL_UNSPECIFIED
    return RelocationStatus.HULL_INSIDE if within else RelocationStatus.HULL_OUTSIDE


def size_of(goal: RelocationGoal, name: str) -> float | None:
    """Its object's "width" or "height", m; None if the goal has none; raises GoalRejectedError if it is none."""
    size: float = getattr(goal, f"object_{name}_m")
    if not 0.0 <= size <= FARTHEST_M:  # NaN is not either
        raise GoalRejectedError(f"object_{name}_m is {size}; 0 (not known) to {FARTHEST_M:g} m expected")
    return size or None


def turn_of(goal: RelocationGoal) -> float | None:
    """How a square foot is turned, rad; None for a round one; raises GoalRejectedError if it is no angle."""
    if not goal.HasField("object_turn_rad"):
        return None
    if not abs(goal.object_turn_rad) <= 2 * math.pi:  # NaN is not either
        raise GoalRejectedError(f"object_turn_rad is {goal.object_turn_rad}; an angle in rad expected")
    return goal.object_turn_rad


def standing_of(goal: RelocationGoal) -> Floats:
    """Positions of the objects to keep clear of, [M, 2], m; raises GoalRejectedError if one is not finite."""
    positions = np.array([[one.x, one.y, one.z] for one in goal.avoid]).reshape(-1, 3)
    if not np.isfinite(positions).all() or np.abs(positions).max(initial=0.0) > LARGEST:
        raise GoalRejectedError(f"the positions to avoid are {positions.tolist()}; finite numbers in m are needed")
    return positions[:, :2]


def motion_message(name: str, joints: Sequence[str], motion: PlannedMotion, now_ns: int) -> JointTrajectory:
    """The trajectory called `name` of these joints, in the order of the motion's angles."""
    message = JointTrajectory(id=name, joints=joints)
    message.captured.FromNanoseconds(now_ns)
    message.points.extend(
        TrajectoryPoint(time_s=t, position_rad=q) for t, q in zip(motion.times, motion.angles, strict=True)
    )
    message.phases.extend(TrajectoryPhase(name=name, start_s=start) for name, start in motion.phases)
    return message
