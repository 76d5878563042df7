"""The control socket: one line, one answer; its file is the user's own and no other one is touched."""

import contextlib
import socket
import stat

import pytest

from dynamixel_emulator.control import ControlSocket, request
from dynamixel_emulator.emulator import DynamixelEmulator
from dynamixel_emulator.errors import EmulatorError
from dynamixel_emulator.fault_commands import FaultCommands
from dynamixel_emulator.servo import EmulatedServo


def echoed(line):
    if line == "bad":
        raise EmulatorError("that is bad: say good")
    return line.upper()


def test_a_line_is_answered_and_the_socket_is_gone_afterwards(tmp_path):
    path = tmp_path / "control"
    with ControlSocket(path, echoed):
        assert request(path, "good") == "GOOD"
        assert request(path, "") == ""
        with pytest.raises(EmulatorError, match="that is bad: say good"):
            request(path, "bad")
        assert request(path, "again") == "AGAIN"
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert not path.exists()
    with pytest.raises(EmulatorError, match="no emulator listens") as missing:
        request(path, "good")
    assert missing.value.missing


def test_several_lines_of_one_caller_in_any_pieces(tmp_path):
    with ControlSocket(tmp_path / "control", echoed), socket.socket(socket.AF_UNIX) as caller:
        caller.connect(str(tmp_path / "control"))
        for piece in (b"on", b"e\ntwo\nba", b"d\n\xff\xfe\n"):
            caller.sendall(piece)
        answers = caller.makefile(encoding="utf-8")
        assert [answers.readline() for _ in range(3)] == ["ok ONE\n", "ok TWO\n", "error: that is bad: say good\n"]
        assert answers.readline().startswith("ok ")


def test_an_endless_line_is_hung_up_on(tmp_path):
    with ControlSocket(tmp_path / "control", echoed):
        with socket.socket(socket.AF_UNIX) as caller:
            caller.connect(str(tmp_path / "control"))
            caller.sendall(b"x" * 5000)
            caller.settimeout(60.0)
            with contextlib.suppress(ConnectionResetError):
                assert caller.recv(10) == b""
        assert request(tmp_path / "control", "good") == "GOOD"


def test_what_a_killed_program_left_is_cleared_away_and_nothing_else(tmp_path):
    left, file = tmp_path / "left", tmp_path / "file"
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(left))
    file.write_text("mine")
    with ControlSocket(left, echoed):
        assert request(left, "good") == "GOOD"
        with pytest.raises(EmulatorError, match="of a running program"):
            ControlSocket(left, echoed).__enter__()
        assert request(left, "still") == "STILL"
    with pytest.raises(EmulatorError, match="no socket"):
        ControlSocket(file, echoed).__enter__()
    assert file.read_text() == "mine"
    with pytest.raises(EmulatorError, match="No such file") as missing:
        ControlSocket(tmp_path / "none" / "control", echoed).__enter__()
    assert missing.value.missing
    with pytest.raises(EmulatorError, match="too long"):
        ControlSocket(tmp_path / ("x" * 120), echoed).__enter__()


def test_verbs_come_through_it(tmp_path):
    with (
        DynamixelEmulator([EmulatedServo("xl430_w250", 1)]) as emulator,
        ControlSocket(tmp_path / "control", FaultCommands(emulator).do),
    ):
        assert request(tmp_path / "control", "overload 1") == ""
        assert emulator.bus.servos[0].memory["Hardware Error Status"] == 0x20
        assert request(tmp_path / "control", "state").startswith("{")
        request(tmp_path / "control", "unplug")
        assert not emulator.plugged_in
