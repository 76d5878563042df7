"""From goals to trajectories: plays one goal after the other with the learned movement and says how it fares."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass

import numpy as np
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from numpy.typing import NDArray

from paramove.imitation.arm_pose import UnreachablePoseError
from paramove.imitation.clear_plans import ClearPlans, NoClearPlanError
from paramove.imitation.motion import PlannedMotion
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory, TrajectoryPhase, TrajectoryPoint, TrajectoryStatus
from paramove.msgs.relocation_pb2 import Position, RelocationGoal, RelocationStatus

FloatArray = NDArray[np.float64]

FRAME = "right_shoulder"
FELT_OPENING = 0.12  # a closed hand whose fingers stop at a wider opening than this holds something
RESEND_NS = 400_000_000
REMEMBERED_GOALS = 200

_ENDED = {TrajectoryStatus.STATE_SUCCEEDED, TrajectoryStatus.STATE_STOPPED, TrajectoryStatus.STATE_REFUSED}


class GoalRefusedError(ValueError):
    """A goal cannot be done; the message says why and what would work."""


@dataclass(frozen=True)
class SynthesizerSays:
    """What one tick gives."""

    trajectories: tuple[JointTrajectory, ...]
    statuses: tuple[RelocationStatus, ...]


@dataclass(frozen=True)
class _Outcome:
    done: bool
    reason: str = ""


_Course = Generator[PlannedMotion, None, _Outcome]


@dataclass
class _Running:
    """The goal being done: its course, the motion under way and what is known of it."""

    goal: RelocationGoal
    course: _Course
    motion: PlannedMotion | None = None
    message: JointTrajectory | None = None
    acknowledged: bool = False
    sent_ns: int = 0
    time_s: float = 0.0
    phase: str = ""
    motions: int = 0
    elbow_turn: float = 0.0


@dataclass
class _Hand:
    """What the robot knows of its arm between goals: None where an unplanned stop left it."""

    at_base: bool = True
    gripper: FloatArray | None = None  # where it waits, if not at the base pose
    opening: float = 1.0  # ξ that the last motion ended with
    measured: float = 1.0  # ξ of the measured fingers
    lost: bool = False
    known: bool = True


class Synthesizer:
    """Does one goal at a time. Hear messages with the `on_…` methods, then call `tick` once per turn.

    Args:
        plans: Builds motions from the converted movement that keep clear of table, body and standing objects.
    """

    def __init__(self, plans: ClearPlans) -> None:
        self._plans = plans
        self._arm = plans.planner.arm
        self._hand = _Hand()
        self._running: _Running | None = None
        self._newest: dict[str, RelocationStatus] = {}
        self._statuses: list[RelocationStatus] = []
        self._trajectories: list[JointTrajectory] = []
        self._now_ns = 0
        self._courses: dict[int, Callable[[RelocationGoal], _Course]] = {
            RelocationGoal.KIND_RELOCATE: self._relocate,
            RelocationGoal.KIND_OFFER_HAND: self._offer_hand,
            RelocationGoal.KIND_TAKE: self._take,
            RelocationGoal.KIND_RELEASE: self._release,
            RelocationGoal.KIND_PLACE_HELD: self._place_held,
            RelocationGoal.KIND_REST: self._rest,
        }

    @property
    def holding(self) -> bool:
        """Whether the hand is commanded to be closed and its fingers feel something."""
        return self._commanded_opening() < FELT_OPENING < self._hand.measured

    def on_goal(self, goal: RelocationGoal) -> None:
        """Accept or refuse a goal. The same id again is answered with its newest status and not done twice."""
        known = self._newest.get(goal.id)
        if known is not None:
            self._statuses.append(known)
            return
        try:
            self._begin(goal)
        except (GoalRefusedError, NoClearPlanError, UnreachablePoseError) as refusal:
            self._say(goal.id, RelocationStatus.STATE_REFUSED, reason=str(refusal))

    def on_joint_states(self, message: JointStates) -> None:
        """Hear the measured joints: the fingers tell whether something is held."""
        for joint in message.joints:
            if joint.name == self._arm.fingers:
                self._hand.measured = self._opening(joint.position)
        running = self._running
        if running is not None and running.motion is not None and self._should_hold(running.motion, running.time_s):
            self._hand.lost |= self._hand.measured <= FELT_OPENING

    def on_trajectory_status(self, status: TrajectoryStatus) -> None:
        """Hear how the driver fares with the motion under way."""
        running = self._running
        if running is None or running.message is None or status.trajectory_id != running.message.id:
            return
        running.acknowledged = True
        running.time_s = status.time_s
        if status.state == TrajectoryStatus.STATE_SUCCEEDED:
            self._next_motion(running)
        elif status.state in _ENDED:
            self._hand.known = status.state == TrajectoryStatus.STATE_REFUSED
            self._end(running, _Outcome(False, f"the arm driver ended the motion: {status.reason}"))
        else:
            self._say_phase(running)

    def tick(self, now_ns: int) -> SynthesizerSays:
        """Once per turn: what is to be said."""
        self._now_ns = now_ns
        running = self._running
        unheard = running is not None and not running.acknowledged and now_ns - running.sent_ns >= RESEND_NS
        if running is not None and running.message is not None and unheard:
            running.message.captured.FromNanoseconds(now_ns)
            self._trajectories.append(running.message)
            running.sent_ns = now_ns
        says = SynthesizerSays(tuple(self._trajectories), tuple(self._statuses))
        self._trajectories, self._statuses = [], []
        return says

    # The courses of the goals. Each yields a motion, is resumed when it has been executed, and returns the outcome.

    def _relocate(self, goal: RelocationGoal) -> _Course:
        source, target, standing = _point(goal, "from"), _point(goal, "to"), _standing(goal)
        if not self._hand.at_base:
            raise GoalRefusedError("the arm is not at its base pose; send a goal of kind REST first")
        fetch = self._plans.fetch(source, standing)
        lifted = fetch.gripper[-1]
        deliver = self._plans.deliver(lifted, target, standing)  # known to be possible before the arm moves
        yield fetch
        if not self.holding:
            yield self._plans.leave(lifted, self._hand.opening, standing)
            return _Outcome(False, f"felt nothing in the hand at {_cm(source)} cm")
        yield deliver
        return self._placed(target)

    def _offer_hand(self, goal: RelocationGoal) -> _Course:
        yield self._plans.offer(_point(goal, "from"), _standing(goal))
        return _Outcome(True)

    def _take(self, goal: RelocationGoal) -> _Course:
        here, options = self._waits_at(), self._plans.planner.options
        yield self._plans.fingers(here, self._hand.opening, options.closed_opening, _standing(goal))
        if self.holding:
            return _Outcome(True)
        yield self._plans.fingers(here, self._hand.opening, options.offer_opening, _standing(goal))
        return _Outcome(False, "closed the hand and felt nothing")

    def _release(self, goal: RelocationGoal) -> _Course:
        opening = self._plans.planner.options.offer_opening
        yield self._plans.fingers(self._waits_at(), self._hand.opening, opening, _standing(goal))
        return _Outcome(True)

    def _place_held(self, goal: RelocationGoal) -> _Course:
        target = _point(goal, "to")
        if not self.holding:
            raise GoalRefusedError("nothing is held; take an object first")
        yield self._plans.deliver(self._waits_at(), target, _standing(goal))
        return self._placed(target)

    def _rest(self, goal: RelocationGoal) -> _Course:
        if not self._hand.at_base:
            yield self._plans.leave(self._waits_at(), self._hand.opening, _standing(goal))
        return _Outcome(True)

    def _placed(self, target: FloatArray) -> _Outcome:
        if self._hand.lost:
            return _Outcome(False, f"the object slipped out of the hand on the way to {_cm(target)} cm")
        return _Outcome(True)

    def _begin(self, goal: RelocationGoal) -> None:
        if self._running is not None:
            raise GoalRefusedError(f"busy with goal {self._running.goal.id}; one goal at a time")
        if not self._hand.known:
            raise GoalRefusedError("the arm was stopped at an unplanned place; a person must bring it to its base pose")
        if goal.frame != FRAME:
            raise GoalRefusedError(f"positions in frame {goal.frame!r}; this arm's goals are in {FRAME!r}")
        course = self._courses.get(goal.kind)
        if course is None:
            kinds = [name.removeprefix("KIND_") for name in RelocationGoal.Kind.keys()[1:]]
            raise GoalRefusedError(f"kind {goal.kind} is none of {', '.join(kinds)}")
        running = _Running(goal, course(goal))
        first = self._advance(running)
        self._running = running
        self._hand.lost = False
        self._say(goal.id, RelocationStatus.STATE_ACCEPTED)
        self._start_or_end(running, first)

    def _advance(self, running: _Running) -> PlannedMotion | _Outcome:
        try:
            return next(running.course)
        except StopIteration as end:
            outcome: _Outcome = end.value
            return outcome

    def _next_motion(self, running: _Running) -> None:
        motion = running.motion
        assert motion is not None
        base = motion.phases[-1][0] == "retreat"
        self._hand.at_base = base
        self._hand.gripper = None if base else motion.gripper[-1]
        self._hand.opening = self._opening(float(motion.angles[-1, 5]))
        try:
            self._start_or_end(running, self._advance(running))
        except (GoalRefusedError, NoClearPlanError, UnreachablePoseError) as error:
            self._end(running, _Outcome(False, str(error)))

    def _start_or_end(self, running: _Running, step: PlannedMotion | _Outcome) -> None:
        if isinstance(step, _Outcome):
            self._end(running, step)
            return
        running.motions += 1
        running.motion, running.acknowledged, running.time_s = step, False, 0.0
        running.elbow_turn = max(running.elbow_turn, step.elbow_turn)
        running.message = self._trajectory(f"{running.goal.id}/{running.motions}", step)
        running.sent_ns = self._now_ns
        self._trajectories.append(running.message)

    def _end(self, running: _Running, outcome: _Outcome) -> None:
        running.course.close()
        self._running = None
        state = RelocationStatus.STATE_SUCCEEDED if outcome.done else RelocationStatus.STATE_FAILED
        self._say(running.goal.id, state, running.phase, outcome.reason, running.elbow_turn)

    def _trajectory(self, name: str, motion: PlannedMotion) -> JointTrajectory:
        message = JointTrajectory(id=name, joints=[*self._arm.joints, self._arm.fingers])
        message.captured.FromNanoseconds(self._now_ns)
        message.points.extend(
            TrajectoryPoint(time_s=t, position_rad=q) for t, q in zip(motion.times, motion.angles, strict=True)
        )
        message.phases.extend(TrajectoryPhase(name=name, start_s=start) for name, start in motion.phases)
        return message

    def _say_phase(self, running: _Running) -> None:
        assert running.motion is not None
        phase = [name for name, start in running.motion.phases if start <= running.time_s][-1]
        if phase != running.phase:
            running.phase = phase
            self._say(running.goal.id, RelocationStatus.STATE_EXECUTING, phase, "", running.elbow_turn)

    def _say(
        self, goal_id: str, state: RelocationStatus.State, phase: str = "", reason: str = "", elbow_turn: float = 0.0
    ) -> None:
        status = RelocationStatus(
            goal_id=goal_id, state=state, phase=phase, reason=reason, holding=self.holding, elbow_turn_rad=elbow_turn
        )
        status.captured.FromNanoseconds(self._now_ns)
        self._statuses.append(status)
        self._newest[goal_id] = status
        while len(self._newest) > REMEMBERED_GOALS:
            del self._newest[next(iter(self._newest))]

    def _should_hold(self, motion: PlannedMotion, time_s: float) -> bool:
        """Whether the motion holds an object from half a second before to half a second after `time_s`."""
        around = np.searchsorted(motion.times, [time_s - 0.5, time_s + 0.5])
        return bool(motion.holding[around[0] : max(around[1], around[0] + 1)].all()) and around[0] > 0

    def _commanded_opening(self) -> float:
        running = self._running
        if running is None or running.motion is None:
            return self._hand.opening
        sample = min(int(np.searchsorted(running.motion.times, running.time_s)), len(running.motion.times) - 1)
        return self._opening(float(running.motion.angles[sample, 5]))

    def _opening(self, fingers: float) -> float:
        """ξ of an angle of the fingers."""
        span = self._arm.fingers_open - self._arm.fingers_closed
        return float(np.clip((fingers - self._arm.fingers_closed) / span, 0.0, 1.0))

    def _waits_at(self) -> FloatArray:
        if self._hand.gripper is None:
            raise GoalRefusedError("the arm is at its base pose; offer the hand first")
        return self._hand.gripper


def _point(goal: RelocationGoal, name: str) -> FloatArray:
    if not goal.HasField(name):
        raise GoalRefusedError(f"the goal lacks its position {name!r}")
    position: Position = getattr(goal, name)
    point = np.array([position.x, position.y, position.z])
    if not np.isfinite(point).all():
        raise GoalRefusedError(f"position {name!r} is {point.tolist()}; finite numbers in m are needed")
    return point


def _standing(goal: RelocationGoal) -> FloatArray:
    """Places of the objects to keep clear of, [M, 2]."""
    return np.array([[place.x, place.y] for place in goal.avoid]).reshape(-1, 2)


def _cm(point: FloatArray) -> str:
    return f"({point[0] * 100:.1f}, {point[1] * 100:.1f})"
