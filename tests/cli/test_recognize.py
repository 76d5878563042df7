"""`paramove recognize` and `paramove synthesize`: what one makes, the other knows again."""

import json

import numpy as np
import pytest
from PIL import Image

from paramove.demonstrations.pose_recording import read_poses
from tests.cli.conftest import call

THETA = "0.1,-0.1"


def good(*arguments):
    done = call(*arguments)
    assert done.exit_code == 0, done.output
    return done.stdout


def rejected(code, *arguments):
    done = call(*arguments)
    assert (done.exit_code, done.stdout) == (code, ""), done.output
    assert "Traceback" not in done.stderr
    return " ".join(done.stderr.split())


@pytest.fixture
def made(trained, tmp_path):
    """A synthesised movement in each kind of file."""
    for ending in ("csv", "npz", "mcap"):
        good("synthesize", trained.model, "--theta", THETA, "--out", tmp_path / f"made.{ending}")
    return tmp_path


@pytest.mark.parametrize(("ending", "more"), [("csv", ("--unit", "m")), ("npz", ()), ("mcap", ())])
def test_what_was_made_is_known_again(trained, made, ending, more):
    text = good("recognize", made / f"made.{ending}", "--model", trained.model, *more, "--json")
    (found,) = json.loads(text)["movements"]
    assert found["action"] == "reaching"
    np.testing.assert_allclose(list(found["theta"].values()), [0.1, -0.1], rtol=0, atol=0.01)
    assert found["p_value"] > 0.05
    assert found["typicality"] == found["p_value"]  # for one release
    assert found["theta_outside_bounds"] == []


def test_words_for_one_movement(trained, made):
    text = good("recognize", made / "made.npz", "--model", trained.model)
    assert "reaching, the only one that was asked" in text
    assert "(95 %)" in text
    text = good("recognize", made / "made.npz", "--model", trained.models)
    assert "action:         reaching" in text
    assert "pointing" in text


def test_a_set_is_recognised_with_its_confusion(trained, tmp_path):
    picture = tmp_path / "all.png"
    text = good("recognize", trained.both, "--model", trained.models, "--plot", picture)
    assert "of 54 right" in text
    assert "labels lie in the 95 % region" in text
    found = json.loads(good("recognize", trained.both, "--model", trained.models, "--json"))
    assert sum(found["confusion"]["pointing"].values()) == sum(found["confusion"]["reaching"].values()) == 27
    assert found["confusion"]["pointing"]["pointing"] > 24
    inside = [one["labelled_theta_in_region"] for one in found["movements"]]
    assert np.mean(inside) > 0.8
    with Image.open(picture) as shown:
        assert len(shown.convert("L").getcolors()) > 100


def test_models_one_by_one_compete_too(trained, tmp_path):
    files = [
        argument for name in ("pointing", "reaching") for argument in ("--model", trained.models / f"{name}.model.npz")
    ]
    found = json.loads(good("recognize", trained.table, *files, "--json"))
    assert found["confusion"]["reaching"]["reaching"] > 24
    twice = ("--model", trained.model, "--model", trained.models / "reaching.model.npz")
    assert "both models of 'reaching'" in rejected(78, "recognize", trained.table, *twice)


def test_models_of_different_kinds_do_not_compete(trained, tmp_path):
    more = ("--action", "pointing", "--residuals", "independent", "--leave-out", "none")
    good("train", trained.both, "--out", tmp_path / "pointing.npz", *more)
    said = rejected(78, "recognize", trained.table, "--model", trained.model, "--model", tmp_path / "pointing.npz")
    assert "all with correlated residuals, or all with the same states" in said


def test_beginnings(trained, tmp_path):
    for number, keep in enumerate((40, 2)):
        rows = good("synthesize", trained.model, "--theta", THETA).splitlines()
        (tmp_path / f"{number}.csv").write_text("\n".join(rows[: 1 + keep]) + "\n")
    asked = ("--model", trained.models, "--unit", "m", "--unfinished", "--json")
    (found,) = json.loads(good("recognize", tmp_path / "0.csv", *asked))["movements"]
    assert found["most_probable_action"] in found["posterior"]
    assert "a beginning has at least" in rejected(78, "recognize", tmp_path / "1.csv", *asked)


