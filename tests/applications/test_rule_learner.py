"""The application's story, told by messages alone: what goes well, and what it does when something does not."""

from __future__ import annotations

import re

import numpy as np
import pytest
from pydantic import ValidationError

from paramove.applications.conversation import TIMEOUT_S
from paramove.applications.rule_learner import RuleLearner
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.relocation_pb2 import RelocationGoal
from paramove.msgs.rule_pb2 import ApplicationStage, Speech
from paramove.msgs.safety_state_pb2 import SafetyFault, SafetyState
from paramove.objects.homography import PlaneHomography
from tests.applications.launched import rule_learner
from tests.applications.story import CORNERS, FAILED, OPENINGS, OPTIONS, PLACES, REJECTED, SUCCEEDED, WIDTH, Story

CALIBRATE, LEARN = ApplicationStage.STAGE_CALIBRATE, ApplicationStage.STAGE_LEARN
APPLY, DONE = ApplicationStage.STAGE_APPLY, ApplicationStage.STAGE_DONE


def kinds(story: Story) -> list[str]:
    return [RelocationGoal.Kind.Name(goal.kind).removeprefix("KIND_") for goal in story.goals]


def at_place(goal: RelocationGoal, which: str = "from") -> tuple[float, float]:
    position = getattr(goal, which)
    return position.x, position.y


def test_the_whole_story() -> None:
    story = Story()
    assert story.run(), story.learner.detail
    stages = [stage.stage for stage in story.stages]
    assert sorted(set(stages)) == [CALIBRATE, LEARN, APPLY, DONE]
    assert stages == sorted(stages)
    assert kinds(story) == ["REST", "OFFER_HAND", "TAKE", "PLACE_HELD"] + ["RELOCATE"] * 6
    assert story.requests() == [
        "HAND_ME_AN_OBJECT",
        "LET_GO",
        "SHOW_RULES",
        *["POINT_AT_OBJECT"] * 3,
        "THANK_YOU",
    ]
    last = story.stages[-1]
    assert (last.stage, last.grasps, last.retries) == (DONE, 6, 0)
    assert len({goal.id for goal in story.goals}) == len(story.goals)
    for name, goal in zip(PLACES, story.relocations(), strict=True):
        assert goal.object == name
        np.testing.assert_allclose(at_place(goal), PLACES[name], rtol=0, atol=1e-9)
        np.testing.assert_allclose(at_place(goal, "to"), OPENINGS[name], rtol=0, atol=1e-9)
        assert goal.to.z == getattr(goal, "from").z == OPTIONS.grasp_z
        assert goal.frame == "right_shoulder"
        assert goal.object_width_m == WIDTH, "as it was seen"


def test_it_calibrates_from_its_own_corners() -> None:
    story = Story()
    story.run_to(LEARN)
    (calibration,) = story.calibrations
    plane = PlaneHomography.from_message(calibration)
    for x, y in (*CORNERS, (0.16, -0.02)):
        np.testing.assert_allclose(plane.plane_from_image(240 - 1000 * y, 400 - 1000 * x), (x, y), rtol=0, atol=1e-9)
    assert calibration.plane_z == OPTIONS.grasp_z
    placed = [at_place(goal, "to") for goal in story.goals if goal.HasField("to")]
    assert placed == list(CORNERS)
    fetched = [at_place(goal) for goal in story.goals if goal.kind == RelocationGoal.KIND_RELOCATE]
    assert fetched == list(CORNERS[:3])


def test_the_other_objects_are_kept_clear_of() -> None:
    story = Story()
    story.run()
    first, second, third = story.relocations()
    assert {(p.x, p.y) for p in first.avoid} == {PLACES["green"], PLACES["blue"]}
    assert {(p.x, p.y) for p in second.avoid} == {PLACES["blue"]}
    assert list(third.avoid) == []


