"""What the stages of the rule-learning application share."""

from __future__ import annotations

import logging
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Literal

from pydantic import ConfigDict, Field

from paramove.applications.conversation import GoalClient, Goals, OutgoingMessages
from paramove.applications.table import Surface, Table
from paramove.documents import OldNames
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.rule_pb2 import ApplicationStage, Speech

_log = logging.getLogger(__name__)

Place = tuple[float, float]
Range = tuple[float, float]
Pointing = Literal["nearness", "action_space"]


class RuleLearnerOptions(OldNames):
    """Positions in the right shoulder's frame, m; times in s.

    Attributes:
        objects: Names (colours) of the objects.
        corners: Where the robot places an object to learn how the camera sees its working area.
        offer: Where the open hand waits for an object: x, y, and height of the gripper.
        grasp_z: Height at which standing objects are grasped.
        surface_x, surface_y: Range of the working surface.
        pointing: How the object pointed at is recognised: by "nearness" of the hand, or by the target of an arm tracked
            in "action_space".
        attempts: Attempts to relocate an object before the robot asks the instructor for help.
        settle_s: Time from when the arm has left until the view of an object counts.
        ask_again_s: Time without an answer after which a request to the instructor is repeated.
        arming_timeout_s: The application ends when the arm is not armed again for so long.
        frame: Frame of all positions.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    old_names = (("arm_patience_s", "arming_timeout_s"),)

    objects: tuple[str, ...] = ("yellow", "green", "blue")
    corners: tuple[Place, ...] = ((0.135, -0.10), (0.135, 0.076), (0.19, 0.076), (0.19, -0.10))
    offer: tuple[float, float, float] = (0.155, -0.02, -0.05)
    grasp_z: float = -0.098
    surface_x: Range = (0.100, 0.240)
    surface_y: Range = (-0.170, 0.130)
    pointing: Pointing = "nearness"
    attempts: int = Field(3, ge=1)
    settle_s: float = Field(2.6, ge=0)
    ask_again_s: float = Field(25.0, gt=0)
    arming_timeout_s: float = Field(10.0, gt=0)
    frame: str = "right_shoulder"

    @property
    def surface(self) -> Surface:
        """The working surface."""
        return Surface(self.surface_x, self.surface_y)


@dataclass
class ApplicationState:
    """State that all stages use.

    Attributes:
        rules: Object -> position of its opening.
        done: Objects that have been put away.
    """

    options: RuleLearnerOptions
    goal_client: GoalClient
    goals: Goals
    table: Table = field(default_factory=Table)
    outgoing: OutgoingMessages = field(default_factory=OutgoingMessages)
    now_s: float = 0.0
    rules: dict[str, Place] = field(default_factory=dict)
    done: set[str] = field(default_factory=set)
    detail: str = ""

    def speak(self, detail: str, request: Speech.Request = Speech.REQUEST_UNSPECIFIED, name: str = "") -> None:
        """Send a speech message to the instructor, with or without a request."""
        speech = Speech(request=request, object=name, text=detail)
        speech.captured.FromNanoseconds(round(self.now_s * 1e9))
        self.outgoing.speech.append(speech)
        self.detail = detail
        _log.info("%.1f s: %s", self.now_s, detail)


class Stage(ABC):
    """A stage: `enter`, then `step` once a tick until it gives the next stage's name.

    Attributes:
        stage: As published in `ApplicationStage`.
        state: Name of the state it is in, for people.
    """

    stage: ApplicationStage.Stage = ApplicationStage.STAGE_UNSPECIFIED

    def __init__(self, app: ApplicationState) -> None:
        self.app = app
        self.state = ""
        self._since_s = 0.0

    @abstractmethod
    def enter(self) -> None:
        """Begin the stage."""

    @abstractmethod
    def step(self) -> ApplicationStage.Stage | None:
        """One tick; the next stage or None to stay."""

    @abstractmethod
    def on_gesture(self, gesture: Gesture) -> None:
        """Something happened on the table (the table itself knows already)."""

    def go(self, state: str) -> None:
        """Change the state."""
        self.state, self._since_s = state, self.app.now_s

    @property
    def for_s(self) -> float:
        """How long this state has lasted, s."""
        return self.app.now_s - self._since_s


def cm(place: Place) -> str:
    """A position as text, in centimetres."""
    return f"({place[0] * 100:.1f}, {place[1] * 100:.1f}) cm".replace("-", "−")
