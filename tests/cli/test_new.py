"""`paramove new`: what is written, and what is not written over."""

import pytest
from typer.testing import CliRunner

from paramove.cli.main import build
from paramove.documents import exit_codes


@pytest.fixture
def new(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return lambda *words: CliRunner().invoke(build("new"), ["new", *words])


def test_every_file_is_reported_and_has_the_name_of_the_application(new, tmp_path):
    done = new("my_robot")
    assert done.exit_code == 0, done.output
    written = {path.relative_to(tmp_path) for path in tmp_path.rglob("*") if path.is_file()}
    assert written == {path for path in written if f"wrote {path}\n" in done.output}
    assert (tmp_path / "my_robot" / "launch" / "my_robot.yaml").is_file()
    assert "package my_robot;" in (tmp_path / "my_robot" / "msgs" / "cart.proto").read_text()
    for path in written:
        assert "NAME" not in (tmp_path / path).read_text()


def test_a_folder_with_something_in_it_is_left_alone(new, tmp_path):
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine").touch()
    done = new("my_robot", "--folder", "full")
    assert done.exit_code == exit_codes.USAGE
    assert [path.name for path in (tmp_path / "full").iterdir()] == ["mine"]
    (tmp_path / "full" / "mine").unlink()
    assert new("my_robot", "--folder", "full").exit_code == 0


@pytest.mark.parametrize("name", ["My Robot", "../x", "1st", "", "rule_learning"])
def test_what_cannot_be_a_name_or_is_one_already_is_rejected(new, tmp_path, name):
    assert new(name).exit_code == exit_codes.USAGE
    assert not list(tmp_path.iterdir())