def test_rules_are_told_in_a_sentence_with_place_and_time() -> None:
    story = Story()
    story.run_to(APPLY)
    final = story.rules[-1]
    assert [rule.object for rule in final.rules] == ["blue", "green", "yellow"]
    assert final.frame == "right_shoulder"
    yellow = final.rules[2]
    assert (yellow.x, yellow.y) == OPENINGS["yellow"]
    seen_s = yellow.seen.ToNanoseconds() * 1e-9
    assert yellow.text == f"yellow belongs to the opening at (13.5, −3.8) cm, seen going in at {seen_s:.1f} s"
    assert re.fullmatch(
        r"yellow belongs to the opening at \(13\.5, −3\.8\) cm, seen going in at \d+\.\d s", yellow.text
    )
    assert yellow.text in story.sentences()
    assert yellow.observations == 1


def test_a_sentence_of_a_known_place_and_time() -> None:
    story = Story()
    story.answers[Speech.REQUEST_SHOW_RULES] = lambda _: None
    story.run_to(LEARN)
    story.run(83.35 - story.now_s)
    story.gesture(Gesture.KIND_MOVED, "yellow", PLACES["yellow"])
    went_in = Gesture(kind=Gesture.KIND_VANISHED, object="yellow", located=True, x=0.1412, y=-0.0316)
    went_in.captured.FromNanoseconds(83_400_000_000)
    story.learner.on_gesture(went_in)
    story.run(3.0)
    assert "yellow belongs to the opening at (14.1, −3.2) cm, seen going in at 83.4 s" in story.sentences()


# Learning


def watch(story: Story) -> None:
    """The story up to the watching, with an instructor who shows nothing by itself."""
    story.answers[Speech.REQUEST_SHOW_RULES] = story.answers[Speech.REQUEST_SHOW_RULE_AGAIN] = lambda _: None
    story.run_to(LEARN)


def test_an_object_that_comes_back_has_no_rule() -> None:
    """It was hidden by the hand, or taken out again."""
    story = Story()
    watch(story)
    story.show("green")
    story.run(3.5)
    story.stand("green", PLACES["green"])
    story.run(10.0)
    assert story.rules == []


def test_a_believed_rule_is_withdrawn_when_the_object_is_back_and_learned_anew() -> None:
    story = Story()
    watch(story)
    story.show("green")
    story.run(8.0)
    assert [rule.object for rule in story.rules[-1].rules] == ["green"]
    story.stand("green", PLACES["green"])
    assert story.run(1.0, until=lambda: not story.rules[-1].rules)
    story.gesture(Gesture.KIND_MOVED, "green", PLACES["green"])
    story.vanish("green", OPENINGS["blue"])
    story.run(4.0)
    (rule,) = story.rules[-1].rules
    assert (rule.object, rule.x, rule.y, rule.observations) == ("green", *OPENINGS["blue"], 2)


@pytest.mark.parametrize("place", [(0.105, 0.0), (0.20, 0.125), (0.30, 0.0), (0.20, -0.16)])
def test_what_vanishes_at_the_border_was_carried_away(place: tuple[float, float]) -> None:
    story = Story()
    watch(story)
    story.gesture(Gesture.KIND_MOVED, "blue", PLACES["blue"])
    story.vanish("blue", place)
    story.run(5.0)
    assert story.rules == []


def test_what_vanishes_without_having_moved_is_no_rule() -> None:
    story = Story()
    watch(story)
    story.vanish("blue", OPENINGS["blue"])
    story.run(5.0)
    assert story.rules == []


def test_nothing_is_believed_while_the_hand_is_in_view() -> None:
    story = Story()
    watch(story)
    story.hand(True)
    story.gesture(Gesture.KIND_MOVED, "blue", PLACES["blue"])
    story.vanish("blue", OPENINGS["blue"])
    story.run(6.0)
    assert story.rules == []
    story.hand(False)
    story.run(0.5)
    assert [rule.object for rule in story.rules[-1].rules] == ["blue"]


