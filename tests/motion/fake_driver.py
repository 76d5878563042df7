"""Plays trajectories as the arm driver does: acknowledges, follows, ends; and feels what is in the hand."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, ClassVar

import numpy as np
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates

from paramove.bus import topics
from paramove.bus.subscriber import Received
from paramove.bus.ticks import Tick
from paramove.motion.clear_plans import ClearPlans
from paramove.motion.gripper_arm import GripperArm
from paramove.motion.plans import PlannedMotion
from paramove.motion.synthesizer import Synthesizer
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory, TrajectoryStatus
from paramove.msgs.relocation_pb2 import Position, RelocationGoal, RelocationStatus
from tests.motion.reaching import ARM, GRASP_Z, HOAP3, JOINTS, OPENINGS, checker, planner

PERIOD_NS = 66_666_667
HELD_OPENING = 0.43  # at which the fingers stop on an object
SUCCEEDED, FAILED, REJECTED = (
    RelocationStatus.STATE_SUCCEEDED,
    RelocationStatus.STATE_FAILED,
    RelocationStatus.STATE_REJECTED,
)
PLACE = (0.177, -0.02)
OFFER = (0.155, -0.02, -0.05)


def goal(
    kind: RelocationGoal.Kind, name: str = "g", **places: tuple[float, ...] | list[tuple[float, float]]
) -> RelocationGoal:
    """A goal; `source`, `target` and `avoid` are places (x, y) or (x, y, z) in the shoulder's frame, m."""
    made = RelocationGoal(id=name, kind=kind, frame="right_shoulder", attempt=1)
    if "source" in places:
        getattr(made, "from").CopyFrom(position(places["source"]))
    if "target" in places:
        made.to.CopyFrom(position(places["target"]))
    made.avoid.extend(position(place) for place in places.get("avoid", ()))
    return made


def position(place) -> Position:
    x, y, *z = place
    return Position(x=x, y=y, z=z[0] if z else GRASP_Z)


def relocate(name: str = "g", **more) -> RelocationGoal:
    return goal(RelocationGoal.KIND_RELOCATE, name, **{"source": PLACE, "target": OPENINGS[1], **more})


class RememberedPlans(ClearPlans):
    """Plans each motion once a session."""

    _known: ClassVar[dict[tuple[bytes | str, ...], PlannedMotion]] = {}

    def _first(self, ways: Sequence[Callable[[], PlannedMotion]], standing: np.ndarray, choices=None) -> PlannedMotion:
        key = (*(f"{way.func.__name__} {way.args} {way.keywords}" for way in ways), np.asarray(standing).tobytes())
        if key not in self._known:
            self._known[key] = super()._first(ways, standing, choices)
        return self._known[key]


