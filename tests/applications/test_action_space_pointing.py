"""The rule learner acts on the place that a tracked arm points at, and asks again where that tells no object."""

from __future__ import annotations

import pytest

from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.rule_pb2 import ApplicationStage, Speech
from tests.applications.launched import rule_learner
from tests.applications.story import PLACES, Place, Story

APPLY = ApplicationStage.STAGE_APPLY
BETWEEN = (0.177, -0.047)


class ArmStory(Story):
    """A person whose arm is tracked; the hand is seen near objects all the same.

    Attributes:
        places_said: Where the arm points next, instead of at the object; None: at the object.
    """

    def __init__(self) -> None:
        super().__init__(options=rule_learner(pointing="action_space"))
        self.places_said: list[Place | None] = []

    def _point_at(self, name: str | None) -> None:
        standing = [each for each in PLACES if each in self.places]
        if standing:
            place = self.places_said.pop(0) if self.places_said else None
            self.gesture(Gesture.KIND_POINTED_AT, "", place or self.places[name or standing[0]])


def test_the_objects_that_the_arm_points_at_are_put_away() -> None:
    story = ArmStory()
    assert story.run()
    assert [goal.object for goal in story.relocations()] == ["yellow", "green", "blue"]


def test_nearness_of_the_hand_to_an_object_says_nothing() -> None:
    story = ArmStory()
    story.answers[Speech.REQUEST_POINT_AT_OBJECT] = lambda _: None
    story.run_to(APPLY)
    for name, place in PLACES.items():
        story.stand(name, place)
    story.run(3.0)
    story.gesture(Gesture.KIND_POINTED_AT, "blue", PLACES["blue"])
    story.run(5.0)
    assert story.relocations() == []


@pytest.mark.parametrize(
    ("place", "words"),
    [(BETWEEN, "that can be blue or green"), ((0.12, 0.05), "I see nothing that stands near there")],
)
def test_it_asks_again_where_the_place_tells_no_object(place: Place, words: str) -> None:
    story = ArmStory()
    story.places_said = [place]
    assert story.run()
    assert story.sentences().count(words) == 1
    assert story.requests().count("POINT_AT_OBJECT") == 4
    assert len(story.relocations()) == 3


@pytest.mark.parametrize("place", [(0.5, 0.5), (float("nan"), 0.0)])
def test_beside_the_table_nobody_points_at_anything(place: Place) -> None:
    story = ArmStory()
    story.places_said = [place]
    story.run_to(APPLY)
    story.run(8.0)
    assert "You point at" not in story.sentences()
    assert story.requests().count("POINT_AT_OBJECT") == 1
    assert story.run()


def test_a_hand_that_has_just_put_an_object_down_does_not_point_at_it() -> None:
    story = ArmStory()
    story.answers[Speech.REQUEST_POINT_AT_OBJECT] = lambda _: None
    story.run_to(APPLY)
    story.stand("blue", PLACES["blue"])
    story.run(0.5)
    story.gesture(Gesture.KIND_POINTED_AT, "", PLACES["blue"])
    story.run(3.0)
    assert story.relocations() == []
    story.gesture(Gesture.KIND_POINTED_AT, "", PLACES["blue"])
    assert story.run(8.0, until=lambda: bool(story.relocations()))


def test_while_the_table_is_being_laid_doubts_are_kept() -> None:
    story = ArmStory()
    story.answers[Speech.REQUEST_POINT_AT_OBJECT] = lambda _: None
    story.run_to(APPLY)
    story.stand("blue", PLACES["blue"])
    story.run(3.0)
    story.gesture(Gesture.KIND_POINTED_AT, "", PLACES["yellow"])
    story.run(3.0)
    assert "You point at" not in story.sentences()


def test_what_was_pointed_at_before_the_robot_asked_does_not_count() -> None:
    story = ArmStory()
    story.answers[Speech.REQUEST_POINT_AT_OBJECT] = lambda _: None
    story.run_to(APPLY)
    asked_ns = story.now_ns
    for name, place in PLACES.items():
        story.stand(name, place)
    story.run(3.0)
    late = Gesture(kind=Gesture.KIND_POINTED_AT, located=True, frame="right_shoulder", x=0.17, y=0.05)
    late.captured.FromNanoseconds(asked_ns - 100_000_000)
    story.learner.on_gesture(late)
    story.run(3.0)
    assert story.relocations() == []


def test_a_place_in_a_frame_that_it_does_not_know_is_told() -> None:
    story = ArmStory()
    story.answers[Speech.REQUEST_POINT_AT_OBJECT] = lambda _: None
    story.run_to(APPLY)
    story.run(1.0)
    gesture = Gesture(kind=Gesture.KIND_POINTED_AT, located=True, frame="table", x=0.17, y=0.05)
    gesture.captured.FromNanoseconds(story.now_ns)
    story.learner.on_gesture(gesture)
    story.run(1.0)
    assert "in the frame 'table'" in story.sentences()
    assert story.relocations() == []
