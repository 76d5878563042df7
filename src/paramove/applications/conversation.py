"""What an application publishes: goals for the arm, requests to the person, and its estimates."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from paramove.msgs.plane_calibration_pb2 import PlaneCalibration
from paramove.msgs.relocation_pb2 import Position, RelocationGoal, RelocationStatus
from paramove.msgs.rule_pb2 import ApplicationStage, Rules, Speech
from paramove.objects import ObjectShape

RESEND_S = 0.5
QUERY_S = 5.0  # the status of an acknowledged goal is queried after this time without one
TIMEOUT_S = 30.0  # a goal fails after this time without a status
_LAST = {RelocationStatus.STATE_SUCCEEDED, RelocationStatus.STATE_FAILED, RelocationStatus.STATE_REJECTED}


@dataclass
class OutgoingMessages:
    """Messages to publish at the end of this tick."""

    goals: list[RelocationGoal] = field(default_factory=list)
    speech: list[Speech] = field(default_factory=list)
    calibrations: list[PlaneCalibration] = field(default_factory=list)
    rules: list[Rules] = field(default_factory=list)
    stages: list[ApplicationStage] = field(default_factory=list)

    def speak(self, now_s: float, text: str, request: Speech.Request, name: str = "") -> None:
        """Say something to the person, with or without a request, about the object of this name or about none."""
        speech = Speech(request=request, object=name, text=text)
        speech.captured.FromNanoseconds(round(now_s * 1e9))
        self.speech.append(speech)


def position_at(point: tuple[float, float, float]) -> Position:
    """A position x, y, z of the gripper."""
    return Position(x=point[0], y=point[1], z=point[2])


class GoalClient:
    """Sends one goal after the other, each until it is acknowledged, and queries its status after a while without one.

    The node that executes goals may have been restarted and not know the goal: it reports that, and the goal fails.

    Args:
        frame: Of all positions.
        grasp_z: Height at which standing objects are grasped, m.
        run_name: Prefix of the goals' ids; unique to the process, as a goal id is executed only once.

    Attributes:
        grasps: How many times an object was to be grasped.
        retries: How many of them were not the first try.
    """

    def __init__(self, frame: str, grasp_z: float, run_name: str) -> None:
        self._frame, self._grasp_z, self._run_name = frame, grasp_z, run_name
        self._count = 0
        self._goal: RelocationGoal | None = None
        self._status: RelocationStatus | None = None
        self._sent_s = 0.0
        self._received_s = 0.0
        self._now_s = 0.0
        self.started_s = 0.0
        self.grasps = 0
        self.retries = 0
        self._worked: dict[str, int] = {}
        self._skipped = 0

    def position(self, place: tuple[float, float]) -> Position:
        """A position on the working plane as a position of the gripper."""
        return position_at((*place, self._grasp_z))

    def start(
        self,
        kind: RelocationGoal.Kind,
        now_s: float,
        name: str = "",
        source: Position | None = None,
        target: Position | None = None,
        avoid: Iterable[tuple[float, float]] = (),
        attempt: int = 1,
        plan_only: bool = False,
        shape: ObjectShape | None = None,
    ) -> None:
        """Set a goal; it is sent with the next `step`.

        Attempts at an object of unknown height begin in the way that worked last.
        """
        self._count += 1
        if attempt == 1:
            self._skipped = 0 if shape is not None and shape.height else self._worked.get(name, 0)
        goal = RelocationGoal(
            id=f"{self._run_name}-{self._count}",
            kind=kind,
            object=name,
            frame=self._frame,
            attempt=attempt + self._skipped,
            plan_only=plan_only,
        )
        if shape is not None:
            goal.object_width_m, goal.object_height_m, goal.object_length_m = shape.width, shape.height, shape.length
            if shape.turn is not None:
                goal.object_turn_rad = shape.turn
        if source is not None:
            getattr(goal, "from").CopyFrom(source)
        if target is not None:
            goal.to.CopyFrom(target)
        goal.avoid.extend(self.position(place) for place in avoid)
        self._goal, self._status, self._sent_s, self.started_s = goal, None, float("-inf"), now_s
        self._received_s = now_s
        if kind in (RelocationGoal.KIND_RELOCATE, RelocationGoal.KIND_FETCH) and not plan_only:
            self.grasps += 1
            self.retries += attempt > 1

    def on_status(self, status: RelocationStatus) -> None:
        """Store the status of the current goal."""
        if self._goal is not None and status.goal_id == self._goal.id:
            self._status, self._received_s = status, self._now_s
            if self.succeeded:
                self._worked[self._goal.object] = (self._goal.attempt - 1) % 2  # every second one is another way

    def step(self, now_s: float, outgoing: OutgoingMessages) -> None:
        """Send the goal, again without an acknowledgement; query it, or let it fail, without a status."""
        self._now_s = now_s
        if self._goal is None or self.outcome is not None:
            return
        acknowledged = self._status is not None
        if now_s - self._received_s >= TIMEOUT_S:
            reason = f"no status of goal {self._goal.id} for {TIMEOUT_S:g} s; check that the synthesizer is running"
            self._status = RelocationStatus(goal_id=self._goal.id, state=RelocationStatus.STATE_FAILED, reason=reason)
        elif now_s >= (max(self._sent_s, self._received_s) + QUERY_S if acknowledged else self._sent_s + RESEND_S):
            self._goal.asked_again = acknowledged
            sent = RelocationGoal()
            sent.CopyFrom(self._goal)
            outgoing.goals.append(sent)
            self._sent_s = now_s

    @property
    def running(self) -> bool:
        """Whether a goal was set that has no final status yet."""
        return self._goal is not None and self.outcome is None

    @property
    def outcome(self) -> RelocationStatus | None:
        """The final status of the goal, None while it is being executed."""
        return self._status if self._status is not None and self._status.state in _LAST else None

    @property
    def succeeded(self) -> bool:
        """Whether the goal has been done."""
        return self.outcome is not None and self.outcome.state == RelocationStatus.STATE_SUCCEEDED
