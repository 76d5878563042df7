"""`paramove doctor` as it is called."""

import functools
import json

import pytest
from typer.testing import CliRunner

from dynamixel_emulator.emulator import DynamixelEmulator
from dynamixel_emulator.servo import EmulatedServo
from paramove.cli import doctor
from paramove.cli.main import build
from paramove.diagnosis.finding import Machine
from tests.cli.conftest import call

FAST = 1_000_000


@pytest.fixture
def emulator(tmp_path):
    """One servo at an adapter with a latency timer of 16 ms; `sys` and `by-id` lie in the test's folder."""
    (tmp_path / "by-id").mkdir()
    with DynamixelEmulator([EmulatedServo("xl430_w250", 7, FAST)], tmp_path / "by-id" / "usb-adapter") as emulator:
        timer = tmp_path / "sys" / "bus" / "usb-serial" / "devices" / emulator.port.rpartition("/")[2]
        timer.mkdir(parents=True)
        (timer / "latency_timer").write_text("16\n")
        yield emulator


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A machine in the test's folder."""
    monkeypatch.setattr(doctor, "Machine", functools.partial(Machine, devices=tmp_path, sysfs=tmp_path / "sys"))
    return tmp_path


def test_what_is_found_is_a_line_each_with_remedies_below(emulator, here):
    done = call("doctor", "--only", "serial", "--by-id", here / "by-id")
    assert done.exit_code == 0, done.output
    lines = done.output.splitlines()
    assert [line[0] for line in lines[:2]] == ["✓", "!"]
    assert lines[1].startswith("! usb latency      usb-adapter ")
    assert "up to 16 ms" in lines[1]
    assert lines[2].startswith("      echo 1 | ")


def test_json_has_every_number(emulator, here):
    done = call("doctor", "--only", "servos", "--by-id", here / "by-id", "--baud", FAST, "--json")
    assert done.exit_code == 0, done.output
    bus, servo = json.loads(done.stdout)
    assert (bus["part"], bus["level"]) == ("servos", "ok")
    told = {"id": 7, "model": "xl430_w250", "firmware": 46, "baud_rate": FAST, "voltage": 11.1, "temperature_c": 30}
    assert servo["facts"] == {"port": str(here / "by-id" / "usb-adapter"), "hardware_error": 0, **told}


def test_the_folder_of_ports_may_come_from_the_environment(emulator, here, monkeypatch):
    monkeypatch.setenv("PARAMOVE_SERIAL_BY_ID", str(here / "by-id"))
    assert "usb-adapter" in call("doctor", "--only", "serial").output


def test_nothing_is_mended_without_a_yes(emulator, here):
    done = call("doctor", "--only", "serial", "--by-id", here / "by-id", "--fix")  # no answer comes from the input
    assert "set it to 1 ms until it is unplugged?" in done.output
    assert [path.read_text() for path in here.rglob("latency_timer")] == ["16\n"]


def test_what_is_mended_is_looked_at_again(emulator, here):
    done = call("doctor", "--only", "serial", "--by-id", here / "by-id", "--fix", "--yes")
    assert done.exit_code == 0
    assert "✓ usb latency      usb-adapter hands over within 1 ms" in done.output


def test_what_cannot_be_mended_is_told(emulator, here, monkeypatch):
    def reject(*_):
        raise OSError("no mode of low latency")

    monkeypatch.setattr("paramove.diagnosis.serial_ports._hasten", reject)
    done = call("doctor", "--only", "serial", "--by-id", here / "by-id", "--fix", "--yes")
    assert "usb latency: not fixed: no mode of low latency" in done.output


def test_json_cannot_ask():
    done = call("doctor", "--fix", "--json")
    assert done.exit_code == 2
    assert "--yes" in done.output


def test_what_is_wrong_is_the_exit_code_also_on_a_terminal_without_unicode(emulator, here):
    emulator.bus.servos[0].voltage = 15.0
    words = ["doctor", "--only", "servos", "--by-id", str(here / "by-id"), "--baud", str(FAST)]
    done = CliRunner(charset="ascii").invoke(build("doctor"), words)
    assert done.exit_code == 3
    _, told, wrong, remedy, stopped, *_ = done.output.splitlines()
    assert told == "+ servo 7          xl430_w250, firmware 46, 1000000 bit/s, 15.0 V, 30 ?C"
    assert wrong == "x servo 7          measures 15.0 V, its limits are 6.0 to 14.0 V"
    assert remedy == "      switch off, and give it a supply of 11.1 V"
    assert stopped.startswith("x servo 7          has stopped: input voltage out of its limits")


def test_the_whole_machine_is_looked_at(here):
    done = call("doctor", "--json", "--by-id", here / "by-id")
    assert done.exit_code in (0, 3), done.output
    parts = {row["part"] for row in json.loads(done.stdout)}
    assert parts == {"installation", "graphics", "resources", "cameras", "serial", "servos"}
