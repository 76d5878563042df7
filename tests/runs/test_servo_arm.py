"""Runs of a servo arm's tasks are judged by the recorded truth, and what has none is told why."""

from __future__ import annotations

import json
from pathlib import Path

import av
import numpy as np
import pytest
from rich.console import Console

from paramove.bus import topics
from paramove.msgs.truth_pb2 import TruthState
from paramove.recording.parts import next_part
from paramove.recording.writer import RecordingWriter
from paramove.robots import RobotDescription
from paramove.runs import servo_arm
from paramove.runs.servo_arm_film import FilmedArm, scene_of, write_film
from tests.recording.small_disk import fill, small_disk

TASKS = "parameters: {tasks: [{reach: [0.2, 0.0, 0.1]}, {pick: [0.1, 0.1, 0.02], place: [0.2, 0.1, 0.02]}]}\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "nodes").mkdir()
    (tmp_path / "nodes" / "reacher.yaml").write_text(TASKS)
    (tmp_path / "nodes" / "judge.yaml").write_text("parameters: {}\n")
    return tmp_path


def record(folder: Path, gripper: tuple[float, ...], cube_x: float, name: str = "red_cube") -> None:
    state = TruthState(gripper=gripper)
    if name:
        state.objects.add(name=name, x=cube_x, y=0.1, z=0.02)
    with RecordingWriter(next_part(folder / "truth.mcap"), "test") as recording:
        number = len(list(folder.glob("truth*")))
        recording.write(topics.TRUTH_STATE.name, state, number, number, number)


def test_a_run_is_judged_by_its_truth_even_if_the_judge_was_started_again(folder: Path) -> None:
    record(folder, (0.2, 0.0, 0.104), 0.1)
    record(folder, (0.1, 0.0, 0.104), 0.205)
    assert servo_arm.main([str(folder), "--no-video"]) == 0
    summary = json.loads((folder / "run.json").read_text())
    assert [one["error"] for one in summary["tasks"]] == pytest.approx([0.004, 0.005])
    assert summary["gaps"] == [{"recording": "truth", "begin_s": pytest.approx(1e-9), "end_s": pytest.approx(2e-9)}]
    assert (folder / "tasks.png").is_file()
    assert "2 of 2 tasks done" in (folder / "report.html").read_text()


@pytest.mark.parametrize("name", ["cube", "none", "$x_{", "[/red]", "_hidden", "0.5", "<b>"])
def test_an_object_may_have_any_name(folder: Path, name: str) -> None:
    record(folder, (0.2, 0.0, 0.104), 0.2, name)
    assert servo_arm.main([str(folder), "--no-video"]) == 0
    assert (folder / "tasks.png").is_file()


def test_a_scene_without_an_object_is_named(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    record(folder, (0.2, 0.0, 0.104), 0.2, "")
    assert servo_arm.main([str(folder), "--no-video"]) == 66
    assert "free joint" in "".join(capsys.readouterr())


def test_a_gap_counts_from_the_begin_of_the_run(folder: Path) -> None:
    (folder / "run.yaml").write_text("begun_ns: 1\n")
    record(folder, (0.2, 0.0, 0.104), 0.1)
    record(folder, (0.1, 0.0, 0.104), 0.205)
    assert servo_arm.main([str(folder), "--no-video"]) == 0
    gap = {"recording": "truth", "begin_s": pytest.approx(0.0), "end_s": pytest.approx(1e-9)}
    assert json.loads((folder / "run.json").read_text())["gaps"] == [gap]


def test_without_room_for_the_numbers_the_reason_is_told_and_the_run_can_be_judged_later(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with small_disk(tmp_path / "disk", 2) as disk:
        (disk / "nodes").mkdir()
        (disk / "nodes" / "reacher.yaml").write_text(TASKS)
        record(disk, (0.2, 0.0, 0.104), 0.205)
        filler = fill(disk)
        assert servo_arm.main([str(disk), "--no-video"]) == 1
        said = capsys.readouterr().err
        assert "No space left on device" in said
        assert f"python -m paramove.runs.servo_arm {disk}" in said
        filler.unlink()
        servo_arm.main([str(disk), "--no-video"])
        assert (disk / "run.json").is_file()


def test_the_truth_of_a_judge_that_was_killed_counts_as_far_as_it_goes(folder: Path) -> None:
    record(folder, (0.2, 0.0, 0.104), 0.1)
    (folder / "truth.mcap").rename(folder / "truth.mcap.part")
    assert servo_arm.main([str(folder), "--no-video"]) == 3
    assert json.loads((folder / "run.json").read_text())["good"] == 1


def test_an_emulated_run_that_failed_at_its_start_is_told_as_such(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert servo_arm.main([str(folder), "--no-video"]) == 66
    assert "before the emulated arm published a state" in capsys.readouterr().err
    (folder / "nodes" / "judge.yaml").unlink()
    assert servo_arm.main([str(folder), "--no-video"]) == 66
    assert "only emulated runs, which have a node judge, write one" in capsys.readouterr().err
    assert servo_arm.main([str(folder / "none")]) == 66
    assert "no run folder" in capsys.readouterr().err


def test_the_film_shows_the_recorded_states(tmp_path: Path) -> None:
    robot = RobotDescription.load(Path("robot_description/koch_v1_1"))
    states = [TruthState(time_ns=round(t * 1e9), joint_positions=robot.base_pose + 0.5 * t) for t in (0.0, 0.1, 0.2)]
    for state in states:
        state.objects.add(name="red_cube", x=0.1, y=0.1, z=0.01, quaternion_xyzw=(0.0, 0.0, 0.0, 1.0))
    path = write_film(tmp_path, robot.name, scene_of(robot), [FilmedArm(robot, states)], Console(quiet=True))
    assert path is not None
    with av.open(str(path)) as film:
        pictures = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
    assert len(pictures) == 6
    assert pictures[0].shape == (720, 1280, 3)
    assert np.abs(pictures[-1].astype(float) - pictures[0]).max() > 100, "the arm moves"
