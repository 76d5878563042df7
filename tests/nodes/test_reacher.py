"""The reacher's node publishes what its library does, replayed from a recording of both tasks."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from nodes import reacher
from paramove.bus import topics
from paramove.bus.recorded import RecordedBus
from paramove.msgs.joint_trajectory_pb2 import TrajectoryStatus
from tests.applications.servo_cell import STEPS, ServoCell

TASKS = [step.model_dump(exclude_none=True) for step in STEPS]


def config(**parameters: Any) -> reacher.Config:
    return reacher.Config.model_validate({"tasks": TASKS, **parameters})


def test_replays_both_tasks() -> None:
    cell = ServoCell().run()
    bus = RecordedBus(cell.events)
    reacher.run(bus, config())
    assert [said.message for said in bus.published_on(topics.RELOCATION_GOAL)] == cell.goals
    assert [said.message for said in bus.published_on(topics.SPEECH)] == cell.speech
    assert bus.states[-1][0] == "ready"


def test_fails_with_the_reason_of_the_driver() -> None:
    cell = ServoCell()
    cell.answers, cell.reason = (TrajectoryStatus.STATE_STOPPED,), "stopped from the page by a person"
    bus = RecordedBus(cell.run().events)
    reacher.run(bus, config())
    assert bus.states[-1][0] == "failed"
    assert "stopped from the page by a person" in bus.states[-1][1]


def test_wrong_parameters_are_rejected_at_the_start() -> None:
    with pytest.raises(ValidationError, match="found pick"):
        config(tasks=[{"pick": [0.1, 0.0, 0.02]}])
    with pytest.raises(ValidationError, match=r"robot.*synthesizer"):
        config(robot="robot_description/koch_v1_1")
