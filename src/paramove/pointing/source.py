"""Where pointing gestures come from: what tracking in action space believes, or a window of tracked arm poses."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import ConfigDict

from paramove.bus import Topic, topics
from paramove.documents import OldNames
from paramove.pointing.events import PointingEventOptions, PointingEvents
from paramove.pointing.window import PointingWindowOptions

if TYPE_CHECKING:
    from paramove.pointing.window import PointingWindow


class PointingSetup(OldNames):
    """Parameters of what says where a person points.

    Attributes:
        pointing_from: "estimates" of the action tracker, or "poses" of a body tracker (paper 5.4).
        person: File of the person's measures, for poses; without one, the synthetic demonstrator's. It is looked for in
            the run's folder first, then in the workspace.
        pointing_actions: What of the estimates is a gesture.
        pointing_window: What of the poses is a gesture.
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
            return PointingSource(PointingEvents(self.pointing_actions))
        return PointingSource(self._window(run_folder))

    def _window(self, run_folder: Path) -> PointingWindow:
        # Movement models take a second to import: only who hears poses waits for them.
        from paramove.action_space import measured_person
        from paramove.pointing.last_part_model import LastPartModel
        from paramove.pointing.window import PointingWindow

        person = measured_person(run_folder, self.person)
        model = LastPartModel.of_points(self.pointing_window.points)
        return PointingWindow(model, person.placement, self.pointing_window)


class PointingSource:
    """Turns the messages of one topic into gestures, and poses into a ball where they point.

    Attributes:
        topic: What is listened to.
    """

    def __init__(self, gestures: PointingEvents | PointingWindow) -> None:
        self._gestures = gestures
        self.topic = topics.ACTION_ESTIMATE if isinstance(gestures, PointingEvents) else topics.HUMAN_ARM_POSE

    def handle(self, topic: Topic, message: Any) -> Iterator[tuple[Topic, Any]]:
        """What a message makes known; nothing from messages of another topic than that listened to."""
        if topic.name != self.topic.name:
            return
        gesture = self._gestures.update(message)
        if gesture is not None:
            yield topics.GESTURES, gesture
        ball = None if isinstance(self._gestures, PointingEvents) else self._gestures.ball()
        if ball is not None:
            yield topics.GESTURES_SCENE, ball
