"""The imitation experiment on one demonstrator: its goals, its command, its files."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from paramove.demonstrations.reaching import reaching_grid_demonstrations
from paramove.documents import exit_codes
from paramove.hmm import TrainingOptions
from paramove.hmm.sequences import resample
from paramove.phmm.interpolative import synchronised
from studies.__main__ import app
from studies.imitation.experiment import (
    CENTRE,
    THESIS_TARGETS,
    Experiment,
    Setup,
    numbers_of,
    run_experiment,
)
from studies.imitation.reasons import limit_uses, why
from studies.imitation.reference import References
from studies.imitation.report import write_results
from studies.imitation.thesis import compared
from tests.motion.reaching import ROBOT_FOLDER, reaching_model, solver


@cache
def experiment() -> Experiment:
    return run_experiment(Setup(ROBOT_FOLDER, seeds=(0,), repetitions=20, with_grid=False))


@cache
def numbers() -> dict[tuple[str, str], dict[str, float]]:
    """Median (here: only) numbers of each target and kind of reference, mm."""
    places = numbers_of(experiment())["places"]
    return {
        (one["place"], one["reference"]): {name: value["median"] for name, value in one["mm"].items()} for one in places
    }


def test_the_global_model_trained_again_gives_the_local_models() -> None:
    """References of the kind "global" are set up by the same global model as the corners."""
    model = reaching_model()
    references = References.of(model, seed=0, repetitions=4)
    demonstrations = reaching_grid_demonstrations(np.random.default_rng(0)).sequences[:10]
    frames = [resample(sequence, model.resampled_frames or 200) for sequence in demonstrations]
    assert references.everything is not None
    first = synchronised(references.everything, [frames], TrainingOptions(), 1)[0]
    np.testing.assert_allclose(first.means, model.means_[0], rtol=0, atol=1e-12)


@pytest.mark.parametrize("target", [target.name for target in THESIS_TARGETS])
def test_the_gripper_keeps_the_goals_of_the_thesis(target: str) -> None:
    errors = numbers()[target, "own"]
    assert errors["gripper"] < 8.0
    assert errors["gripper_at_target"] < 2.0


def test_the_effective_error_of_the_elbow_is_about_that_of_the_thesis() -> None:
    """Below 6 mm there; ours is a little above at the centre, where the hand passes near the shoulder."""
    assert numbers()["right side", "own"]["effective"] < 7.0
    assert numbers()["centre", "own"]["effective"] < 9.0
    assert numbers()["centre", "own"]["effective_at_target"] < 5.0


def test_an_elbow_interpolated_as_part_of_an_arm_is_nearer() -> None:
    errors = numbers()["centre", "own"]
    assert errors["elbow"] < 12.0
    assert errors["elbow_linear"] > 25.0


def test_synthesis_adds_little_to_the_imitation_error_that_no_mapping_avoids() -> None:
    for target in THESIS_TARGETS:
        errors = numbers()[target.name, "own"]
        assert errors["imitation_excess"] < 6.0
        assert errors["imitation"] < errors["least_imitation"] + 6.0


def test_the_closed_form_puts_the_reference_elbow_as_near_as_can_be() -> None:
    """No turn about the shoulder-gripper line comes nearer to the person's elbow (5.10)-(5.13)."""
    reference = experiment().of(CENTRE)[0].against
    person, robot = reference.proposed.elbow, reference.closed_form.elbow
    line = reference.proposed.gripper / np.linalg.norm(reference.proposed.gripper, axis=1, keepdims=True)
    best = np.linalg.norm(robot - person, axis=1)
    for angle in np.deg2rad([-40.0, -5.0, -0.5, 0.5, 5.0, 40.0]):
        along = np.sum(robot * line, axis=1, keepdims=True) * line
        turned = along + np.cos(angle) * (robot - along) + np.sin(angle) * np.cross(line, robot - along)
        assert (np.linalg.norm(turned - person, axis=1) >= best - 1e-12).all()


def test_the_arm_keeps_out_of_the_reach_that_its_elbow_does_not_have() -> None:
    movement = experiment().of(CENTRE)[0].synthesised
    assert np.linalg.norm(movement.proposed.gripper, axis=1).min() < solver().reach[0]
    assert np.linalg.norm(movement.within_limits.gripper, axis=1).min() >= solver().reach[0]
    uses = {(use.target.name, use.joint): use for use in limit_uses(experiment())}
    use = uses["centre", "right_elbow"]
    assert 5.0 < use.outside_deg < 20.0
    assert use.gripper_moved_mm > 10.0


def test_every_missed_goal_has_a_reason() -> None:
    rows = compared(numbers_of(experiment()))
    missed = {(one.row.text.split(",")[0].split()[0], one.row.target.name) for one in rows if one.met is False}
    sentences = why(experiment())
    for word, target in missed:
        assert any(word in detail.lower() and target in detail for detail in sentences), (word, target)


def test_the_report_needs_no_other_file(tmp_path: Path) -> None:
    written = write_results(experiment(), tmp_path)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "http://" not in page
    assert "https://" not in page
    assert "src='data:image/png;base64," in page
    assert page.count("<img") == len(list(tmp_path.glob("*.png"))) == 4
    stored = json.loads((tmp_path / "imitation.json").read_text(encoding="utf-8"))
    assert stored == json.loads(json.dumps(written))
    assert {goal["what"] for goal in stored["goals"]} == {
        "gripper, synthesis error",
        "gripper at the target",
        "elbow, effective error",
        "imitation error",
    }


def test_the_command_prints_the_thesis_beside_ours(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("studies.imitation.experiment.run_experiment", lambda *_: experiment())
    done = CliRunner().invoke(app, ["imitation", "--seeds", "0", "--report", str(tmp_path)])
    assert done.exit_code in (0, exit_codes.JUDGED_A_FAILURE), done.output
    assert "gripper at the target" in done.output
    assert "up to 25" in done.output
    assert str(tmp_path) in done.output.replace("\n", "")


@pytest.mark.long
def test_the_old_option_works_with_a_warning(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with_grid = []

    def run(setup: Setup, progress: Callable[[str], None]) -> Experiment:
        with_grid.append(setup.with_grid)
        return experiment()

    monkeypatch.setattr("studies.imitation.experiment.run_experiment", run)
    for option in ("--no-raster", "--no-grid"):
        done = CliRunner().invoke(app, ["imitation", "--seeds", "0", option, "--report", str(tmp_path)])
        assert ("--no-raster" in done.stderr and "--no-grid" in done.stderr) == (option == "--no-raster")
    assert with_grid == [False, False]


def test_the_command_rejects_seeds_that_are_none() -> None:
    done = CliRunner().invoke(app, ["imitation", "--seeds", "many"])
    assert done.exit_code == 2
