"""What presses an emergency stop that is a file: all that is not surely released, and nothing that is."""

import os

import pytest

from paramove.robots.dynamixel.arm.stop_inputs import StopInputs


def test_without_files_there_is_no_such_stop():
    assert not StopInputs().are_there
    assert StopInputs().pressed() == ""


def test_a_file_presses_while_it_is_there(tmp_path):
    file = tmp_path / "estop"
    stop = StopInputs(file=file)
    assert stop.are_there
    assert stop.pressed() == ""
    file.symlink_to("/no/such/place")
    assert stop.pressed() == f"the emergency stop is pressed: there is a file {file}"
    file.unlink()
    assert stop.pressed() == ""


def test_a_file_that_cannot_be_looked_for_counts_as_pressed(tmp_path):
    (tmp_path / "folder").touch()
    file = tmp_path / "folder" / "estop"
    assert StopInputs(file=file).pressed() == (
        f"the emergency stop counts as pressed: {file} cannot be looked for (Not a directory)"
    )


@pytest.mark.parametrize(
    ("content", "found"), [("1\n", "'1'"), ("", "''"), ("2", "'2'"), ("00", "'00'"), ("on", "'on'")]
)
def test_a_line_is_pressed_unless_it_says_that_it_is_released(tmp_path, content, found):
    line = tmp_path / "value"
    stop = StopInputs(line=line)
    assert stop.are_there
    line.write_text("0\n")
    assert stop.pressed() == ""
    line.write_text(content)
    assert stop.pressed() == f"the emergency stop is pressed: {line} reads {found}, released is '0'"


def test_a_button_that_closes_its_circuit_is_pressed_at_0(tmp_path):
    line = tmp_path / "value"
    stop = StopInputs(line=line, line_pressed=0)
    line.write_text("1")
    assert stop.pressed() == ""
    line.write_text("0")
    assert "reads '0', released is '1'" in stop.pressed()


def test_a_line_that_cannot_be_read_or_waited_for_counts_as_pressed(tmp_path):
    line = tmp_path / "value"
    stop = StopInputs(line=line)
    for make, why in ((lambda: None, "No such file or directory"), (line.mkdir, "Is a directory")):
        make()
        assert stop.pressed() == f"the emergency stop counts as pressed: {line} cannot be read ({why})"
    line.rmdir()
    os.mkfifo(line)
    assert "reads '', released is '0'" in stop.pressed()
    line.unlink()
    line.write_bytes(b"\xff\xfe0")
    assert r"reads '\\xff\\xfe0'" in stop.pressed()


def test_either_of_both_presses(tmp_path):
    file, line = tmp_path / "estop", tmp_path / "value"
    line.write_text("0")
    stop = StopInputs(file, line)
    assert stop.pressed() == ""
    line.write_text("1")
    assert str(line) in stop.pressed()
    file.touch()
    assert str(file) in stop.pressed()
