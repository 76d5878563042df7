"""The simulator's loop on a real bus, and the judge's file."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from pydantic import ValidationError

from paramove.bus import topics
from paramove.bus.bus import Bus
from paramove.bus.settings import BusSettings
from paramove.msgs.truth_pb2 import TruthState
from paramove.recording.parts import PartedRecording
from paramove.recording.writer import RecordingWriter
from sim import judge, simulator
from sim.judge import Judge
from sim.simulation import Simulation
from sim.world import SimulationError
from tests.sim.conftest import ROBOT, simulated


@pytest.fixture
def folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="pm", dir="/tmp") as path:  # paths of sockets are short
        yield Path(path)


def truth_of(simulation: Simulation) -> TruthState:
    return simulation.shown()[topics.TRUTH_STATE]


def _bus(folder: Path) -> Bus:
    for name in ("bus", "truth"):
        (folder / name).mkdir(mode=0o700)
    settings = BusSettings(folder=folder / "bus", truth_folder=folder / "truth", clock="simulated")
    return Bus("simulator", settings, simulator.SUBSCRIBES, simulator.PUBLISHES, folder)


def test_runs_to_its_longest_duration_and_says_every_topic_at_15_hz(folder: Path) -> None:
    with _bus(folder) as bus:
        simulator.run(bus, simulator.Config(seed=1, robot=ROBOT, camera=False, max_duration_s=1.0, pace=1000.0))
        said = {name: publisher.sequence for name, publisher in bus.exchange.publishers.items()}
    assert said["clock"] == said["truth/state"] == said["wire/hoap3/state"] == 15
    assert said["truth/layout"] == 1
    assert said["camera/image_raw"] == said["truth/view"] == 0
    assert bus.now_ns == 934_000_000  # of the newest beat


def test_a_state_that_is_not_finite_is_never_published(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(self: Simulation, tick: int) -> None:
        if tick == 4:
            raise SimulationError("velocity of joint right_elbow is not finite")

    monkeypatch.setattr(Simulation, "run_to_tick", fail)
    with _bus(folder) as bus:
        with pytest.raises(SimulationError, match="right_elbow"):
            simulator.run(bus, simulator.Config(robot=ROBOT, camera=False, max_duration_s=1.0, pace=1000.0))
        assert bus.exchange.publishers["truth/state"].sequence == 4


@pytest.mark.parametrize(
    "parameters",
    [
        {"seed": -1},
        {"pace": 0.0},
        {"max_duration_s": -1.0},
        {"sed": 1},
        {"scene": "kitchen"},
        {"targets": 3},
        {"scene": "pointing", "video": True},
        {"scene": "rule_learning", "arm_image_every": 2},
    ],
)
def test_wrong_parameters_are_refused(parameters: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        simulator.Config.model_validate(parameters)


def test_only_evaluators_hear_of_the_truth() -> None:
    assert all(topic.truth for topic in judge.SUBSCRIBES)
    assert judge.PUBLISHES == ()
    assert topics.TRUTH_STATE not in simulator.SUBSCRIBES


def test_judge_writes_a_verdict_that_can_be_read_at_any_time(folder: Path) -> None:
    simulation = simulated("rule_learning", 3)
    file = folder / "truth.json"
    found = Judge(file)
    assert not found.write()["success"]
    assert found.take(truth_of(simulation)) == ""  # not told the layout yet
    found.begin(simulation.layout())
    sentences = []
    for tick in range(1, judge.RENEW_STATES + 1):
        simulation.run_to_tick(min(tick, 5))
        sentences.append(found.take(truth_of(simulation)))
    assert sentences[-1] == "0 of 3 objects rest where the robot should put them"
    assert not any(sentences[:-1])
    summary = json.loads(file.read_text(encoding="utf-8"))
    assert summary["seed"] == 3
    assert summary["unwanted_contacts"] == 0
    assert set(summary["objects"]) == {"yellow", "green", "blue"}
    assert summary["realtime_factor"] > 0


def test_judge_that_was_started_again_recalls_what_was_recorded(folder: Path) -> None:
    simulation = simulated("rule_learning", 3)
    told, path = simulation.layout(), folder / "truth.mcap"
    whole, first, second = (Judge(folder / f"{name}.json") for name in ("whole", "first", "second"))
    with RecordingWriter(path, "a test") as recording:
        for judged in (whole, first):
            judged.begin(told)
        recording.write(topics.TRUTH_LAYOUT.name, told, 0, 0, 1)
        for tick in range(1, 9):
            simulation.run_to_tick(tick)
            truth = truth_of(simulation)
            recording.write(topics.TRUTH_STATE.name, truth, tick, tick, tick)
            whole.take(truth)
    assert second.recall(PartedRecording(path)) == 8
    second.begin(told)  # is said to every newcomer
    simulation.run_to_tick(9)
    for judged in (whole, second):
        judged.take(truth_of(simulation))
    by_wall = ("begun_monotonic_s", "wall_s", "realtime_factor")
    found, expected = ({k: v for k, v in judged.write().items() if k not in by_wall} for judged in (second, whole))
    assert found == expected
    assert not first.recall(PartedRecording(folder / "none.mcap"))
