"""The synthesizer's node says what its library says, replayed from a recording of goals and an arm."""

import itertools
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from nodes import synthesizer
from paramove.bus import topics
from paramove.bus.recorded import RecordedBus
from paramove.documents.input_error import InputError
from paramove.msgs.relocation_pb2 import RelocationGoal, RelocationStatus
from tests.motion.fake_driver import Cell, goal
from tests.motion.reaching import OPENINGS, ROBOT_FOLDER, reaching_model


@pytest.fixture
def config(tmp_path: Path) -> synthesizer.Config:
    """With a trained model from a file, not from the user's cache."""
    path = tmp_path / "reaching.npz"
    reaching_model().save(path)
    return synthesizer.Config.model_validate({"robot": ROBOT_FOLDER, "movement": {"file": path}})


def test_replays_a_relocation(config: synthesizer.Config) -> None:
    cell = Cell()
    cell.do(goal(RelocationGoal.KIND_RELOCATE, source=(0.177, -0.02), target=OPENINGS[1]))
    cell.do(goal(RelocationGoal.KIND_RELOCATE, "far", source=(0.30, 0.0), target=OPENINGS[1]))
    bus = RecordedBus(cell.events)
    synthesizer.run(bus, config)
    assert bus.states[0] == ("starting", "training or reading the reaching movement")
    assert [detail for detail, _ in itertools.groupby(detail for _, detail in bus.states[1:])][:3] == [
        "waiting for a goal",
        "goal g: begins",
        "goal g: approach",
    ]
    statuses = [said.message for said in bus.published_on(topics.RELOCATION_STATUS)]
    assert statuses == cell.statuses
    assert statuses[-1].state == RelocationStatus.STATE_REJECTED
    trajectories = [said.message for said in bus.published_on(topics.ARM_TRAJECTORY)]
    assert [one.id for one in trajectories] == [one.id for one in cell.driver.heard] == ["g/1", "g/2"]
    for one, other in zip(trajectories, cell.driver.heard, strict=True):
        assert one.phases == other.phases
        np.testing.assert_allclose(one.points[-1].position_rad, other.points[-1].position_rad, rtol=0, atol=1e-9)
    assert {said.topic for said in bus.published} <= set(synthesizer.PUBLISHES)


def test_without_goals_it_says_nothing(config: synthesizer.Config) -> None:
    cell = Cell()
    for _ in range(20):
        cell.tick()
    bus = RecordedBus(cell.events)
    synthesizer.run(bus, config)
    assert bus.published == []


def test_trains_its_movement_once_and_keeps_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    config = synthesizer.Config.model_validate({"robot": ROBOT_FOLDER, "movement": {"seed": 3}})
    synthesizer.run(RecordedBus(), config)
    (kept,) = tmp_path.rglob("*.npz")
    before = kept.stat().st_mtime_ns
    synthesizer.run(RecordedBus(), config)
    assert kept.stat().st_mtime_ns == before


@pytest.mark.parametrize("parameters", [{"surfaze": {}}, {"surface": {"height": 1.0}}, {"movement": {"seeds": 1}}])
def test_refuses_unknown_parameters(parameters: dict) -> None:
    with pytest.raises(ValidationError):
        synthesizer.Config.model_validate(parameters)


def test_a_bad_model_file_ends_the_node_with_the_remedy(config: synthesizer.Config) -> None:
    path = config.movement.file
    assert path is not None
    path.write_bytes(path.read_bytes()[:5000])
    with pytest.raises(InputError, match=r"reaching.npz: expected a model file .* Remedy: train it again") as rejection:
        synthesizer.run(RecordedBus(), config)
    assert rejection.value.exit_code == 78
    path.unlink()
    with pytest.raises(InputError, match=r"there is no model file .*Remedy") as rejection:
        synthesizer.run(RecordedBus(), config)
    assert rejection.value.exit_code == 66


def test_recordings_of_people_that_are_not_there_end_the_node_with_the_remedy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("PARAMOVE_DATA", str(tmp_path / "none"))
    config = synthesizer.Config.model_validate({"robot": ROBOT_FOLDER, "movement": {"model": "table_reach"}})
    with pytest.raises(InputError, match=r"trained from recorded people: .*Remedy: put the data set") as rejection:
        synthesizer.run(RecordedBus(), config)
    assert rejection.value.exit_code == 66
