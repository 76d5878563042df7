"""Our port under the SDK's packet handler: what it waits for, who may open it, and what is left after a pulled plug."""

import contextlib
import grp
import os
import subprocess
import sys

import pytest
from dynamixel_sdk import COMM_RX_TIMEOUT, COMM_SUCCESS, PacketHandler

from dynamixel_emulator.emulator import DynamixelEmulator
from dynamixel_emulator.servo import EmulatedServo
from paramove.documents.input_error import InputError
from paramove.robots.dynamixel.bus.servo_port import LATENCY_S, PortLostError, ServoPort

INDIRECT_DATA = 224
PATIENT_S = 0.3
"""Other programs may keep the emulator waiting."""


BEGIN = """
import os, sys
from paramove.robots.dynamixel.bus.servo_port import InputError, ServoPort
def say(*words):
    print(*words, flush=True)
"""
ORDINARY = """
if os.geteuid() == 0:
    os.setgroups([])
    os.setgid(65534)
    os.setuid(65534)
"""
HOLDS = "with ServoPort(sys.argv[1]):\n    say('held')\n    sys.stdin.read()"
OPENS = ORDINARY + "try:\n    ServoPort(sys.argv[1]).open()\nexcept InputError as error:\n    say(error)"
OPENS_BARE = ORDINARY + (
    "try:\n    os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY)\nexcept OSError as error:\n    say(error.strerror)\n"
    "else:\n    say('opened')"
)
"""Programs; after ORDINARY they have no more rights than an ordinary user."""


@contextlib.contextmanager
def program(code, *arguments):
    """Runs until its input ends, which is at the end of this context."""
    command = [sys.executable, "-c", BEGIN + code, *arguments]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as running:
        yield running
        running.communicate(timeout=60)


def said_by(code, *arguments):
    with program(code, *arguments) as running:
        said = running.stdout.read().strip()
    assert running.returncode == 0
    return said


@pytest.fixture
def emulator():
    with DynamixelEmulator([EmulatedServo("xl430_w250", 1, 1_000_000), EmulatedServo("xl330_m288", 2)]) as emulator:
        yield emulator


@pytest.fixture
def handler():
    return PacketHandler(2.0)


def test_servos_answer_through_it(emulator, handler):
    with ServoPort(emulator.port, latency_s=PATIENT_S) as port:
        assert handler.ping(port, 1) == (1060, COMM_SUCCESS, 0)
        assert handler.ping(port, 2)[1] == COMM_RX_TIMEOUT
        assert port.setBaudRate(57600)
        assert handler.ping(port, 2) == (1200, COMM_SUCCESS, 0)
        assert set(handler.broadcastPing(port)[0]) == {2}
        assert not port.low_latency  # of a pseudo-terminal


@pytest.mark.parametrize("data", [[0xFF, 0xFF, 0xFD], [0xFF, 0xFF, 0xFD, 0xFD], [0xFF, 0xFF, 0xFF, 0xFD, 0x00, 0xFF]])
def test_bytes_like_a_header_arrive(emulator, handler, data):
    with ServoPort(emulator.port, latency_s=PATIENT_S) as port:
        assert handler.writeTxRx(port, 1, INDIRECT_DATA, len(data), data) == (COMM_SUCCESS, 0)
        assert handler.readTxRx(port, 1, INDIRECT_DATA, len(data)) == (data, COMM_SUCCESS, 0)


def test_a_missing_servo_is_waited_for_as_long_as_its_bytes_take(emulator, handler):
    with ServoPort(emulator.port) as port:
        assert handler.ping(port, 9)[1] == COMM_RX_TIMEOUT
        assert port.timeout_s == pytest.approx((10 + 11) * 10 / 1_000_000 + 508e-6 + LATENCY_S)


