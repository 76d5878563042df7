"""The rule learner's node says what its library says, replayed from a recording of a whole story."""

import pytest
from pydantic import ValidationError

from nodes import rule_learner
from paramove.bus import topics
from paramove.bus.recorded import RecordedBus
from paramove.msgs.rule_pb2 import ApplicationStage
from tests.applications.launched import parameters
from tests.applications.story import Story

CONFIG = rule_learner.Config.model_validate(parameters("rule_learning", "rule_learner"))


@pytest.fixture(scope="module")
def story() -> Story:
    told = Story("goal-0")
    assert told.run()
    return told


def test_replays_the_whole_story(story: Story) -> None:
    bus = RecordedBus(story.events)
    rule_learner.run(bus, CONFIG)
    for topic, expected in (
        (topics.RELOCATION_GOAL, story.goals),
        (topics.SPEECH, story.speech),
        (topics.RULES, story.rules),
        (topics.CALIBRATION_PLANE, story.calibrations),
        (topics.APPLICATION_STAGE, story.stages),
    ):
        assert [said.message for said in bus.published_on(topic)] == expected, topic.name
    assert {said.topic for said in bus.published} <= set(rule_learner.PUBLISHES)
    assert bus.states[0] == ("ready", "waiting for the arm")
    assert bus.states[-1][0] == "ready"


def test_ends_when_everything_is_put_away(story: Story) -> None:
    more = Story("goal-0")
    more.run()
    for _ in range(50):
        more.tick()
    bus = RecordedBus(more.events)
    rule_learner.run(bus, CONFIG)
    assert bus.now_ns == story.now_ns
    assert bus.published_on(topics.APPLICATION_STAGE)[-1].message.stage == ApplicationStage.STAGE_DONE


def test_silence_is_no_end() -> None:
    story = Story("goal-0")
    story.deaf = 10**6
    story.run(30.0)
    bus = RecordedBus(story.events)
    rule_learner.run(bus, CONFIG)
    assert bus.published_on(topics.APPLICATION_STAGE)[-1].message.stage == ApplicationStage.STAGE_CALIBRATE


def test_refuses_unknown_parameters() -> None:
    with pytest.raises(ValidationError):
        rule_learner.Config.model_validate({"colours": ["red"]})