def test_it_asks_again_after_silence_for_the_object_that_is_missing() -> None:
    story = Story()
    story.answers[Speech.REQUEST_SHOW_RULES] = lambda _: story.show("yellow", "blue")
    story.run_to(LEARN)
    assert story.run(90.0, until=lambda: "SHOW_RULE_AGAIN" in story.requests())
    asked = next(speech for speech in story.speech if speech.request == Speech.REQUEST_SHOW_RULE_AGAIN)
    assert asked.object == "green"
    story.run_to(APPLY)
    assert story.requests().count("SHOW_RULE_AGAIN") == 1


# Applying


def test_nothing_felt_is_tried_again_and_counted() -> None:
    story = Story()
    story.outcomes = [(FAILED, "felt nothing in the hand", None)]
    assert story.run(), story.learner.detail
    first, second, *_ = story.relocations()
    assert (first.object, first.attempt, second.object, second.attempt) == ("yellow", 1, "yellow", 2)
    assert at_place(second) == PLACES["yellow"]
    assert (story.stages[-1].grasps, story.stages[-1].retries) == (7, 1)
    assert "felt nothing in the hand. I try again." in story.sentences()
    assert "HELP" not in story.requests()


def test_after_a_failure_the_arm_goes_home_before_it_tries_again() -> None:
    story = Story()
    story.outcomes = [(FAILED, "the object slipped", None)]
    story.run()
    after = [
        goal for goal in story.goals if goal.id == story.relocations()[0].id or goal.kind == RelocationGoal.KIND_REST
    ]
    assert after[-1].kind == RelocationGoal.KIND_REST


def test_an_object_that_stands_elsewhere_afterwards_is_fetched_from_there() -> None:
    story = Story()
    fell = (0.160, 0.01)
    story.outcomes = [(SUCCEEDED, "", fell)]
    assert story.run(), story.learner.detail
    first, second, *_ = story.relocations()
    assert (first.object, second.object, second.attempt) == ("yellow", "yellow", 2)
    np.testing.assert_allclose(at_place(second), fell, rtol=0, atol=1e-9)
    assert story.stages[-1].retries == 1


def test_an_object_that_never_moved_is_tried_again_though_the_arm_believes_it_done() -> None:
    story = Story()
    story.run_to(APPLY)
    story.outcomes = [(SUCCEEDED, "", PLACES["yellow"])]
    assert story.run()
    assert [goal.object for goal in story.relocations()] == ["yellow", "yellow", "green", "blue"]


def test_after_three_failures_it_asks_for_help_and_goes_on_when_helped() -> None:
    story = Story()
    story.outcomes = [(FAILED, "felt nothing", None)] * 3
    assert story.run(), story.learner.detail
    assert story.requests().count("HELP") == 1
    asked = next(speech for speech in story.speech if speech.request == Speech.REQUEST_HELP)
    assert asked.object == "yellow"
    assert "I tried 3 times to put yellow away: felt nothing." in asked.text
    assert [goal.attempt for goal in story.relocations()] == [1, 2, 3, 1, 1, 1]
    assert (story.stages[-1].stage, story.stages[-1].retries) == (DONE, 2)


def test_a_refusal_is_told_and_help_is_asked_for() -> None:
    story = Story()
    story.outcomes = [(REJECTED, "the forearm would come within 2.0 mm of standing_0", None)]
    assert story.run(), story.learner.detail
    asked = next(speech for speech in story.speech if speech.request == Speech.REQUEST_HELP)
    assert "the forearm would come within 2.0 mm of standing_0." in asked.text
    assert asked.text.startswith("I cannot reach yellow at (17.0, 5.0) cm")
    assert [goal.attempt for goal in story.relocations()] == [1, 1, 1, 1]


def test_what_stands_in_the_way_is_put_away_first() -> None:
    story = Story()
    story.outcomes = [(REJECTED, "the forearm would come within 2.0 mm of standing_1", None)]
    story.in_the_way = [[1]]
    assert story.run(), story.learner.detail
    assert "blue stands in the way of yellow. Please point at blue first." in story.sentences()
    assert [goal.object for goal in story.relocations()][:2] == ["yellow", "blue"]
    assert "HELP" not in story.requests()