def test_a_pulled_plug_is_told_and_leaves_nothing_busy(emulator, handler):
    port = ServoPort(emulator.port, latency_s=PATIENT_S)
    port.open()
    assert handler.ping(port, 1)[1] == COMM_SUCCESS
    emulator.unplug()
    with pytest.raises(PortLostError, match=r"went away \([A-Z][a-z/ ]+\): is its cable plugged in"):
        handler.ping(port, 1)
    assert not port.is_using
    with pytest.raises(PortLostError, match="not open"):
        handler.ping(port, 1)
    emulator.plug_in()
    port.name = emulator.port
    port.open()
    assert handler.ping(port, 1) == (1060, COMM_SUCCESS, 0)
    port.close()
    port.close()


def test_a_second_program_is_refused_and_told_who_was_first(emulator):
    with program(HOLDS, emulator.port) as first:
        assert first.stdout.readline() == "held\n"
        holder = rf"pid {first.pid} \(python[0-9.]*\): end it in its terminal, or: kill {first.pid}"
        with pytest.raises(InputError, match=rf"{emulator.port} is in use by {holder}$"):
            ServoPort(emulator.port).open()
    with ServoPort(emulator.port), pytest.raises(InputError, match=r"in use by another program: close it \(sudo lsof"):
        ServoPort(emulator.port).open()  # this program has it itself


def test_a_program_that_asks_for_no_lock_is_refused_too(emulator):
    os.chmod(emulator.port, 0o666)
    assert said_by(OPENS_BARE, emulator.port) == "opened"
    with ServoPort(emulator.port):
        assert said_by(OPENS_BARE, emulator.port) == "Device or resource busy"
    assert said_by(OPENS_BARE, emulator.port) == "opened"


def test_a_port_that_this_user_may_not_open_is_told_with_the_rule_or_the_group(emulator):
    os.chmod(emulator.port, 0)
    told = said_by(OPENS, emulator.port)
    assert told.startswith(f"{emulator.port} may not be opened by this user: echo 'KERNEL==")
    assert """MODE="0660", GROUP="dialout"' | sudo tee /etc/udev/rules.d/99-paramove-dialout.rules; """ in told
    assert told.endswith("; sudo usermod -aG dialout $USER; log out and in again")
    group = next(one for one in grp.getgrall() if one.gr_gid)
    if os.geteuid() == 0:  # who is not has no way to give a port to a group
        os.chown(emulator.port, 0, group.gr_gid)
        os.chmod(emulator.port, 0o660)
        gives = f"sudo usermod -aG {group.gr_name} $USER; log out and in again"
        assert said_by(OPENS, emulator.port) == f"{emulator.port} may not be opened by this user: {gives}"


def test_a_port_that_is_not_there_or_none_is_told_with_those_that_are(tmp_path, monkeypatch):
    (tmp_path / "usb-FTDI_0001-if00-port0").touch()
    monkeypatch.setenv("PARAMOVE_SERIAL_BY_ID", str(tmp_path))
    with pytest.raises(InputError, match=r"found are: .*usb-FTDI_0001-if00-port0") as missing:
        ServoPort(str(tmp_path / "ttyUSB7")).open()
    assert missing.value.missing
    file = tmp_path / "file"
    file.touch()
    with pytest.raises(InputError, match="file is no serial port but something else: name a link in"):
        ServoPort(str(file)).open()
    with pytest.raises(InputError, match="is no serial port but something else"):
        ServoPort(str(tmp_path)).open()


def test_an_adapter_that_hangs_is_lost_and_can_be_opened_again(emulator, monkeypatch):
    monkeypatch.setattr("paramove.robots.dynamixel.bus.servo_port.LONGEST_WRITE_S", 0.05)
    with ServoPort(emulator.port, latency_s=PATIENT_S) as port:
        with emulator.lock, pytest.raises(PortLostError, match=r"\(it took no byte for 0.05 s\): is its cable plugged"):
            port.writePort(bytes(200_000))  # far more than any port keeps
        with pytest.raises(PortLostError, match="not open"):
            port.writePort(bytes(2))
        port.open()
        assert port.writePort(bytes(200)) == 200
