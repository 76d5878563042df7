"""What the stages of the rule-learning application share."""

from __future__ import annotations

import logging
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Literal

from paramove.applications.conversation import GoalClient, Goals, OutgoingMessages
from paramove.applications.table import Surface, Table
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.rule_pb2 import ApplicationStage, Speech

_log = logging.getLogger(__name__)

Place = tuple[float, float]
Pointing = Literal["nearness", "action_space"]


@dataclass(frozen=True)
class RuleLearnerOptions:
    """The application's places and timeouts; shoulder frame, m, s.

    Attributes:
        objects: Names (colours) of the objects.
        corners: Where the robot places an object to learn how the camera sees its working area.
        offer: Where the open hand waits for an object: x, y, and height of the gripper.
        grasp_z: Height at which standing objects are grasped.
        surface: The working surface.
        pointing: What tells who is pointed at: the "nearness" of the hand to an object, or the place that a tracked arm
            points at, by tracking in "action_space".
        attempts: How often an object is tried before the instructor is asked.
        settle_s: The view of an object is trusted so long after the arm has left.
        ask_again_s: A request to the instructor is repeated after so long without an answer.
        arming_timeout_s: The application ends when the arm is not armed again for so long.
    """

    objects: tuple[str, ...]
    corners: tuple[Place, ...]
    offer: tuple[float, float, float]
    grasp_z: float
    surface: Surface
    frame: str = "right_shoulder"
    pointing: Pointing = "nearness"
    attempts: int = 3
    settle_s: float = 2.6
    ask_again_s: float = 25.0
    arming_timeout_s: float = 10.0


@dataclass
class ApplicationState:
    """What all stages see and use.

    Attributes:
        rules: Object -> place of its opening.
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
    sentence: str = ""

    def tell(self, sentence: str, request: Speech.Request = Speech.REQUEST_UNSPECIFIED, name: str = "") -> None:
        """Say a sentence to the instructor, with or without a request."""
        speech = Speech(request=request, object=name, sentence=sentence)
        speech.captured.FromNanoseconds(round(self.now_s * 1e9))
        self.outgoing.speech.append(speech)
        self.sentence = sentence
        _log.info("%.1f s: %s", self.now_s, sentence)


class Stage(ABC):
    """A stage: `enter`, then `step` once a tick until it gives the next stage's name.

    Attributes:
        stage: As said in `ApplicationStage`.
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
    """A place in words: centimetres."""
    return f"({place[0] * 100:.1f}, {place[1] * 100:.1f}) cm".replace("-", "−")
