"""Sources of pointing gestures: the estimates of tracking in action space, or a window of tracked arm poses."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar, Literal

from pydantic import ConfigDict

from paramove.bus import Topic, topics
from paramove.documents import OldNames
from paramove.pointing.events import PointingEventOptions, PointingEvents
from paramove.pointing.window import PointingWindow, PointingWindowOptions


class PointingSetup(OldNames):
    """Parameters of the recognition of pointing.

    Attributes:
        pointing_from: "estimates" of the action tracker, or "poses" of a body tracker (paper 5.4).
        person: File of the person's measures, for poses; without one, the synthetic demonstrator's. The run's folder
            is searched first, then the workspace.
        pointing_actions: Which estimates are gestures.
        pointing_window: Which poses are gestures.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    old_names: ClassVar[tuple[tuple[str, str], ...]] = (
        ("pointing_actions.least_certainty", "pointing_actions.min_certainty"),
        ("pointing_window.least_lead", "pointing_window.min_lead"),
        ("pointing_window.most_gap_s", "pointing_window.max_gap_s"),
    )

    pointing_from: Literal["estimates", "poses"] = "estimates"
    person: Path | None = None
    pointing_actions: PointingEventOptions = PointingEventOptions()
    pointing_window: PointingWindowOptions = PointingWindowOptions()

    def pointing_source(self, run_folder: Path = Path()) -> PointingSource:
        """Reads the person's measures; trains a model at its first use. Raises InputError."""
        if self.pointing_from == "estimates":
            return PointingSource(topics.ACTION_ESTIMATE, PointingEvents(self.pointing_actions))
        # Movement models take a second to import: import them only for poses.
        from paramove.action_space import measured_person
        from paramove.pointing.last_part_model import LastPartModel

        person = measured_person(run_folder, self.person)
        model = LastPartModel.of_points(self.pointing_window.points)
        window = PointingWindow(model, person.placement, self.pointing_window)
        return PointingSource(topics.HUMAN_ARM_POSE, window)


class PointingSource:
    """Turns the messages of one topic into gestures, and poses into a ball where they point."""

    def __init__(self, topic: Topic, gestures: PointingEvents | PointingWindow) -> None:
        self._topic = topic
        self._gestures = gestures

    def handle(self, topic: Topic, message: Any) -> Iterator[tuple[Topic, Any]]:
        """The messages that follow from a message; none for other topics than the subscribed one."""
        if topic.name != self._topic.name:
            return
        gesture = self._gestures.update(message)
        if gesture is not None:
            yield topics.GESTURES, gesture
        ball = self._gestures.ball() if isinstance(self._gestures, PointingWindow) else None
        if ball is not None:
            yield topics.GESTURES_SCENE, ball
