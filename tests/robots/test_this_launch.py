"""Which robots the launch of a driver emulates: found in what the system knows of real processes."""

import contextlib
import fcntl
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from paramove.bus import START_VARIABLE, topics
from paramove.bus.endpoint import Ownership, socket_path
from paramove.bus.settings import BusSettings, lock_of
from paramove.robots import this_launch
from paramove.robots.this_launch import RESTARTED, ThisLaunch
from tests.diagnosis.conftest import HOLD
from tests.robots.one_process import HERE

LAUNCH = ThisLaunch(os.getpid())
ELSEWHERE = ThisLaunch(2**22)  # no process has this id
ROOT = Path(__file__).parents[2]
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
launch = ThisLaunch.of(BusSettings(folder=Path(sys.argv[1])))
print(launch.launcher, launch.restarted, launch.why_no_program(BusSettings(folder=Path(sys.argv[1]))))
"""


@contextlib.contextmanager
def process(*command, **options):
    """A process of this launch, and the first line that it prints."""
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, *command], stdin=pipe, stdout=pipe, text=True, **options) as running:
        yield running, running.stdout.readline().strip()
        running.terminate()
        running.communicate()


def served(folder, module="sim.dynamixel_emulator", **variables):
    """A process of a module that serves a pseudo-terminal, in a folder of its own code."""
    environment = {**os.environ, "PYTHONPATH": f"{folder}{os.pathsep}{ROOT}", **variables}
    return process("-P", "-m", module, cwd=folder, env=environment)


def stand_in(folder, module):
    """Code that opens a pseudo-terminal and does nothing with it."""
    path = folder / f"{module.replace('.', '/')}.py"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(SERVE)
    return folder


def test_the_emulator_that_this_launch_has_started_is_one(short_folder):
    """The real one, run as a node is run; whose workspace has robots, nodes and equal code of its own."""
    for name in ("bus", "run", "cell/nodes"):
        (short_folder / name).mkdir(mode=0o700, parents=True)
    shutil.copytree(ROOT / "sim", short_folder / "cell/sim", ignore=shutil.ignore_patterns("__pycache__"))
    (short_folder / "cell/my_analysis.py").touch()
    config = short_folder / "emulator.yaml"
    bus = f"{{folder: {short_folder}/bus, truth_folder: {short_folder}/bus}}"
    robot = ROOT / "robot_description/koch_v1_1"
    config.write_text(
        f"{{node: emulator, bus: {bus}, run_folder: {short_folder}/run, parameters: {{robot: {robot}, port: port}}}}"
    )
    command = [sys.executable, "-P", "-m", "sim.dynamixel_emulator", "--config", config]
    environment = {**os.environ, "PYTHONPATH": f"{short_folder / 'cell'}{os.pathsep}{ROOT}"}
    with subprocess.Popen(command, cwd=short_folder / "cell", env=environment) as running:
        port = short_folder / "run/port"
        ends_s = time.monotonic() + 20.0
        while not port.is_symlink() and time.monotonic() < ends_s:
            os.sched_yield()
        try:
            assert LAUNCH.why_not_servos(port) == ""
            assert f"pid {running.pid} " in ELSEWHERE.why_not_servos(port)
            assert "not started by the launcher" in ELSEWHERE.why_not_servos(port)
            assert "started by hand" in ThisLaunch().why_not_servos(port)
        finally:
            running.terminate()
    assert LAUNCH.why_not_servos(port) != ""


def test_another_node_of_this_launch_that_serves_a_pseudo_terminal_is_no_emulator(tmp_path):
    with served(stand_in(tmp_path, "nodes.bridge"), "nodes.bridge") as (server, name):
        reason = LAUNCH.why_not_servos(Path(name))
        assert f"pid {server.pid} " in reason
        assert "nodes.bridge, none of the emulators" in reason
    with process("-c", SERVE) as (_, name):
        assert "none of the emulators" in LAUNCH.why_not_servos(Path(name))


def test_what_an_emulator_or_a_node_has_started_is_no_emulator(tmp_path):
    """Its own child has the command line of the emulator."""
    stand_in(tmp_path, "sim.dynamixel_emulator")
    child = "import subprocess, sys; subprocess.run([sys.executable, '-m', 'sim.dynamixel_emulator'])"
    with process("-c", child, cwd=tmp_path) as (_, name):
        assert "not started by the launcher" in LAUNCH.why_not_servos(Path(name))


REPLACING = ("sim/dynamixel_emulator.py", "sim/emulated_arm.py", "sim/emulated_arm/__init__.py", "sim/world.abi3.so")
HIDING = ("termios.py", "numpy/__init__.py", "dynamixel_emulator.py", "paramove/__init__.py", "sitecustomize.py")


@pytest.mark.parametrize(
    ("where", "file"), [("cell", file) for file in (*REPLACING, *HIDING)] + [("library", file) for file in HIDING]
)
def test_an_emulator_whose_code_other_files_replace_is_none(tmp_path, where, file):
    """In a folder of the workspace, or another on PYTHONPATH; empty, and put there after its start, so that it runs."""
    folder, library = stand_in(tmp_path / "cell", "sim.dynamixel_emulator"), tmp_path / "library"
    library.mkdir()
    with served(folder, PYTHONPATH=f"{folder}{os.pathsep}{library}{os.pathsep}{ROOT}") as (_, name):
        assert f"with {folder}/sim/dynamixel_emulator.py instead" in LAUNCH.why_not_servos(Path(name))
        (folder / "sim/dynamixel_emulator.py").write_bytes((ROOT / "sim/dynamixel_emulator.py").read_bytes())
        assert LAUNCH.why_not_servos(Path(name)) == ""
        replacing = tmp_path / where / file
        replacing.parent.mkdir(exist_ok=True)
        replacing.write_text("")
        assert f"with {tmp_path / where}/" in LAUNCH.why_not_servos(Path(name))


def test_a_real_device_is_never_emulated(tmp_path):
    (tmp_path / "ttyUSB0").touch()
    for device in (tmp_path / "ttyUSB0", Path("/dev/null"), tmp_path / "missing"):
        assert LAUNCH.why_not_servos(device) == f"{device} is no pseudo-terminal"


def test_who_has_a_serial_port_open_may_hand_on_what_it_hears(tmp_path, monkeypatch):
    monkeypatch.setattr(this_launch, "SERIAL_PORTS", f"{tmp_path}/tty")
    serial_port, console = tmp_path / "ttyUSB0", tmp_path / "tty1"
    for file in (serial_port, console):
        file.touch()
    both = f"import sys; file = open(sys.argv[1]); {SERVE}"
    with process("-c", both, str(console)) as (_, name):
        assert HERE.why_not_servos(Path(name)) == ""
    with process("-c", both, str(serial_port)) as (_, name):
        assert "has a serial port open" in HERE.why_not_servos(Path(name))


def test_who_only_uses_a_terminal_does_not_serve_it():
    with process("-c", SERVE) as (_, name), process("-c", HOLD, name):
        assert HERE.why_not_servos(Path(name)) == ""


@pytest.fixture
def bus(tmp_path):
    folder = tmp_path / "bus"
    folder.mkdir(mode=0o700)
    return BusSettings(folder=folder)


def asked(bus, start):
    """What a node finds: the pid of its launcher, whether it was started before, and why no program may arm HOAP-3."""
    command = [sys.executable, "-c", ASK, str(bus.folder)]
    environment = {**os.environ, START_VARIABLE: start}
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    return done.stdout.strip().split(" ", 2)


def test_a_node_belongs_to_the_launch_whose_launcher_has_started_it(bus):
    assert asked(bus, "1")[:2] == ["None", "False"]
    with lock_of(bus.folder).open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        assert asked(bus, "1")[:2] == [str(os.getpid()), "False"]
        assert asked(bus, "2")[1:] == ["True", RESTARTED]


def test_hoap3_is_simulated_by_the_process_that_makes_the_time(bus):
    robot, clock = (socket_path(bus.folder, topic.name) for topic in (topics.WIRE_HOAP3_STATE, topics.CLOCK))
    assert "wire/hoap3/state does not publish clock" in LAUNCH.why_no_program(bus).replace(
        "the process that publishes ", ""
    )
    with Ownership(robot, "simulator"):
        assert LAUNCH.why_no_program(bus) != ""
        with Ownership(clock, "simulator"):
            assert HERE.why_no_program(bus) == ""
            assert f"pid {os.getpid()}," in LAUNCH.why_no_program(bus)  # a test is no simulator
            assert f"pid {os.getpid()}," in ELSEWHERE.why_no_program(bus)
        with process("-c", OWN, str(clock)) as (_, line):
            assert line == "owned"
            assert LAUNCH.why_no_program(bus) != ""
    assert LAUNCH.why_no_program(bus) != ""  # the locks are there, and nobody holds them
    assert "started by hand" in ThisLaunch().why_no_program(bus)
