"""`paramove models`: lists, shows, draws and compares."""

import hashlib
import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from paramove.demonstrations import DemonstrationSet
from tests.cli.conftest import call


def good(*arguments):
    done = call("models", *arguments)
    assert done.exit_code == 0, done.output
    return done.stdout


def rejected(code, *arguments):
    done = call("models", *arguments)
    assert (done.exit_code, done.stdout) == (code, ""), done.output
    assert "Traceback" not in done.stderr
    return " ".join(done.stderr.split())


def test_list(trained):
    rows = json.loads(good("list", trained.model.parent, "--json"))
    assert [(row["file"], row["action"], row["sequences"]) for row in rows] == [
        (str(trained.models / "pointing.model.npz"), "pointing", 27),
        (str(trained.models / "reaching.model.npz"), "reaching", 27),
        (str(trained.model), "reaching", 27),
    ]
    assert "target_x, target_y" in good("list", trained.model.parent)


def test_list_of_nothing_and_of_damage(tmp_path, trained):
    assert "`paramove train` makes one" in rejected(66, "list", tmp_path)
    np.savez(tmp_path / "recording.npz", positions=np.zeros(3))
    assert "`paramove train` makes one" in rejected(66, "list", tmp_path)
    (tmp_path / "bad.npz").write_bytes(trained.model.read_bytes()[:2000])
    assert "bad.npz: expected a model file" in " ".join(call("models", "list", tmp_path).stderr.split())


def test_show(trained):
    text = good("show", trained.model)
    for words in (
        hashlib.sha256(trained.model.read_bytes()).hexdigest(),
        "QuadraticPHMM, degree 2, correlated residuals",
        "sternum, shoulder, elbow, wrist, knuckle, index, thumb",
        "m, demonstrator_table",
        "target_x, m: -0.07 to 0.23; target_y, m: -0.58 to 0.22",
        "recorded at 60 Hz",
        "27 sequences",
    ):
        assert words in text
    facts = json.loads(good("show", trained.model, "--json"))
    assert facts["states"] == len(facts["state_durations"]) == 20
    np.testing.assert_allclose(sum(facts["state_durations"]), facts["duration_s"], rtol=1e-6)
    assert facts["left_out"] is None


@pytest.mark.long
def test_show_tells_what_was_left_out_of_this_very_file(trained, tmp_path):
    file = tmp_path / "a.npz"
    quick = ("--states", 10, "--frames", 50)
    assert call("train", trained.table, "--model", "linear", "--out", file, *quick).exit_code == 0
    assert "9 trainings" in good("show", file)
    file.write_bytes(trained.model.read_bytes())  # another model under the same name
    assert "9 trainings" not in good("show", file)


def test_show_of_a_folder_with_several(trained, tmp_path):
    assert "give one model file" in rejected(78, "show", trained.models)
    assert "there is no model file" in rejected(66, "show", tmp_path / "none.npz")


@pytest.mark.parametrize("ending", ["png", "html"])
def test_plot(trained, tmp_path, ending):
    file = tmp_path / f"a.{ending}"
    assert good("plot", trained.model, "--output", file, "--point", "wrist").strip() == str(file)
    if ending == "png":
        with Image.open(file) as picture:
            assert len(picture.convert("L").getcolors()) > 100
    else:
        assert "data:image/png;base64," in file.read_text()
    assert "did you mean 'wrist'?" in rejected(78, "plot", trained.model, "--point", "wrst")


@pytest.fixture
def taller(trained, tmp_path):
    """Three movements of a person whose body is a tenth larger, and six of them to test with."""
    demonstrations = DemonstrationSet.load(trained.table)
    folders = tmp_path / "taller", tmp_path / "tested"
    for folder, numbers in zip(folders, (slice(0, 27, 10), slice(4, 27, 4)), strict=True):
        own = [
            replace(one, positions=1.1 * one.positions, subject="taller") for one in demonstrations.movements[numbers]
        ]
        replace(demonstrations, movements=tuple(own)).write(folder)
    return folders


def explained(model, folder):
    return json.loads(good("compare", model, model, "--on", folder, "--json"))["on"][0]


def test_adapted_to_a_person_movements_and_theta_are_theirs(trained, taller, tmp_path):
    own, tested = taller
    adapted = tmp_path / "own.npz"
    assert "adapted to taller by 3 movements" in good("adapt", trained.model, own, "--out", adapted)
    before, after = explained(trained.model, tested), explained(adapted, tested)
    assert after["synthesis_median_m"] < 0.8 * before["synthesis_median_m"]
    assert sum(after["theta_rms"].values()) < 0.8 * sum(before["theta_rms"].values())


def test_adapted_without_labels_only_synthesis_changes(trained, taller, tmp_path):
    own, tested = taller
    adapted = tmp_path / "own.npz"
    good("adapt", trained.model, own, "--out", adapted, "--no-labels")
    before, after = explained(trained.model, tested), explained(adapted, tested)
    assert after["theta_rms"] == before["theta_rms"]
    assert after["synthesis_median_m"] != before["synthesis_median_m"]


def test_adapt_refuses_several_persons_and_other_parameters(trained, taller, tmp_path):
    demonstrations = DemonstrationSet.load(trained.table)
    first, second, *_ = demonstrations.movements
    two = tmp_path / "two"
    replace(demonstrations, movements=(first, replace(second, subject="B"))).write(two)
    own = tmp_path / "own.npz"
    assert "one person" in rejected(78, "adapt", trained.model, two, "--out", own)
    assert "no movement with" in rejected(78, "adapt", trained.model, two, "--out", own, "--subject", "nobody")
    unlabelled = tmp_path / "unlabelled"
    names = tuple(f"other_{name}" for name in first.parameter_names)
    replace(demonstrations, movements=(replace(first, parameter_names=names),)).write(unlabelled)
    assert "--no-labels" in rejected(78, "adapt", trained.model, unlabelled, "--out", own)
    assert not own.exists()


def test_compare(trained, tmp_path):
    linear = tmp_path / "linear.npz"
    quick = ("--states", 10, "--frames", 50, "--leave-out", "none")
    assert call("train", trained.table, "--model", "linear", "--out", linear, *quick).exit_code == 0
    text = good("compare", trained.model, linear, "--on", trained.table)
    assert "same  sternum, shoulder" in text
    found = json.loads(good("compare", trained.model, linear, "--on", trained.table, "--json"))
    (zero, between), (back, _) = found["distances"]
    assert zero == {"rms_m": 0.0, "greatest_m": 0.0}
    assert between == back
    assert 0.002 < between["rms_m"] < between["greatest_m"] < 0.3
    quadratic, lines = found["on"]
    assert quadratic["log_likelihood_per_frame"] > lines["log_likelihood_per_frame"]
    assert quadratic["synthesis_median_m"] < lines["synthesis_median_m"]


def test_compare_refuses_what_cannot_be_compared(trained, tmp_path):
    assert "at least two" in rejected(2, "compare", trained.model)
    other = tmp_path / "other.npz"
    quick = ("--states", 10, "--frames", 50, "--leave-out", "none", "--parameters", "target_y")
    assert call("train", trained.table, "--out", other, *quick).exit_code == 0
    assert "differ in points or parameters" in rejected(78, "compare", trained.model, other)
