"""`paramove demos`: what each command prints and writes, and its exit codes."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from paramove.cli.main import build
from paramove.demonstrations.demonstration_set import DemonstrationSet
from tests.demonstrations.movements import POINTS, a_set, reach


def run(*arguments):
    return CliRunner().invoke(build("demos"), ["demos", *map(str, arguments)])


def good(*arguments):
    done = run(*arguments)
    assert done.exit_code == 0, done.output
    return done.stdout


def rejected(code, *arguments):
    done = run(*arguments)
    assert (done.exit_code, done.stdout) == (code, ""), done.output
    assert "Traceback" not in done.stderr
    return done.stderr


@pytest.fixture
def folder(tmp_path):
    a_set().write(tmp_path / "reach")
    return tmp_path / "reach"


@pytest.fixture
def csv(tmp_path):
    time, positions = reach((0.4, 0.1, -0.1))
    names = [f"{point}_{axis}" for point in POINTS for axis in "xyz"]
    rows = np.concatenate([time[:, None], 1000 * (1.0 + positions.reshape(len(time), -1))], axis=1)
    file = tmp_path / "take.csv"
    np.savetxt(file, rows, delimiter=",", header=",".join(["time", *names]), comments="")
    return file


def test_list(folder):
    assert json.loads(good("list", folder.parent, "--json")) == [
        {
            "set": str(folder),
            "segments": 12,
            "recordings": 2,
            "actions": ["reaching"],
            "subjects": ["P1", "P2"],
            "parameters": ["target_x", "target_y", "target_z"],
        }
    ]
    assert "P1, P2" in good("list", folder)
    (folder / "labels.yaml").write_text("segments: 3")
    done = run("list", folder.parent)
    assert done.exit_code == 78
    assert "labels.yaml:1:1: segments: expected a list" in done.stderr


def test_list_of_nothing(tmp_path):
    assert "make one with `paramove demos import`" in rejected(66, "list", tmp_path)


def test_show(folder):
    text = good("show", folder)
    assert "points:      sternum, shoulder, elbow, wrist, index" in text
    assert [line.split() for line in text.splitlines()[-2:]] == [
        ["reaching", "P1", "6", "3", "546", "50", "1.8", "1.8"],
        ["reaching", "P2", "6", "3", "546", "50", "1.8", "1.8"],
    ]
    assert len(good("show", folder, "--segments").splitlines()) == 6 + 1 + 12
    facts = json.loads(good("show", folder, "--json"))
    assert facts["movements"] == len(facts["segments"]) == 12
    assert facts["groups"][0]["frames"] == 546


def test_show_tells_what_is_wrong(folder):
    (folder / "P2.mcap").unlink()
    said = rejected(78, "show", folder)
    assert "labels.yaml:9:6: there is no recording P2.mcap" in said
    assert "there is no" in rejected(66, "show", folder / "nothing")


@pytest.mark.parametrize(("name", "magic"), [("a.png", b"\x89PNG"), ("a.svg", b"<?xml"), ("a.html", b"<!doctype html")])
def test_plot(folder, tmp_path, name, magic):
    assert good("plot", folder, "--output", tmp_path / name).strip() == str(tmp_path / name)
    assert (tmp_path / name).read_bytes().startswith(magic)


def test_plot_of_what_is_not_there(folder, tmp_path):
    out = ("--output", tmp_path / "a.png")
    assert "there is no point 'thumb'" in rejected(78, "plot", folder, *out, "--point", "thumb")
    assert "no movement with action waving" in rejected(78, "plot", folder, *out, "--action", "waving")
    assert "there is no parameter 'height'" in rejected(78, "plot", folder, *out, "--colour-by", "height")
    assert "pictures end in .png" in rejected(78, "plot", folder, "--output", tmp_path / "a.gif")
    assert "No such file or directory" in rejected(77, "plot", folder, "--output", tmp_path / "no" / "a.png")
    assert not (tmp_path / "a.png").exists()


def test_split(folder):
    text = good("split", folder, "--by", "subject", "--fraction", "0.5", "--seed", "3")
    assert [line.rpartition(": ")[2] for line in text.splitlines()] == ["6 movements", "6 movements"]
    parts = [DemonstrationSet.load(folder.with_name(f"reach_{part}")) for part in ("train", "test")]
    assert sorted(part.subjects for part in parts) == [("P1",), ("P2",)]
    assert "holds a demonstration set already" in rejected(78, "split", folder)
    train = folder.with_name("again")
    assert "reach_test holds" in rejected(78, "split", folder, "--train", train)
    assert not train.exists()


def test_synthesize(tmp_path):
    folder = tmp_path / "made"
    small = ("--columns", 2, "--rows", 2, "--repetitions", 2)
    good("synthesize", folder, *small)
    good("synthesize", folder, *small, "--action", "pointing", "--add")
    found = DemonstrationSet.load(folder)
    assert len(found) == 16
    assert found.actions == ("pointing", "reaching")
    assert "holds a demonstration set already" in rejected(78, "synthesize", folder, *small)
    assert "reaching.mcap exists" in rejected(78, "synthesize", folder, *small, "--add")
    assert len(found.demonstrations("reaching").sequences) == 8


def test_import_with_a_label(csv, tmp_path):
    folder = tmp_path / "set"
    options = ("--unit", "mm", "--action", "reaching", "--subject", "Anna")
    text = good("import", csv, "--to", folder, *options, "--theta", "0.4,0.1,-0.1")
    assert "1 movements in 1 recording" in text
    good("import", csv, "--to", folder, *options, "--theta", "0.4,0.1,-0.1", "--add", "--name", "again")
    found = DemonstrationSet.load(folder)
    assert [one.repetition for one in found] == [0, 1]
    assert found.frame == "laboratory"
    np.testing.assert_allclose(found[1].positions, 1.0 + reach((0.4, 0.1, -0.1))[1], rtol=0.0, atol=1e-12)


def test_import_and_label_afterwards(csv, tmp_path):
    folder = tmp_path / "set"
    assert "nothing is labelled yet: paramove demos label" in good("import", csv, "--to", folder, "--unit", "mm")
    text = good("label", folder, "--recording", "take.mcap", "--action", "reaching", "--find")
    assert text.startswith("take.mcap, 0.")
    text = good("label", folder, "--recording", "take.mcap", "--action", "reaching", "--start", 0.2, "--end", 1.5)
    assert text == "take.mcap, 0.2 to 1.5 s: reaching, repetition 1\n"
    assert len(DemonstrationSet.load(folder)) == 2
    with (folder / "labels.yaml").open("a") as file:
        file.write("  # Anna looked away\n")
    good("label", folder, "--recording", "take.mcap", "--action", "pointing", "--start", 0.2, "--end", 1.5)
    assert "# Anna looked away" in (folder / "labels.yaml").read_text()
    said = rejected(78, "label", folder, "--recording", "take.mcap", "--action", "x", "--start", 1, "--end", 9)
    assert "its recording, which covers 0 to 1.8 s" in said


def test_import_of_a_large_file_names_what_it_does_meanwhile(csv, tmp_path, monkeypatch):
    monkeypatch.setattr("paramove.cli.demos_import.MANY_BYTES", 1000)
    done = CliRunner().invoke(
        build("demos"), ["demos", "import", str(csv), "--to", str(tmp_path / "set"), "--unit", "mm"]
    )
    assert done.exit_code == 0, done.output
    reading, writing = done.stderr.splitlines()[:2]
    assert reading.startswith(f"reading {csv} (")
    assert writing.startswith(f"writing {tmp_path / 'set'} (")


def test_import_finds_movements(csv, tmp_path):
    good("import", csv, "--to", tmp_path / "set", "--unit", "mm", "--action", "reaching", "--find", "index")
    (found,) = DemonstrationSet.load(tmp_path / "set")
    assert 0.7 < found.duration < 1.1


def test_import_refuses_lost_points_with_the_remedy(csv, tmp_path):
    lines = csv.read_text().splitlines()
    for number in range(30, 40):
        cells = lines[number].split(",")
        lines[number] = ",".join([*cells[:4], "", "", "", *cells[7:]])
    csv.write_text("\n".join(lines))
    arguments = ("import", csv, "--to", tmp_path / "set", "--unit", "mm", "--action", "reaching")
    said = rejected(78, *arguments)
    assert "shoulder in frames 29-38 (0.2 s)" in said
    assert "--skip-refused imports the rest, --max-gap fills longer losses" in said
    assert not (tmp_path / "set").exists()
    assert "filled shoulder in frames 29-38" in good(*arguments, "--max-gap", 0.3)
    assert DemonstrationSet.load(tmp_path / "set").remarks


def test_wrong_arguments_of_import(csv, tmp_path):
    to = ("--to", tmp_path / "set")
    assert "does not define its unit; give --unit" in rejected(78, "import", csv, *to)
    assert "there is no file" in rejected(66, "import", tmp_path / "no.c3d", *to)
    assert "axes 'up'" in rejected(78, "import", csv, *to, "--unit", "mm", "--axes", "up")
    assert "has no point 'RFIN' for index" in rejected(78, "import", csv, *to, "--unit", "mm", "--point", "index=RFIN")
    for wrong in (["--theta", "a,b"], ["--point", "index"], ["--find", "index"], ["--unit", "inch"]):
        assert run("import", csv, *to, "--unit", "mm", *wrong).exit_code == 2
    assert run("label", tmp_path, "--recording", "a", "--action", "x").exit_code == 2
    assert not (tmp_path / "set").exists()


PATHS = ("../../outside", "/tmp/outside", "a/b", "..", "a\nb", "a" * 300)


@pytest.mark.parametrize("name", PATHS)
def test_a_name_that_is_a_path_is_rejected_at_import_and_labelling(csv, tmp_path, name):
    folder = tmp_path / "deep" / "set"
    rejected(78, "import", csv, "--to", folder, "--unit", "mm", "--action", name)
    assert not folder.exists()
    good("import", csv, "--to", folder, "--unit", "mm")
    before = sorted(tmp_path.rglob("*"))
    take = ("label", folder, "--recording", "take.mcap", "--action", name)
    rejected(78, *take, "--start", 0.2, "--end", 1.5)
    rejected(78, *take, "--find")
    rejected(78, "label", folder, "--recording", name, "--action", "reaching", "--find")
    rejected(78, "label", folder, "--recording", name, "--action", "reaching", "--start", 0.2, "--end", 1.5)
    assert sorted(tmp_path.rglob("*")) == before


def test_import_names_a_take_in_another_unit(csv, tmp_path):
    arguments = ("--to", tmp_path / "set", "--action", "reaching", "--theta", "0.4,0.1,-0.1")
    good("import", csv, "--unit", "mm", *arguments)
    good("import", csv, "--unit", "mm", *arguments, "--add", "--name", "second")
    done = run("import", csv, "--unit", "m", *arguments, "--add", "--name", "third")
    assert done.exit_code == 0
    assert "third.mcap" in done.stderr
    assert "millimetres?" in done.stderr
    done = run("import", csv, "--to", tmp_path / "theta", "--unit", "mm", "--action", "a", "--theta", "400,100,-100")
    assert "target_x is 400 ... 400" in done.stderr
