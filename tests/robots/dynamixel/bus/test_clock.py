"""The time of an arm's loop, by a paced emulator."""

import contextlib
import socket
import tempfile
import threading
from pathlib import Path

import pytest

from dynamixel_emulator import ControlSocket, DynamixelEmulator, EmulatedServo, FaultCommands
from paramove.robots.dynamixel.bus.clock import ClockLostError, EmulatorClock, MonotonicClock


@pytest.fixture
def control():
    """A path that is short enough for a socket."""
    with tempfile.TemporaryDirectory(dir="/tmp") as folder:
        yield Path(folder) / "control"


def test_to_wait_is_to_let_the_emulator_run(control):
    servo = EmulatedServo("xl430_w250", 1)
    with (
        DynamixelEmulator([servo], paced=True) as emulator,
        ControlSocket(control, FaultCommands(emulator).do),
    ):
        clock = EmulatorClock(control)
        assert clock.now_ns == 0
        clock.wait_until(30_000_000)
        clock.wait_until(10_000_000)
        assert clock.now_ns == 30_000_000
        assert emulator.bus.now_s == pytest.approx(0.03, abs=0.001)
        clock.close()


def test_an_emulator_that_is_not_paced_or_not_there_keeps_no_time(control):
    clock = EmulatorClock(control)
    with contextlib.closing(clock), pytest.raises(ClockLostError, match="does not keep the time"):
        clock.wait_until(1)
    with (
        contextlib.closing(clock),
        DynamixelEmulator([EmulatedServo("xl430_w250", 1)]) as emulator,
        ControlSocket(control, FaultCommands(emulator).do),
        pytest.raises(ClockLostError, match="paced"),
    ):
        clock.wait_until(1)


def test_an_emulator_that_ends_is_noticed(control):
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(control))
        listener.listen()
        threading.Thread(target=lambda: listener.accept()[0].close()).start()
        clock = EmulatorClock(control)
        with contextlib.closing(clock), pytest.raises(ClockLostError):
            clock.wait_until(1)


def test_the_machine_s_clock_runs():
    clock = MonotonicClock()
    begun_ns = clock.now_ns
    clock.wait_until(begun_ns + 1_000_000)
    clock.wait_until(begun_ns)
    assert clock.now_ns >= begun_ns + 1_000_000
