"""Relocation by pointing, told by messages alone: what goes well, and what the robot does when something does not."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from paramove.msgs.relocation_pb2 import RelocationStatus
from paramove.msgs.rule_pb2 import ApplicationStage, Speech
from paramove.msgs.safety_state_pb2 import SafetyState
from tests.applications.launched import relocator
from tests.applications.pointing_story import FETCH, PLACES, PUT, RESTS, PointingStory

FAILED, REJECTED = RelocationStatus.STATE_FAILED, RelocationStatus.STATE_REJECTED
DEFAULT = relocator()


def places(goals, end):
    return [(getattr(goal, end).x, getattr(goal, end).y) for goal in goals]


def test_puts_the_object_where_the_person_points_and_fetches_it_there_again():
    story = PointingStory()
    assert story.run()
    assert places(story.of(PUT), "to") == list(PLACES)
    assert places(story.of(FETCH), "from") == [DEFAULT.start, *PLACES[:-1]]
    assert {(goal.to.x, goal.to.y, goal.to.z) for goal in story.of(FETCH)} == {DEFAULT.hold}
    assert {goal.to.z for goal in story.of(PUT)} == {DEFAULT.grasp_z}
    assert {goal.frame for goal in story.goals} == {"right_shoulder"}
    assert [speech.request for speech in story.speech if speech.request] == [
        *[Speech.REQUEST_POINT_AT_PLACE] * 3,
        Speech.REQUEST_THANK_YOU,
    ]
    assert "You point at (14.0, 3.0) cm, certain to 90 %. I put it there." in story.sentences()
    assert (story.stages[-1].stage, story.stages[-1].grasps) == (ApplicationStage.STAGE_DONE, 3)


def test_stages_tell_the_states_in_order():
    story = PointingStory(places=1)
    assert story.run()
    steps = list(dict.fromkeys(stage.step for stage in story.stages))
    assert steps == ["resting", "fetching", "waiting", "letting_hand_leave", "placing", "done"]


def test_nothing_is_put_down_before_somebody_points():
    story = PointingStory()
    story.points = []
    assert not story.run(100.0)
    assert story.of(PUT) == []
    asked = [speech for speech in story.speech if speech.request == Speech.REQUEST_POINT_AT_PLACE]
    assert len(asked) == 4
    assert "I have not seen you point" in asked[-1].text


@pytest.mark.parametrize(
    ("place", "certainty", "options", "words"),
    [
        ((0.22, 0.0), 0.9, {}, "You point at (22.0, 0.0) cm, which I do not reach: my working area goes from (12.5"),
        ((0.16, 0.10), 0.9, {}, "which I do not reach"),
        (PLACES[0], 0.3, {}, "I am not sure where you point: certain to 30 %, 85 % are needed"),
        (PLACES[0], float("nan"), {}, "I am not sure where you point"),
        ((float("nan"), 0.0), 0.9, {}, "which I do not reach"),
        ((0.15, 0.0), 0.9, {"standing": [(0.17, 0.02)]}, "but something stands there, at (17.0, 2.0) cm"),
    ],
)
def test_a_place_that_is_of_no_use_is_asked_for_again_with_the_reason(place, certainty, options, words):
    story = PointingStory(places=1, **options)
    story.points = [(place, certainty), ((0.13, -0.08), 0.9)]
    assert story.run()
    assert words in story.sentences()
    assert places(story.of(PUT), "to") == [(0.13, -0.08)]
    asked = [speech for speech in story.speech if speech.request == Speech.REQUEST_POINT_AT_PLACE]
    assert len(asked) == 2
    assert asked[1].text.endswith("Please point at the place where I shall put it.")


def test_a_place_in_another_frame_is_not_taken_for_one_in_its_own():
    story = PointingStory(places=1)
    story.points = [None]
    story.run_to("waiting")
    story.tick()
    story.point(PLACES[0], frame="table")
    story.run(2.0)
    assert "frame 'table'; I only know places in 'right_shoulder'" in story.sentences()
    assert story.of(PUT) == []


def test_what_was_pointed_at_before_it_asked_does_not_count():
    story = PointingStory()
    story.points = []
    story.run_to("fetching")
    story.tick()
    story.point(PLACES[0])
    story.run_to("waiting")
    story.run(5.0)
    assert story.relocator.state == "waiting"


@pytest.mark.parametrize(("lost", "words"), [(True, "the tracker has lost the arm"), (False, "no camera sees the arm")])
def test_while_the_arm_is_not_seen_it_waits_and_says_so_once(lost, words):
    story = PointingStory(places=1)
    story.points, story.lost = [None], lost
    story.run_to("waiting")
    for number in range(60):
        story.trouble = f"the best hypothesis is {number} nats below the usual" if number % 7 else ""
        story.run(1.0)
    assert story.relocator.state == "waiting"
    assert story.sentences().count(f"I do not see where you point: {words}. I wait.") == 1
    story.trouble = ""
    story.run(5.0)
    story.point(PLACES[0])
    assert story.run(30.0)


def test_a_tracker_without_data_is_reported():
    story = PointingStory(places=1)
    story.points = [None]
    story.run_to("waiting")
    story.sends_nothing = True
    story.run(5.0)
    assert "the tracker sends no data" in story.sentences()


def test_the_arm_waits_until_the_hand_has_left_and_asks_for_it():
    story = PointingStory(places=1)
    story.hand_stays = True
    story.run_to("letting_hand_leave")
    story.run(30.0)
    assert story.of(PUT) == []
    assert "Please take your hand away from (14.0, 3.0) cm" in story.sentences()
    story.take_away()
    assert story.run(10.0)


@pytest.mark.parametrize("what", ["lost", "no data", "another frame"])
def test_where_the_hand_is_not_known_the_arm_does_not_go(what):
    story = PointingStory(places=1)
    story.run_to("letting_hand_leave")
    story.trouble = "the arm is lost" if what == "lost" else ""
    story.sends_nothing = what == "no data"
    story.frame = "table" if what == "another frame" else story.frame
    story.run(60.0)
    assert story.of(PUT) == []
    story.trouble, story.sends_nothing, story.frame = "", False, "right_shoulder"
    assert story.run(10.0)


def test_a_place_that_the_arm_refuses_is_asked_for_again_and_the_object_stays_in_the_hand():
    story = PointingStory(places=1)
    story.outcomes = {PUT: [(REJECTED, "the elbow would touch the table")]}
    assert story.run()
    assert "I cannot put it at (14.0, 3.0) cm: the elbow would touch the table. Please point at" in story.sentences()
    assert places(story.of(PUT), "to") == list(PLACES[:2])
    assert len(story.of(FETCH)) == 1


def test_an_object_that_was_not_felt_is_tried_again_from_the_base_pose():
    story = PointingStory(places=1)
    story.outcomes = {FETCH: [(FAILED, "felt nothing"), (FAILED, "felt nothing")]}
    assert story.run()
    assert [goal.attempt for goal in story.of(FETCH)] == [1, 2, 3]
    assert [goal.kind for goal in story.goals[:4]] == [RESTS, FETCH, RESTS, FETCH]
    assert (story.stages[-1].grasps, story.stages[-1].retries) == (3, 2)
    assert "REQUEST_HELP" not in {Speech.Request.Name(speech.request) for speech in story.speech}


@pytest.mark.parametrize(
    ("kind", "outcomes", "words"),
    [
        (FETCH, [(FAILED, "felt nothing")] * 3, "I could not fetch it at (16.5, −2.0) cm: felt nothing"),
        (FETCH, [(REJECTED, "out of reach")], "I could not fetch it at (16.5, −2.0) cm: out of reach"),
        (PUT, [(FAILED, "it slipped")], "I could not put it at (14.0, 3.0) cm: it slipped"),
        (RESTS, [(REJECTED, "busy")], "I cannot bring my arm to rest: busy"),
    ],
)
def test_what_it_cannot_do_alone_it_asks_help_for_and_goes_on_from_the_start(kind, outcomes, words):
    story = PointingStory(places=1)
    story.outcomes = {kind: outcomes}
    assert story.run()
    help_asked = [speech for speech in story.speech if speech.request == Speech.REQUEST_HELP]
    assert len(help_asked) == 1
    assert help_asked[0].text == f"{words}. Please stand it at (16.5, −2.0) cm."
    assert places(story.of(FETCH), "from")[-1] == DEFAULT.start


def test_an_arm_that_is_disarmed_ends_the_application_with_the_reason():
    story = PointingStory()
    story.safety(SafetyState.STATE_ARMED)
    story.run_to("waiting")
    story.safety(SafetyState.STATE_HOLD, "joint right_elbow stuck")
    story.run(5.0)
    assert story.relocator.failure == ""
    assert "I cannot go on: the arm is no longer armed (hold): joint right_elbow stuck" in story.sentences()
    story.run(6.0)
    assert "joint right_elbow stuck" in story.relocator.failure


def test_a_goal_that_nobody_hears_is_sent_again():
    story = PointingStory()
    goals = story.relocator.tick(1.0).goals + story.relocator.tick(1.2).goals + story.relocator.tick(1.6).goals
    assert [goal.id for goal in goals] == ["run-1", "run-1"]


@pytest.mark.parametrize("wrong", [{"places": 0}, {"min_certainty": 1.5}, {"ask_again_s": 0}, {"corners": []}])
def test_parameters_that_make_no_sense_are_refused(wrong):
    with pytest.raises(ValidationError):
        relocator(**wrong)


def test_how_a_person_points_is_learned_at_the_object_and_taken_off_every_place():
    story = PointingStory(aligns=True)
    story.points = [((x + 0.004, y - 0.008), 0.9) for x, y in PLACES]
    assert story.run()
    found = places(story.of(PUT), "to")
    assert found == [pytest.approx(place, abs=1e-12) for place in PLACES]
    assert "I see you point 9 mm beside the object. I bear that in mind." in story.sentences()
    assert [goal.kind for goal in story.goals[:2]] == [RESTS, FETCH]
    steps = list(dict.fromkeys(stage.step for stage in story.stages))
    assert steps[:4] == ["resting", "aligning", "letting_hand_leave", "fetching"]


@pytest.mark.parametrize("offset", [(0.03, -0.03), (float("nan"), 0.0)])
def test_who_points_elsewhere_does_not_point_at_the_object(offset):
    story = PointingStory(aligns=True, places=1)
    story.offsets = [offset, (0.0, 0.01)]
    assert story.run()
    assert "but the object stands at (16.5, −2.0) cm. Please point at the object" in story.sentences()
    assert places(story.of(PUT), "to") == [pytest.approx((PLACES[0][0], PLACES[0][1] - 0.01), abs=1e-12)]


def test_while_the_object_is_not_pointed_at_nothing_is_fetched():
    story = PointingStory(aligns=True)
    story.offsets = []
    story.run(60.0)
    assert story.relocator.state == "aligning"
    assert story.of(FETCH) == []
    assert story.sentences().count("I have not seen you point. Please point at the object") == 2


def test_the_arm_goes_to_the_object_only_when_the_hand_has_left_it():
    story = PointingStory(aligns=True)
    story.hand_stays = True
    story.run_to("letting_hand_leave")
    story.run(60.0)
    assert story.of(FETCH) == []
    assert "Please take your hand away from (16.5, −2.0) cm" in story.sentences()
