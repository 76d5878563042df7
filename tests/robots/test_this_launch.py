"""Which robots the launch of a driver emulates: found in what the system knows of real processes."""

import contextlib
import fcntl
import os
import subprocess
import sys
from pathlib import Path

import pytest

from paramove.bus import topics
from paramove.bus.endpoint import Ownership, socket_path
from paramove.bus.settings import BusSettings, lock_of
from paramove.robots import this_launch
from paramove.robots.this_launch import RESTARTED, ThisLaunch
from tests.diagnosis.conftest import HOLD

HERE = ThisLaunch(os.getpid())
ELSEWHERE = ThisLaunch(2**22)  # no process has this id
SERVE = "import os, sys; ours, theirs = os.openpty(); print(os.ttyname(theirs), flush=True); sys.stdin.read()"
OWN = """
import sys
from pathlib import Path
from paramove.bus.endpoint import Ownership
with Ownership(Path(sys.argv[1]), "stranger"):
    print("owned", flush=True)
    sys.stdin.read()
"""
ASK = """
import sys
from pathlib import Path
from paramove.bus.settings import BusSettings
from paramove.robots.this_launch import ThisLaunch
launch = ThisLaunch.of(BusSettings(folder=Path(sys.argv[1])), Path(sys.argv[2]), "arm_driver")
print(launch.launcher, launch.restarted, launch.why_no_program(BusSettings(folder=Path(sys.argv[1]))))
"""


@contextlib.contextmanager
def process(code, *arguments):
    """A process of this launch, and the first line that it prints."""
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", code, *arguments], stdin=pipe, stdout=pipe, text=True) as running:
        yield running, running.stdout.readline().strip()
        running.communicate()


def test_a_pseudo_terminal_that_a_process_of_this_launch_serves_is_emulated(tmp_path):
    with process(SERVE) as (server, name):
        link = tmp_path / "usb-adapter"
        link.symlink_to(name)
        assert HERE.why_not_servos(link) == ""
        assert f"pid {server.pid} " in ELSEWHERE.why_not_servos(link)
        assert "does not belong to this launch" in ELSEWHERE.why_not_servos(link)
        assert "started by hand" in ThisLaunch().why_not_servos(link)
    assert HERE.why_not_servos(link) != ""


def test_a_real_device_is_never_emulated(tmp_path):
    (tmp_path / "ttyUSB0").touch()
    for device in (tmp_path / "ttyUSB0", Path("/dev/null"), tmp_path / "missing"):
        assert HERE.why_not_servos(device) == f"{device} is no pseudo-terminal"


def test_who_has_a_serial_port_open_may_hand_on_what_it_hears(tmp_path, monkeypatch):
    monkeypatch.setattr(this_launch, "SERIAL_PORTS", f"{tmp_path}/tty")
    serial_port, console = tmp_path / "ttyUSB0", tmp_path / "tty1"
    for file in (serial_port, console):
        file.touch()
    both = f"import sys; file = open(sys.argv[1]); {SERVE}"
    with process(both, str(console)) as (_, name):
        assert HERE.why_not_servos(Path(name)) == ""
    with process(both, str(serial_port)) as (_, name):
        assert "has a serial port open" in HERE.why_not_servos(Path(name))


def test_who_only_uses_a_terminal_does_not_serve_it():
    with process(SERVE) as (_, name), process(HOLD, name):
        assert HERE.why_not_servos(Path(name)) == ""


@pytest.fixture
def bus(tmp_path):
    folder = tmp_path / "bus"
    folder.mkdir(mode=0o700)
    return BusSettings(folder=folder)


def asked(bus, run_folder):
    """What a node finds: the pid of its launcher, whether it was started before, and why no program may arm HOAP-3."""
    done = subprocess.run(
        [sys.executable, "-c", ASK, str(bus.folder), str(run_folder)], capture_output=True, text=True, check=True
    )
    return done.stdout.strip().split(" ", 2)


def test_a_node_belongs_to_the_launch_whose_launcher_has_started_it(bus, tmp_path):
    assert asked(bus, tmp_path)[:2] == ["None", "False"]
    with lock_of(bus.folder).open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        assert asked(bus, tmp_path)[:2] == [str(os.getpid()), "False"]
        assert asked(bus, tmp_path)[1:] == ["True", RESTARTED]  # a second process of the same node


def test_hoap3_is_simulated_by_the_process_that_makes_the_time(bus):
    robot, clock = (socket_path(bus.folder, topic.name) for topic in (topics.WIRE_HOAP3_STATE, topics.CLOCK))
    assert "wire/hoap3/state does not publish clock" in HERE.why_no_program(bus).replace(
        "the process that publishes ", ""
    )
    with Ownership(robot, "simulator"):
        assert HERE.why_no_program(bus) != ""
        with Ownership(clock, "simulator"):
            assert HERE.why_no_program(bus) == ""
            assert f"pid {os.getpid()}," in ELSEWHERE.why_no_program(bus)
        with process(OWN, str(clock)) as (_, line):
            assert line == "owned"
            assert HERE.why_no_program(bus) != ""
    assert HERE.why_no_program(bus) != ""  # the locks are there, and nobody holds them
    assert "started by hand" in ThisLaunch().why_no_program(bus)
