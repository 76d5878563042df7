"""`paramove train`: what it says, writes and refuses."""

import json
from dataclasses import replace

import numpy as np
import pytest

from paramove.demonstrations import DemonstrationSet
from paramove.phmm import InterpolativePHMM, LinearPHMM, MovementClassifier, ParametricHMM, QuadraticPHMM
from tests.cli.conftest import call
from tests.demonstrations.movements import a_set

QUICK = ("--states", 10, "--frames", 50)


def good(*arguments):
    done = call("train", *arguments)
    assert done.exit_code == 0, done.output
    return done


def rejected(code, *arguments):
    done = call("train", *arguments)
    assert (done.exit_code, done.stdout) == (code, ""), done.output
    assert "Traceback" not in done.stderr
    return " ".join(done.stderr.split())


def test_says_what_it_did(trained, tmp_path):
    done = good(trained.table, "--out", tmp_path / "model.npz", "--report", tmp_path / "page.html", *QUICK)
    assert "target_z is 0.07 in all movements: it is left out" in done.stderr
    for words in (
        "QuadraticPHMM, degree 2, correlated residuals",
        "27, 9 thetas,",
        "target_x, m: -0.07 to 0.23; target_y, m: -0.58 to 0.22",
        "10 of 4 to 6 frames; every movement resampled to 50 frames",
        "9 trainings, 27 movements tested, 12 of them outside the other thetas",
        "% of the 95 % regions hold the label",
        "after time warping",
    ):
        assert words in done.stdout
    page = (tmp_path / "page.html").read_text()
    assert page.count("data:image/png;base64,") == 3
    assert "The worst of them" in page


def test_numbers(trained, tmp_path):
    (facts,) = json.loads(good(trained.table, "--out", tmp_path / "model.npz", "--json", *QUICK).stdout)
    assert facts["action"] == "reaching"
    assert facts["sequences"] == facts["left_out"]["movements"] == 27
    assert facts["left_out"]["theta_median_m"] < 0.02
    assert facts["left_out"]["theta_covered"] > 0.8
    assert 0.01 < facts["left_out"]["synthesis_median_m"] < 0.08
    model = ParametricHMM.load(tmp_path / "model.npz")
    assert type(model) is QuadraticPHMM
    assert (model.n_states, model.d_min, model.d_max, model.resampled_frames) == (10, 4, 6, 50)
    about = model.description
    assert (about.action, about.parameter_names, about.rate_hz) == ("reaching", ("target_x", "target_y"), 60.0)
    assert about.source == "synthetic demonstrator, seed 0"


def test_regions_that_hold_less_than_they_promise_are_reported(trained, tmp_path):
    arguments = ("--out", tmp_path / "model.npz", "--residuals", "independent", *QUICK)
    assert (
        "% of the 95 % regions hold the label of a movement that was left out" in good(trained.table, *arguments).stdout
    )
    done = good(trained.table, *arguments, "--json")
    assert "reaching: only" in done.stderr
    assert json.loads(done.stdout)[0]["left_out"]["theta_covered"] < 0.85


def test_the_same_again_gives_the_same_file(trained, tmp_path):
    once, again = tmp_path / "once.npz", tmp_path / "again.npz"
    for file in (once, again, again):
        good(trained.table, "--out", file, "--leave-out", "none", *QUICK)
    assert once.read_bytes() == again.read_bytes()
    assert sorted(file.name for file in tmp_path.iterdir()) == [
        *("again.npz", "again.training.json", "once.npz", "once.training.json")
    ]


@pytest.mark.parametrize(
    ("kind", "expected"), [("linear", LinearPHMM), ("interpolative", InterpolativePHMM), ("best", QuadraticPHMM)]
)
def test_kinds(trained, tmp_path, kind, expected):
    good(trained.table, "--model", kind, "--out", tmp_path / "a.npz", "--leave-out", "none", *QUICK)
    assert type(ParametricHMM.load(tmp_path / "a.npz")) is expected


def test_residuals_of_the_thesis(trained, tmp_path):
    good(trained.table, "--residuals", "independent", "--out", tmp_path / "a.npz", "--leave-out", "none", *QUICK)
    assert ParametricHMM.load(tmp_path / "a.npz").performances_ is None


def test_several_actions_make_a_classifier(trained):
    assert sorted(file.name for file in trained.models.iterdir()) == [
        *("classifier.npz", "pointing.model.npz", "pointing.model.training.json"),
        *("reaching.model.npz", "reaching.model.training.json"),
    ]
    assert MovementClassifier.load(trained.models).classes_ == ("pointing", "reaching")


def test_one_action_of_several_into_a_folder(trained, tmp_path):
    good(trained.both, "--action", "pointing", "--out", tmp_path / "new", "--leave-out", "none", *QUICK)
    assert ParametricHMM.load(tmp_path / "new" / "pointing.npz").description.action == "pointing"