def test_help_is_asked_for_where_each_stands_in_the_way_of_the_other() -> None:
    story = Story()
    story.outcomes = [(REJECTED, "too near to standing_1", None), (REJECTED, "too near to standing_0", None)]
    story.in_the_way = [[1], [0]]
    assert story.run(), story.learner.detail
    assert story.requests().count("HELP") == 1


def test_where_moving_an_object_did_not_help_the_one_in_its_way_is_moved() -> None:
    story = Story()
    near = [(REJECTED, "too near to standing_1", None), (REJECTED, "too near to standing_0", None)]
    story.outcomes = near * 3
    story.in_the_way = [[1], [0]] * 3
    assert story.run(400.0), story.learner.detail
    asked = [speech for speech in story.speech if speech.request == Speech.REQUEST_HELP]
    assert [speech.object for speech in asked[:2]] == ["blue", "yellow"]
    assert "Please put it to another place" in asked[0].text
    assert "I cannot reach blue" in asked[1].text
    assert "Please put yellow to another place" in asked[1].text
    assert len(asked) == 3


def test_help_is_asked_for_again_when_nobody_comes() -> None:
    story = Story()
    story.outcomes = [(REJECTED, "no way", None)]
    story.answers[Speech.REQUEST_HELP] = lambda _: None
    story.run_to(APPLY)
    assert story.run(120.0, until=lambda: story.requests().count("HELP") >= 3)


@pytest.mark.parametrize("reason", ["the object slipped", ""])
def test_an_object_that_is_seen_no_more_after_a_failure_is_asked_for(reason: str) -> None:
    story = Story()
    story.run_to(APPLY)
    story.outcomes = [(FAILED, reason, None)]
    assert story.run(40.0, until=lambda: bool(story.relocations()))
    story.vanish("yellow", (0.2, 0.0))
    assert story.run(40.0, until=lambda: "HELP" in story.requests())
    assert "I have lost sight of yellow" in story.sentences()
    assert story.run()


@pytest.mark.parametrize("name", ["red", "yellow"])
def test_pointing_at_what_is_not_known_or_not_there_is_said(name: str) -> None:
    story = Story()
    story.answers[Speech.REQUEST_POINT_AT_OBJECT] = lambda _: None
    story.run_to(APPLY)
    story.gesture(Gesture.KIND_POINTED_AT, name, (0.2, 0.0))
    story.run(3.0)
    assert f"You point at {name}, but I do not know where it stands or belongs." in story.sentences()
    assert story.relocations() == []
    story.answers[Speech.REQUEST_POINT_AT_OBJECT] = lambda _: story.point()
    assert story.run()


def test_it_asks_to_point_again_when_nobody_does() -> None:
    story = Story()
    story.answers[Speech.REQUEST_POINT_AT_OBJECT] = lambda _: None
    story.run_to(APPLY)
    story.run(60.0)
    assert story.requests().count("POINT_AT_OBJECT") >= 3


def test_the_arm_waits_until_the_hand_has_left() -> None:
    story = Story()
    story.answers[Speech.REQUEST_POINT_AT_OBJECT] = lambda _: None
    story.run_to(APPLY)
    for name, place in PLACES.items():
        story.stand(name, place)
    story.hand(True)
    story.gesture(Gesture.KIND_POINTED_AT, "blue", PLACES["blue"])
    story.run(4.0)
    assert story.relocations() == []
    story.run(20.0)
    assert story.relocations() == []
    assert 2 <= story.sentences().count("I see a hand") <= 4
    story.hand(False)
    assert story.run(1.0, until=lambda: bool(story.relocations()))
    assert story.relocations()[0].object == "blue"


def test_of_two_objects_of_one_colour_none_is_taken_before_one_is_away() -> None:
    story = Story()
    story.twins = {"yellow"}
    story.answers[Speech.REQUEST_HELP] = lambda name: (story.twins.clear(), story.put(1.0, name, PLACES[name]))
    story.run_to(APPLY)
    assert story.run(60.0, until=lambda: "HELP" in story.requests())
    assert "I see more than one yellow object." in story.sentences()
    assert story.relocations() == []
    assert story.run(), story.learner.detail


