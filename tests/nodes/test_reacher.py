"""The reacher's node says what its library says, replayed from a recording of both tasks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from nodes import reacher
from paramove.bus import topics
from paramove.bus.recorded import RecordedBus
from paramove.documents.input_error import InputError
from paramove.msgs.joint_trajectory_pb2 import TrajectoryStatus
from paramove.phmm import ModelFileError
from paramove.robots.description import DescriptionError
from tests.applications.servo_cell import STEPS, ServoCell
from tests.motion.reaching import ROBOT_FOLDER, reaching_model

ARM_FOLDER = ROBOT_FOLDER.parent / "open_manipulator_x"
TASKS = [step.model_dump(exclude_none=True) for step in STEPS]


@pytest.fixture
def config(tmp_path: Path) -> Any:
    reaching_model().save(tmp_path / "reaching.npz")
    movement = {"file": tmp_path / "reaching.npz"}
    return lambda robot=ARM_FOLDER, tasks=TASKS: reacher.Config.model_validate(
        {"robot": robot, "tasks": tasks, "movement": movement}
    )


def test_replays_both_tasks(config: Any) -> None:
    cell = ServoCell().run()
    bus = RecordedBus(cell.events)
    reacher.run(bus, config())
    assert [said.message for said in bus.published_on(topics.ARM_TRAJECTORY)] == cell.sent
    assert [said.message for said in bus.published_on(topics.SPEECH)] == cell.speech
    assert bus.states[-1][0] == "ready"


def test_fails_with_the_reason_of_the_driver(config: Any) -> None:
    cell = ServoCell()
    cell.answers, cell.reason = (TrajectoryStatus.STATE_STOPPED,), "stopped from the page by a person"
    bus = RecordedBus(cell.run().events)
    reacher.run(bus, config())
    assert bus.states[-1][0] == "failed"
    assert "stopped from the page by a person" in bus.states[-1][1]


def test_a_bad_model_file_is_refused_with_the_nodes_own_parameter(config: Any) -> None:
    damaged = config()
    damaged.movement.file.write_bytes(b"no model")
    with pytest.raises(ModelFileError, match=r"reaching\.npz: .* leave out the node's parameter movement\.file"):
        reacher.run(RecordedBus([]), damaged)


def test_wrong_parameters_are_refused_at_the_start(config: Any) -> None:
    with pytest.raises(ValidationError, match="found pick"):
        config(tasks=[{"pick": [0.1, 0.0, 0.02]}])
    with pytest.raises(InputError, match=r"task 1 of 1, reach for .* cannot be reached"):
        reacher.run(RecordedBus([]), config(tasks=[{"reach": [0.9, 0.0, 0.1]}]))
    with pytest.raises(DescriptionError, match="it is not a servo arm"):
        reacher.run(RecordedBus([]), config(robot=ROBOT_FOLDER))