def test_seen_from_the_person(trained, tmp_path):
    good(trained.table, "--body", "--out", tmp_path / "a.npz", "--leave-out", "none", *QUICK)
    about = ParametricHMM.load(tmp_path / "a.npz").description
    assert about.frame == "body"
    assert about.parameter_names == ("target_x", "target_y")  # z varies by what the shoulder's place does


def test_refusals(trained, tmp_path):
    assert "make one with `paramove demos import`" in rejected(66, tmp_path)
    assert "there are the actions reaching" in rejected(78, trained.table, "--action", "waving")
    assert "did you mean 'target_x'?" in rejected(78, trained.table, "--parameters", "targetx")
    assert "choose one with --action" in rejected(2, trained.both, "--out", tmp_path / "a.npz")
    assert "fewer than 20 states" in rejected(78, trained.table, "--frames", 10)
    assert "there is only one subject: nothing can be left out" in rejected(
        78, trained.table, "--leave-out", "subject", "--out", tmp_path / "a.npz", *QUICK
    )


@pytest.mark.parametrize("name", ["../../outside", "/tmp/outside", "..", "a" * 300])
def test_an_action_whose_name_is_a_path_is_rejected_before_training(trained, tmp_path, monkeypatch, name):
    work = tmp_path / "deep" / "work"
    (work / "set").mkdir(parents=True)
    for file in trained.table.iterdir():
        (work / "set" / file.name).write_bytes(file.read_bytes())
    labels = work / "set" / "labels.yaml"
    labels.write_text(labels.read_text().replace("action: reaching", f"action: {name}"))
    monkeypatch.chdir(work)
    before = sorted(tmp_path.rglob("*"))
    assert "labels.yaml:" in rejected(78, "set", "--leave-out", "none", *QUICK)
    assert sorted(tmp_path.rglob("*")) == before


def test_one_theta_teaches_no_dependence(tmp_path):
    assert call("demos", "synthesize", tmp_path / "one", "--columns", 1, "--rows", 1).exit_code == 0
    said = rejected(78, tmp_path / "one", "--out", tmp_path / "a.npz")
    assert "all 4 movements have the same parameters" in said
    assert not (tmp_path / "a.npz").exists()


def test_points_are_named(tmp_path):
    a_set(subjects=("P1",), repetitions=1).write(tmp_path / "set")  # its shoulder never moves
    said = rejected(78, tmp_path / "set", "--out", tmp_path / "a.npz", *QUICK)
    assert "dimension" not in said
    assert "sternum_x has the value" in said


def test_an_interrupted_training_leaves_nothing(trained, tmp_path, monkeypatch):
    def interrupted(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(QuadraticPHMM, "fit", interrupted)
    assert "nothing was written" in rejected(130, trained.table, "--out", tmp_path / "a.npz")
    assert list(tmp_path.iterdir()) == []


def test_an_interrupted_check_leaves_the_model(trained, tmp_path, monkeypatch):
    def interrupted(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr("paramove.training.training.leave_out", interrupted)
    assert "but not its accuracy" in rejected(130, trained.table, "--out", tmp_path / "a.npz", *QUICK)
    assert np.isfinite(ParametricHMM.load(tmp_path / "a.npz").state_means([0.1, 0.0])).all()


def test_a_training_that_fails_leaves_the_good_model(trained, tmp_path, monkeypatch):
    file = tmp_path / "a.npz"
    good(trained.table, "--out", file, "--leave-out", "none", *QUICK)
    before = file.read_bytes()

    def failed(*arguments):
        raise ValueError("a fold cannot be trained")

    monkeypatch.setattr("paramove.training.training.leave_out", failed)
    assert "nothing was written" in rejected(78, trained.table, "--out", file, "--states", 8, "--frames", 50)
    assert file.read_bytes() == before
    assert sorted(one.name for one in tmp_path.iterdir()) == ["a.npz", "a.training.json"]


def test_odd_movements_are_named_and_spoiling_ones_rejected(trained, tmp_path):
    movements = list(DemonstrationSet.load(trained.table))
    odd = [replace(one, theta=movements[20].theta) if n == 4 else one for n, one in enumerate(movements)]
    DemonstrationSet(tuple(odd)).write(tmp_path / "label")
    done = good(tmp_path / "label", "--out", tmp_path / "a.npz", "--leave-out", "none", *QUICK)
    assert "is it labelled correctly" in done.stderr
    before = (tmp_path / "a.npz").read_bytes()
    odd = [replace(one, positions=1e3 * one.positions) if n == 4 else one for n, one in enumerate(movements)]
    DemonstrationSet(tuple(odd)).write(tmp_path / "unit")
    assert "millimetres" in rejected(78, tmp_path / "unit", "--out", tmp_path / "a.npz", *QUICK)
    assert (tmp_path / "a.npz").read_bytes() == before
