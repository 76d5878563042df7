"""The control socket: one reply per line; only the user can open it, and it replaces no other file."""

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
        raise EmulatorError("unknown word: send good")
    return line.upper()


def test_each_line_gets_a_reply_and_the_socket_is_removed_at_the_end(tmp_path):
    path = tmp_path / "control"
    with ControlSocket(path, echoed):
        assert request(path, "good") == "GOOD"
        assert request(path, "") == ""
        with pytest.raises(EmulatorError, match="unknown word: send good"):
            request(path, "bad")
        assert request(path, "again") == "AGAIN"
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert not path.exists()
    with pytest.raises(EmulatorError, match="no emulator listens") as missing:
        request(path, "good")
    assert missing.value.missing


def test_one_client_sends_several_lines_in_chunks(tmp_path):
    with ControlSocket(tmp_path / "control", echoed), socket.socket(socket.AF_UNIX) as client:
        client.connect(str(tmp_path / "control"))
        for piece in (b"on", b"e\ntwo\nba", b"d\n\xff\xfe\n"):
            client.sendall(piece)
        replies = client.makefile(encoding="utf-8")
        assert [replies.readline() for _ in range(3)] == ["ok ONE\n", "ok TWO\n", "error: unknown word: send good\n"]
        assert replies.readline().startswith("ok ")


def test_an_overlong_line_closes_the_connection(tmp_path):
    with ControlSocket(tmp_path / "control", echoed):
        with socket.socket(socket.AF_UNIX) as client:
            client.connect(str(tmp_path / "control"))
            client.sendall(b"x" * 5000)
            client.settimeout(60.0)
            with contextlib.suppress(ConnectionResetError):
                assert client.recv(10) == b""
        assert request(tmp_path / "control", "good") == "GOOD"


def test_only_the_stale_socket_of_a_killed_program_is_replaced(tmp_path):
    stale, file = tmp_path / "stale", tmp_path / "file"
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(stale))
    file.write_text("mine")
    with ControlSocket(stale, echoed):
        assert request(stale, "good") == "GOOD"
        with pytest.raises(EmulatorError, match="of a running program"):
            ControlSocket(stale, echoed).__enter__()
        assert request(stale, "still") == "STILL"
    with pytest.raises(EmulatorError, match="not a socket"):
        ControlSocket(file, echoed).__enter__()
    assert file.read_text() == "mine"
    with pytest.raises(EmulatorError, match="No such file") as missing:
        ControlSocket(tmp_path / "none" / "control", echoed).__enter__()
    assert missing.value.missing
    with pytest.raises(EmulatorError, match="too long"):
        ControlSocket(tmp_path / ("x" * 120), echoed).__enter__()


def test_fault_commands_work_through_the_socket(tmp_path):
    with (
        DynamixelEmulator([EmulatedServo("xl430_w250", 1)]) as emulator,
        ControlSocket(tmp_path / "control", FaultCommands(emulator).do),
    ):
        assert request(tmp_path / "control", "overload 1") == ""
        assert emulator.bus.servos[0].memory["Hardware Error Status"] == 0x20
        assert request(tmp_path / "control", "state").startswith("{")
        request(tmp_path / "control", "unplug")
        assert not emulator.plugged_in
