"""The robot's movement from recorded people: trained once, kept, and refused with what would help."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from paramove.demonstrations.recorded_people import Recordings, load_recordings
from paramove.motion import recorded_reaching
from paramove.motion.modelled_movement import ModelledMovement, robot_movement
from paramove.motion.reaching_file import check_reaching_model
from paramove.motion.recorded_reaching import people_model, train_people_model
from paramove.motion.relocation import RelocationPlanner
from paramove.phmm import ModelFileError, PolynomialPHMM
from tests.demonstrations.synthetic_recordings import write_table
from tests.motion.reaching import ARM, GRASP_Z, HOAP3, at, solver

DATA = Path(os.environ.get("PARAMOVE_DATA") or Path(__file__).parents[3] / "shared" / "data")
NAME = "table_reach"


@pytest.fixture
def recorded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of recordings, made up, with the actions that are asked for."""
    folder = tmp_path / "data"
    write_table(folder)
    with np.load(folder / NAME / "data.npz") as file:
        arrays = dict(file)
    arrays["flat"] += np.random.default_rng(1).normal(0.0, 1.0, arrays["flat"].shape).astype(np.float32)  # mm
    np.savez(folder / NAME / "data.npz", **arrays)
    monkeypatch.setenv("PARAMOVE_DATA", str(folder))
    monkeypatch.setattr(recorded_reaching, "ACTIONS", ("forward",))
    monkeypatch.setattr(recorded_reaching, "N_STATES", 10)
    return folder


def test_is_trained_once_and_kept(recorded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = people_model(NAME, tmp_path)
    assert first.description is not None
    assert (first.description.arrival, first.description.frame, first.degree) == (1.0, "body", 1)
    assert "table_reach, forward, sha256" in first.description.source
    assert [path.name for path in tmp_path.glob("*.npz")] == ["reaching_table_reach.npz"]

    def trained(*_: object, **__: object) -> None:
        raise InterruptedError("trained again")

    monkeypatch.setattr(recorded_reaching, "train_people_model", trained)
    np.testing.assert_array_equal(people_model(NAME, tmp_path).coefficients_, first.coefficients_)
    (recorded / NAME / "data.npz").unlink()  # the kept model serves where there are no recordings any more
    np.testing.assert_array_equal(people_model(NAME, tmp_path).coefficients_, first.coefficients_)
    monkeypatch.setattr(recorded_reaching, "code_digest", lambda *modules: "of another day")
    with pytest.raises(ModelFileError, match="is trained from recorded people"):
        people_model(NAME, tmp_path)


def test_other_recordings_and_a_damaged_file_train_again(
    recorded: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    first = people_model(NAME, tmp_path)
    kept = tmp_path / "reaching_table_reach.npz"
    kept.write_bytes(kept.read_bytes()[:3000])
    again = people_model(NAME, tmp_path)
    assert "training again, the cached model does not fit" in caplog.text
    assert first.description == again.description
    with (recorded / NAME / "data.npz").open("ab") as file:
        file.write(b"\0")
    other = people_model(NAME, tmp_path)
    assert other.description is not None
    assert first.description is not None
    assert other.description.source != first.description.source
    assert people_model(NAME, None).description == other.description


def test_without_recordings_it_is_told_what_would_help(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PARAMOVE_DATA", str(tmp_path / "none"))
    with pytest.raises(ModelFileError, match=r"'table_reach' is trained from recorded people: .*Remedy: put the") as no:
        people_model(NAME, tmp_path)
    assert no.value.missing
    assert "PARAMOVE_DATA" in str(no.value)
    assert "by the node's parameter movement.file" in str(no.value)


def test_recordings_of_something_else_are_refused(recorded: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorded_reaching, "ACTIONS", ("juggling",))
    with pytest.raises(
        ModelFileError, match=r"table_reach has the actions .*; found \['juggling'\]. Remedy"
    ) as rejection:
        people_model(NAME, None)
    assert not rejection.value.missing


needs_people = pytest.mark.skipif(not DATA.is_dir(), reason=f"needs the recordings of people in {DATA} (PARAMOVE_DATA)")


@pytest.fixture(scope="module")
def people() -> Recordings:
    return load_recordings(NAME, DATA)


@pytest.fixture(scope="module")
def model(people: Recordings) -> PolynomialPHMM:
    return train_people_model(people, n_states=20)


@needs_people
def test_real_people_move_the_robots_hand_to_the_place(model: PolynomialPHMM) -> None:
    check_reaching_model(model)
    movement = robot_movement(model, solver().length)
    assert isinstance(movement, ModelledMovement)
    strip = np.array([(x, y, -0.098) for x in (0.17, 0.185) for y in (-0.09, 0.0, 0.06)])
    parameters = movement.parameter_for(movement.reach_state, strip)
    reached = movement.poses_of_state(movement.reach_state, parameters).gripper
    np.testing.assert_allclose(reached, strip, rtol=0, atol=1e-6)


@needs_people
def test_left_of_the_shoulder_is_within_their_training_and_right_of_it_is_not(model: PolynomialPHMM) -> None:
    """They touched what is before their shoulder, and across before the other one."""
    movement = robot_movement(model, solver().length)
    assert movement.within_training([0.18, 0.03, -0.098]) is True
    assert movement.within_training([0.18, -0.08, -0.098]) is False
    assert movement.within_training([0.135, 0.019, -0.098]) is False


@needs_people
def test_motions_whose_elbow_turns_at_a_limit_stay_within_it(model: PolynomialPHMM) -> None:
    planner = RelocationPlanner(robot_movement(model, solver().length), solver(), HOAP3, ARM)
    held = at((0.173, -0.0587), GRASP_Z + planner.options.lift)
    angles = planner.deliver(held, at((0.12774, -0.093111))).angles[:, :5]
    assert (angles < HOAP3.soft_upper[ARM.indices]).all()
    assert (angles > HOAP3.soft_lower[ARM.indices]).all()