def test_a_strange_movement_is_none_of_the_known(trained, tmp_path):
    rows = [line.split(",") for line in good("synthesize", trained.model, "--theta", THETA).splitlines()]
    there_only = [rows[0]] + rows[1:60] + [[*row[:1], *rows[60][1:]] for row in rows[60:]]  # stops on its way
    (tmp_path / "stopped.csv").write_text("\n".join(map(",".join, there_only)) + "\n")
    text = good("recognize", tmp_path / "stopped.csv", "--unit", "m", "--model", trained.model)
    assert "none of the known ones; the nearest is reaching" in text


def test_movements_are_found_by_speed(trained):
    asked = ("--find", "index", "--model", trained.model, "--json")
    found = json.loads(good("recognize", trained.table / "reaching.mcap", *asked))
    assert len(found["movements"]) >= 27
    assert found["confusion"] is None
    assert all(0.2 < one["seconds"] < 5.0 for one in found["movements"])


def test_labels_beside_a_recording_count(trained):
    text = good("recognize", trained.table / "reaching.mcap", "--model", trained.model, "--json")
    assert len(json.loads(text)["movements"]) == 27


def test_seen_from_the_person(trained, tmp_path):
    quick = ("--states", 10, "--frames", 50, "--leave-out", "none")
    good("train", trained.table, "--body", "--out", tmp_path / "body.npz", *quick)
    found = json.loads(good("recognize", trained.table, "--model", tmp_path / "body.npz", "--json"))
    assert np.mean([one["action"] == "reaching" for one in found["movements"]]) > 0.9
    made = tmp_path / "made.mcap"
    good("synthesize", tmp_path / "body.npz", "--theta", "0.3,0.1", "--out", made)
    said = rejected(78, "recognize", made, "--model", trained.model)
    assert "in the frame 'body', those of the model in 'demonstrator_table'" in said


def test_refusals_of_recognize(trained, made, tmp_path):
    model = ("--model", trained.model)
    assert "there is no file" in rejected(66, "recognize", tmp_path / "none.csv", *model)
    assert "there is no model file" in rejected(66, "recognize", made / "made.npz", "--model", tmp_path / "none.npz")
    assert "there is no model in" in rejected(66, "recognize", made / "made.npz", "--model", tmp_path / "..")
    assert "expected m, cm or mm" in rejected(2, "recognize", made / "made.csv", *model, "--unit", "ft")
    (tmp_path / "few.csv").write_text("time,wrist_x,wrist_y,wrist_z\n0,1,1,1\n0.1,1,1,1\n")
    said = rejected(78, "recognize", tmp_path / "few.csv", *model, "--unit", "m")
    assert "missing are sternum" in said
    assert "--mapping" in said


def test_synthesize_writes_csv_to_standard_output(trained):
    lines = good("synthesize", trained.model, "--theta", THETA, "--frames", 5, "--duration", 2).splitlines()
    assert lines[0].startswith("time,sternum_x,sternum_y,sternum_z,shoulder_x")
    assert [float(line.split(",")[0]) for line in lines[1:]] == [0.0, 0.5, 1.0, 1.5, 2.0]


def test_synthesized_recording(trained, made):
    poses = read_poses(made / "made.mcap")
    assert poses.frame == "demonstrator_table"
    assert poses.point_names[-1] == "thumb"
    np.testing.assert_allclose(np.median(np.diff(poses.time)), 1 / 60, rtol=0, atol=1e-3)
    assert "recordings are never overwritten" in rejected(
        2, "synthesize", trained.model, "--theta", THETA, "--out", made / "made.mcap"
    )


def test_synthesize_draws(trained, tmp_path):
    file = tmp_path / "a.png"
    assert good("synthesize", trained.model, "--theta", THETA, "--plot", file).strip() == str(file)
    with Image.open(file) as picture:
        assert len(picture.convert("L").getcolors()) > 100


def test_theta_outside_is_told(trained, tmp_path):
    done = call("synthesize", trained.model, "--theta", "0.1,-0.9", "--out", tmp_path / "a.csv")
    assert done.exit_code == 0
    assert "the movement is extrapolated: target_y, m: -0.58 to 0.22" in done.stderr


def test_refusals_of_synthesize(trained, tmp_path):
    said = rejected(78, "synthesize", trained.model, "--theta", "0.1")
    assert "theta has 2 components (target_x, m: -0.07 to 0.23" in said
    assert "expected numbers" in rejected(2, "synthesize", trained.model, "--theta", "a,b")
    assert "end in .csv, .npz, .mcap" in rejected(2, "synthesize", trained.model, "--theta", THETA, "--out", "a.txt")
    assert "there is no model file" in rejected(66, "synthesize", tmp_path / "none.npz", "--theta", THETA)