def test_another_one_is_asked_for_in_place_of_an_object_of_unfit_size() -> None:
    story = Story()
    reason = "the object looks 40 mm wide; this gripper holds objects of 12 to 22 mm"
    story.outcomes, story.misfit = [(REJECTED, reason, None)], True
    assert story.run(), story.learner.detail
    assert story.requests().count("HELP") == 1
    assert f"{reason}. Please stand another one there." in story.sentences()


def test_one_that_has_fallen_over_is_stood_up_before_the_arm_moves() -> None:
    story = Story()
    story.run_to(APPLY)
    story.lie = {"yellow"}
    assert story.run(until=lambda: "yellow has fallen over. Please stand it up." in story.sentences())
    assert "yellow" not in [goal.object for goal in story.relocations()]
    story.lie = set()
    assert story.run(), story.learner.detail


@pytest.mark.parametrize("begins", ["shown", "left"])
def test_one_that_shall_lie_is_taken_as_it_lies(begins: str) -> None:
    story = Story()
    if begins == "left":
        story.run_to(APPLY)
    story.lie = {"yellow"}
    assert story.run(), story.learner.detail
    assert [goal.object_length_m > 0 for goal in story.relocations() if goal.object == "yellow"] == [True]
    assert story.sentences().count("yellow has fallen over") == (begins == "left")


def test_what_a_person_puts_in_is_put_away() -> None:
    story = Story()
    story.answers[Speech.REQUEST_POINT_AT_OBJECT] = lambda _: None
    story.run_to(APPLY)
    story.run(3.0)
    assert "is put away" not in story.sentences(), "those that were shown vanished there, too"
    for name, place in PLACES.items():
        story.stand(name, place)
    story.run(1.0)
    story.vanish("green", PLACES["green"])
    story.vanish("yellow", OPENINGS["yellow"])
    story.run(3.0)
    assert [name for name in PLACES if f"{name} is put away." in story.sentences()] == ["yellow"]
    assert story.relocations() == []


def test_an_object_that_stands_on_its_opening_twice_finds_it_covered() -> None:
    story = Story()
    first = next(iter(OPENINGS))
    story.outcomes = [(SUCCEEDED, "", OPENINGS[first])] * 2
    story.run_to(APPLY)
    assert story.run(90.0, until=lambda: "HELP" in story.requests())
    assert len(story.relocations()) == 2, "one more than the first may have been askew"
    assert "Please uncover the opening" in story.sentences()
    assert story.run(), story.learner.detail


# Calibrating, and the wire to the arm


def test_a_goal_is_sent_until_it_is_acknowledged() -> None:
    story = Story()
    story.deaf = 4
    story.run(12.0)
    assert kinds(story)[:6] == ["REST"] * 5 + ["OFFER_HAND"]
    assert len({goal.id for goal in story.goals[:5]}) == 1
    assert story.run()


def test_goals_of_another_process_have_other_ids() -> None:
    story, other = Story(), Story()
    other.learner = RuleLearner(OPTIONS, "other run")
    story.tick()
    other.tick()
    assert story.goals[0].id != other.goals[0].id


def test_words_about_other_goals_are_passed_over() -> None:
    story = Story()
    story.deaf = 10**6
    story.tick()
    story._say("somebody else's", SUCCEEDED)
    story.run(2.0)
    assert set(kinds(story)) == {"REST"}


def test_nothing_in_the_hand_makes_it_ask_again() -> None:
    story = Story()
    story.answers[Speech.REQUEST_HAND_ME_AN_OBJECT] = lambda _: None
    story.run(70.0)
    assert story.requests().count("HAND_ME_AN_OBJECT") >= 2
    assert kinds(story) == ["REST", "OFFER_HAND"]


START = OPTIONS.model_copy(update={"start": (0.165, -0.02), "frame": "arm_base"})


