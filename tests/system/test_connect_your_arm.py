"""The page "Connect your arm", from new servos to the first reach: real processes, real bytes on an emulated bus."""

import contextlib
import json
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from dynamixel_emulator.emulator import DynamixelEmulator
from dynamixel_emulator.servo import EmulatedServo
from tests.docs.markdown import CONNECT_YOUR_ARM, blocks
from tests.docs.terminal import ENVIRONMENT, at_terminal, attended, heard, launched, started
from tests.robots.dynamixel.koch_arm import KOCH, PLAN, hands
from tests.robots.dynamixel.small_arm import LINK

COMMANDS = [
    command for block in blocks(CONNECT_YOUR_ARM) if block.marker == "on an emulated arm" for command in block.commands
]
SETUP, SCAN, CALIBRATE, VERIFY, EMULATED, REAL, ENABLE, STOP = COMMANDS
EEPROM_END = 64
OVERLAY = YAML(typ="safe").load(Path("launch/overlays/dynamixel_arm/emulated.yaml"))
TIMEOUTS = "".join(
    f" --set arm_driver.timeouts.{name}={value}"
    for name, value in OVERLAY["nodes"]["arm_driver"]["parameters"]["emulated"]["timeouts"].items()
)
"""What is emulated shares the processors with other tests, and may be late."""

pytestmark = pytest.mark.slow


def test_new_servos_become_an_arm_that_reaches_when_armed_and_stops_when_told(tmp_path):
    link = tmp_path / "by-id" / LINK
    link.parent.mkdir()
    places = {"PARAMOVE_SERIAL_BY_ID": str(link.parent), "PARAMOVE_DATA": str(tmp_path / "data")}
    environment = ENVIRONMENT | places | {"PARAMOVE_DOMAIN": "connect"}
    servos = [EmulatedServo(one.model) for one in PLAN.servos]
    with DynamixelEmulator(servos, link) as emulator:
        typed(SETUP, environment, [(connecting(emulator, [servo]), "\n") for servo in servos])
        connecting(emulator, servos)()
        rows = [line.split() for line in typed(SCAN, environment).splitlines()]
        assert [row[:2] for row in rows[-len(servos) :]] == [[str(one.number), one.model] for one in PLAN.servos]
        typed(CALIBRATE, environment, hands(emulator))
        assert "no differences" in typed(VERIFY, environment)
    (calibration,) = (tmp_path / "data" / "calibration").iterdir()
    launch = REAL.replace("/dev/serial/by-id/NAME", str(link)).replace("=FILE", f"={calibration}")
    launch += f"{TIMEOUTS} --runs {tmp_path / 'runs'}"
    assert str(link) in launch
    assert str(calibration) in launch

    with mounted(servos, link):
        with launched(launch, environment) as running:
            heard(running, "waiting until a person arms the arm (paramove arm enable)")
            assert "ARMED: the arm may move" in typed(ENABLE, environment, said="y\n")
            heard(running, "all 2 tasks are done")
            assert running.wait(120) == 0
        with launched(launch, environment) as running:
            heard(running, "waiting until a person arms the arm")
            typed(ENABLE, environment, said="y\n")
            heard(running, "task 1 of 2")
            typed(STOP, environment)
            heard(running, "FAILED", "stopped from the terminal by a person")
            assert running.wait(120) != 0


@pytest.mark.long
def test_the_application_reaches_and_carries_an_object_without_an_arm(launcher):
    code, shown = launcher.run(*EMULATED.split()[2:], timeout_s=300)
    assert code == 0, shown
    assert "SUCCESS: 2 of 2 tasks done" in shown
    summary = json.loads((launcher.latest / "run.json").read_text())
    assert [one["task"] for one in summary["tasks"]] == ["reach", "place"]
    assert (launcher.latest / "tasks.png").stat().st_size > 10_000


def typed(command, environment, steps=(), said=""):
    """Output of a command that must end well; `said` answers what it asks without a line's end."""
    if said:
        code, output = at_terminal(command, said, environment)
    else:
        code, output = attended(command, steps, environment)
    assert code == 0, f"{command}\n{output}"
    return output


def connecting(emulator, servos):
    """A person plugs in these and no others."""

    def act():
        with emulator.lock:
            emulator.bus.servos = list(servos)

    return act


@contextlib.contextmanager
def mounted(servos, link):
    """Servos that keep what these keep move an arm, in a process: this one, with all its tests, makes long pauses."""
    kept = []
    for servo in servos:
        registers = servo.model.registers.items()
        kept.append({name: servo.memory[name] for name, one in registers if one.address < EEPROM_END})
    with started(f"exec python -m tests.system.mounted_servos {KOCH} {link}", ENVIRONMENT) as arm:
        arm.stdin.write(f"{json.dumps(kept)}\n")
        arm.stdin.flush()
        heard(arm, "plugged in")
        yield
        arm.communicate(timeout=120)
        assert arm.returncode == 0
