"""The relocator's node says what its library says, replayed from a recording of a whole story."""

import pytest
from pydantic import ValidationError

from nodes import relocator
from paramove.bus import topics
from paramove.bus.recorded import RecordedBus
from paramove.msgs.safety_state_pb2 import SafetyState
from tests.applications.launched import parameters
from tests.applications.pointing_story import PointingStory

CONFIG = relocator.Config.model_validate(parameters("relocate_by_pointing", "relocator"))


def test_replays_the_whole_story():
    story = PointingStory("goal-0", aligns=True)
    story.safety(SafetyState.STATE_ARMED)
    assert story.run()
    bus = RecordedBus(story.events)
    relocator.run(bus, CONFIG)
    for topic, expected in (
        (topics.RELOCATION_GOAL, story.sent),
        (topics.APPLICATION_STAGE, story.stages),
        (topics.SPEECH, story.speech),
    ):
        assert [said.message for said in bus.published_on(topic)] == expected, topic.name
    assert {said.topic for said in bus.published} <= set(relocator.PUBLISHES)
    assert bus.states[-1][0] == "ready"


def test_ends_with_the_reason_when_the_arm_stays_disarmed():
    story = PointingStory("goal-0", aligns=True)
    story.safety(SafetyState.STATE_ARMED)
    story.run_to("waiting")
    story.safety(SafetyState.STATE_HOLD, "joint right_elbow stuck")
    story.run(20.0)
    bus = RecordedBus(story.events)
    relocator.run(bus, CONFIG)
    assert bus.states[-1][0] == "failed"
    assert "joint right_elbow stuck" in bus.states[-1][1]
    assert bus.now_ns < story.now_ns


def test_refuses_unknown_parameters():
    with pytest.raises(ValidationError):
        relocator.Config.model_validate({"corners": [[0.1, 0.1]]})