class FakeDriver:
    """The arm driver and the robot behind it.

    Attributes:
        graspable: Whether an object is there when the hand closes.
        slips_at: Phase in which the object is lost, "" for never.
        refuses: Which motion (from 1) of each goal is refused; 0 for none.
        stops: Which motion (from 1) is stopped underway; 0 for none.
        stops_at: Share of that motion after which it is stopped.
        stale: How many trajectories are refused because they come too late.
        deaf: How many trajectories are not heard.
        angles: Commanded angles of arm and fingers, [6], rad.
    """

    def __init__(
        self,
        graspable: bool = True,
        slips_at: str = "",
        refuses: int = 0,
        stops: int = 0,
        deaf: int = 0,
        stops_at: float = 0.5,
        stale: int = 0,
    ) -> None:
        self.stops_at, self.stale = stops_at, stale
        self.graspable, self.slips_at, self.refuses, self.stops, self.deaf = graspable, slips_at, refuses, stops, deaf
        self.angles = HOAP3.base_pose[JOINTS].copy()
        self.heard: list[JointTrajectory] = []
        self.playing: JointTrajectory | None = None
        self.time_s = 0.0
        self.held = False

    @property
    def opening(self) -> float:
        """Commanded ξ."""
        return float((self.angles[5] - ARM.fingers_closed) / (ARM.fingers_open - ARM.fingers_closed))

    @property
    def at_base(self) -> bool:
        return bool(np.abs(self.angles - HOAP3.base_pose[JOINTS]).max() < np.deg2rad(2.0))

    def handle(self, trajectory: JointTrajectory) -> Iterator[TrajectoryStatus]:
        trajectory = JointTrajectory.FromString(trajectory.SerializeToString())
        self.heard.append(trajectory)
        if self.deaf:
            self.deaf -= 1
            return
        if self.playing is not None:
            yield self._status(TrajectoryStatus.STATE_EXECUTING)
            return
        self.playing, self.time_s = trajectory, 0.0
        assert np.abs(np.array(trajectory.points[0].position_rad) - self.angles)[:5].max() < np.deg2rad(2.0), (
            "starts elsewhere"
        )
        if self.stale:
            self.stale -= 1
            yield self._status(TrajectoryStatus.STATE_REJECTED, "age 1.5 s, allowed up to 1 s", "stale")
            self.playing = None
        elif self._number == self.refuses:
            yield self._status(TrajectoryStatus.STATE_REJECTED, "not armed")
            self.playing = None
        else:
            yield self._status(TrajectoryStatus.STATE_ACCEPTED)

    def step(self) -> Iterator[TrajectoryStatus]:
        """One tick of playing."""
        if self.playing is None:
            return
        self.time_s = min(self.time_s + PERIOD_NS * 1e-9, self.playing.points[-1].time_s)
        times = [point.time_s for point in self.playing.points]
        self.angles = np.array(self.playing.points[int(np.searchsorted(times, self.time_s - 1e-9))].position_rad)
        self._feel()
        if self._number == self.stops and self.time_s > self.stops_at * times[-1]:
            yield self._status(TrajectoryStatus.STATE_STOPPED, "joint right_elbow stuck")
            self.playing = None
        elif self.time_s < times[-1]:
            yield self._status(TrajectoryStatus.STATE_EXECUTING)
        else:
            yield self._status(TrajectoryStatus.STATE_SUCCEEDED)
            self.playing = None

    def measured(self) -> JointStates:
        """All joints; the fingers stop on what is held."""
        xi = max(self.opening, HELD_OPENING) if self.held else self.opening
        fingers = ARM.fingers_closed + float(np.clip(xi, 0.0, 1.0)) * (ARM.fingers_open - ARM.fingers_closed)
        values = [*self.angles[:5], fingers]
        return JointStates(
            joints=[
                JointState(name=name, position=q) for name, q in zip([*ARM.joints, ARM.fingers], values, strict=True)
            ]
        )

    @property
    def _number(self) -> int:
        assert self.playing is not None
        return int(self.playing.id.rpartition("/")[2])

    @property
    def _phase(self) -> str:
        assert self.playing is not None
        return [phase.name for phase in self.playing.phases if phase.start_s <= self.time_s][-1]

    def _feel(self) -> None:
        if self._phase in ("grasp", "fingers") and self.opening < HELD_OPENING and self.graspable:
            self.held = True
        if self.opening > HELD_OPENING + 0.1 or self._phase == self.slips_at:
            self.held = False

    def _status(self, state: TrajectoryStatus.State, reason: str = "", code: str = "") -> TrajectoryStatus:
        assert self.playing is not None
        return TrajectoryStatus(
            trajectory_id=self.playing.id, state=state, time_s=self.time_s, reason=reason, code=code
        )


class Cell:
    """A synthesizer and a driver, tick by tick.

    Attributes:
        statuses: Everything the synthesizer said of its goals.
        events: Everything it heard, and the ticks.
    """

    def __init__(self, driver: FakeDriver | None = None) -> None:
        self.driver = driver or FakeDriver()
        self.synthesizer = Synthesizer(RememberedPlans(GripperArm.of(HOAP3, "right"), planner(), checker()))
        self.statuses: list[RelocationStatus] = []
        self.events: list[Received | Tick] = []
        self.now_ns = 0
        self.feel()

    def restart(self) -> None:
        """The synthesizer's process is a new one."""
        self.synthesizer = Synthesizer(RememberedPlans(GripperArm.of(HOAP3, "right"), planner(), checker()))

    def feel(self) -> None:
        """The joints are heard."""
        measured = self.driver.measured()
        self._heard(topics.ARM_JOINT_STATES, measured)
        self.synthesizer.on_joint_states(measured)

    def tick(self) -> None:
        self.now_ns += PERIOD_NS
        self.events.append(Tick(len(self.events), self.now_ns))
        output = self.synthesizer.tick(self.now_ns)
        self.statuses.extend(output.statuses)
        answers = [status for trajectory in output.trajectories for status in self.driver.handle(trajectory)]
        answers.extend(self.driver.step())
        self.feel()
        for answer in answers:
            self._heard(topics.ARM_TRAJECTORY_STATUS, answer)
            self.synthesizer.on_trajectory_status(answer)

    def _heard(self, topic: topics.Topic, message: Any) -> None:
        self.events.append(Received(topic, message, self.now_ns, self.now_ns, len(self.events)))

    def do(self, wanted: RelocationGoal, timeout_ticks: int = 1200) -> RelocationStatus:
        """Sends the goal and ticks until its last status, which is returned."""
        self._heard(topics.RELOCATION_GOAL, wanted)
        self.synthesizer.on_goal(wanted)
        last = (RelocationStatus.STATE_SUCCEEDED, RelocationStatus.STATE_FAILED, RelocationStatus.STATE_REJECTED)
        for _ in range(timeout_ticks):
            self.tick()
            ended = [status for status in self.statuses if status.goal_id == wanted.id and status.state in last]
            if ended:
                return ended[-1]
        raise AssertionError(f"goal {wanted.id} has not ended; it said {self.statuses}")

    def said(self, name: str = "g") -> list[tuple[int, str]]:
        return [(status.state, status.phase) for status in self.statuses if status.goal_id == name]