def test_a_hand_that_cannot_be_given_an_object_fetches_it_from_a_marked_position() -> None:
    story = Story(options=START)
    story.run_to(LEARN)
    assert story.requests() == ["STAND_OBJECT_AT_START", "SHOW_RULES"]
    assert kinds(story) == ["REST", "RELOCATE", "RELOCATE", "RELOCATE", "RELOCATE"]
    assert {goal.object for goal in story.goals[1:]} == {"green"}
    assert [at_place(goal) for goal in story.goals[1:]] == [START.start, *START.corners[:3]]
    assert [at_place(goal, "to") for goal in story.goals[1:]] == list(START.corners)
    (calibration,) = story.calibrations
    assert calibration.plane_frame == "arm_base"


def test_an_object_counts_as_stood_when_it_rests_and_the_hand_has_left() -> None:
    story = Story(options=START)
    story.answers[Speech.REQUEST_STAND_OBJECT_AT_START] = lambda _: None
    story.run(until=lambda: "STAND_OBJECT_AT_START" in story.requests())
    story.hand(True)
    story.stand("blue", START.start)
    assert not story.run(5.0, until=lambda: "RELOCATE" in kinds(story))
    story.hand(False)
    assert story.run(5.0, until=lambda: "RELOCATE" in kinds(story))
    assert story.goals[-1].object == "blue"


def test_where_nothing_is_stood_it_is_asked_for_again() -> None:
    story = Story(options=START)
    story.answers[Speech.REQUEST_STAND_OBJECT_AT_START] = lambda _: None
    story.run(70.0)
    assert story.requests().count("STAND_OBJECT_AT_START") >= 2
    assert kinds(story) == ["REST"]


def test_a_placed_object_that_is_not_seen_is_asked_for_anew() -> None:
    story = Story()
    story.run(until=lambda: "TAKE" in kinds(story))
    real, story.stand = story.stand, lambda *_: None
    story.run(until=lambda: "I do not see yellow at (13.5, −10.0) cm" in story.sentences())
    story.stand = real
    assert story.run(), story.learner.detail
    assert story.requests().count("HAND_ME_AN_OBJECT") == 2
    assert len(story.calibrations) == 1


def test_where_it_stands_is_said_every_second_and_at_every_change() -> None:
    story = Story()
    story.deaf = 10**6
    story.run(10.0)
    assert 10 <= len(story.stages) <= 13
    assert story.stages[-1].step == "resting"


def safety(state: SafetyState.State, *sentences: str) -> SafetyState:
    return SafetyState(state=state, faults=[SafetyFault(code="x", detail=detail) for detail in sentences])


def test_a_goal_of_which_nothing_is_heard_is_asked_for_and_its_failure_recovered() -> None:
    """As after the synthesizer's restart: it does not know the goal, and says so."""
    story = Story()
    story.run_to(ApplicationStage.STAGE_APPLY)
    assert story.run(until=lambda: bool(story.relocations()))
    lost = story.goals[-1]
    story.forget_goals()
    assert story.run(until=lambda: story.goals[-1].kind == RelocationGoal.KIND_REST)
    asked = [goal for goal in story.goals if goal.id == lost.id]
    assert [goal.asked_again for goal in asked] == [False, True]
    assert story.run()
    assert story.stages[-1].stage == ApplicationStage.STAGE_DONE


def test_a_goal_that_nobody_answers_is_given_up_and_the_failure_told() -> None:
    story = Story()
    story.run_to(ApplicationStage.STAGE_APPLY)
    story.deaf = 10**6
    assert story.run(until=lambda: bool(story.relocations()))
    assert story.run(TIMEOUT_S + 5.0, until=lambda: story.goals[-1].kind == RelocationGoal.KIND_REST)
    story.deaf = 0
    assert story.run()
    assert any("no status of goal" in speech.text and "30 s" in speech.text for speech in story.speech)


def test_an_arm_that_is_disarmed_ends_the_application_with_the_reason() -> None:
    story = Story()
    learner = story.learner
    learner.on_safety(safety(SafetyState.STATE_DISARMED))
    story.run(1.0)
    learner.on_safety(safety(SafetyState.STATE_ARMED))
    story.run_to(ApplicationStage.STAGE_LEARN)
    assert learner.failure == ""
    goals = len(story.goals)
    learner.on_safety(
        safety(SafetyState.STATE_HOLD, "the robot ran out of rows after 7 of 9 rows and stops; arm again")
    )
    story.run(OPTIONS.arming_timeout_s - 0.5)
    assert learner.failure == ""
    assert len(story.goals) == goals, "without an arm nothing is asked of it"
    (reported,) = [speech.text for speech in story.speech if "cannot go on" in speech.text]
    story.run(1.0)
    assert learner.failure == (
        "the arm is no longer armed (hold): the robot ran out of rows after 7 of 9 rows and stops; arm again; "
        "only a person arms it again"
    )
    assert learner.failure in reported


@pytest.mark.parametrize(
    "state",
    [
        SafetyState.STATE_DISARMED,
        SafetyState.STATE_DISCONNECTED,
        SafetyState.STATE_HOLD,
        SafetyState.STATE_ESTOP,
    ],
)
def test_an_arm_that_is_armed_again_in_time_goes_on(state: SafetyState.State) -> None:
    story = Story()
    story.learner.on_safety(safety(SafetyState.STATE_ARMED))
    story.run_to(ApplicationStage.STAGE_LEARN)
    story.learner.on_safety(safety(state, "stopped by a person"))
    story.run(OPTIONS.arming_timeout_s - 1.0)
    story.learner.on_safety(safety(SafetyState.STATE_ARMED))
    assert story.run()
    assert story.learner.failure == ""


def test_where_nothing_is_found_where_it_is_seen_it_calibrates_again() -> None:
    """As when its base or the camera was moved: the rules are then wrong, too."""
    story = Story()
    story.run_to(APPLY)
    story.outcomes = [(FAILED, "felt nothing in the hand", None)] * 6
    for stage in (CALIBRATE, LEARN):
        story.run_to(stage)
    assert "Was the camera moved, or my base?" in story.sentences()
    assert story.requests().count("HELP") == 1, "first it is one object that is put elsewhere"
    assert not story.rules[-1].rules or len(story.calibrations) == 2
    story._known = set()
    story.run_to(APPLY)
    assert len(story.calibrations) == 2


def test_an_arm_that_was_never_armed_is_waited_for() -> None:
    story = Story()
    story.learner.on_safety(safety(SafetyState.STATE_DISARMED))
    story.run(OPTIONS.arming_timeout_s + 5.0)
    assert story.learner.failure == ""
    assert story.sentences().count("paramove arm enable") == 1
    assert kinds(story) == ["REST"], "nothing else is tried"
    story.learner.on_safety(safety(SafetyState.STATE_ARMED))
    assert story.run(), story.learner.detail


def test_why_an_arm_cannot_be_armed_is_said_with_the_request() -> None:
    story = Story()
    story.learner.on_safety(safety(SafetyState.STATE_DISARMED, "joint gripper is not calibrated"))
    story.run(5.0)
    assert "not calibrated" in story.sentences()


@pytest.mark.parametrize(
    ("rejected", "words"),
    [("OFFER_HAND", "I cannot hold my hand out: too far"), ("PLACE_HELD", "I cannot put yellow at (13.5, −10.0) cm")],
)
def test_a_refusal_while_calibrating_is_no_loop(rejected: str, words: str) -> None:
    """A person is asked for help, and the same is tried again only after a while."""
    story = Story()
    handle = story._hear

    def refusing(goal: RelocationGoal) -> None:
        if goal.kind == RelocationGoal.Kind.Value(f"KIND_{rejected}"):
            story._say(goal.id, REJECTED, "too far")
        else:
            handle(goal)

    story._hear = refusing
    story.answers[Speech.REQUEST_HELP] = lambda _: None
    story.run(60.0)
    assert words in story.sentences()
    assert 1 <= story.requests().count("HELP") <= 3
    assert kinds(story).count(rejected) <= 3
    story._hear = handle
    assert story.run(), story.learner.detail


def test_somewhere_the_first_object_is_brought_to() -> None:
    with pytest.raises(ValidationError, match="neither offer nor start"):
        rule_learner(offer=None)
