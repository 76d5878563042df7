"""Who may use a device, and who does."""

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from paramove.devices import access_remedy, holders, may_use
from tests.diagnosis.conftest import HOLD

SERVE = "import os, sys; ours, theirs = os.openpty(); print(os.ttyname(theirs), flush=True); sys.stdin.read()"


@pytest.fixture
def terminal():
    """A pseudo-terminal whose other end this process has."""
    ours, theirs = os.openpty()
    yield Path(os.ttyname(theirs))
    os.close(ours)
    os.close(theirs)


def test_the_program_that_has_a_device_open_is_named(terminal, started, tmp_path):
    link = tmp_path / "usb-adapter"
    link.symlink_to(terminal)
    assert holders(link) == []
    program, _ = started(HOLD, str(terminal))
    assert [(one.pid, one.program.startswith("python")) for one in holders(link)] == [(program.pid, True)]
    assert str(holders(link)[0]).startswith(f"pid {program.pid} (python")


def test_a_program_in_python_is_named_by_its_module(terminal, tmp_path):
    (tmp_path / "nodes").mkdir()
    (tmp_path / "nodes" / "driver.py").write_text(HOLD)
    command = [sys.executable, "-m", "nodes.driver", str(terminal)]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, cwd=tmp_path, env={}, stdin=pipe, stdout=pipe, text=True) as program:
        assert program.stdout.readline() == "held\n"
        assert [str(one) for one in holders(terminal)] == [f"pid {program.pid} (nodes.driver)"]
        program.communicate()


def test_who_serves_a_pseudo_terminal_does_not_hold_it(started):
    program, name = started(SERVE)
    assert holders(Path(name)) == []
    held, _ = started(HOLD, name)
    assert [one.pid for one in holders(Path(name))] == [held.pid]
    assert program.poll() is None


def test_a_device_of_a_group_needs_the_group(tmp_path):
    device = tmp_path / "ttyUSB0"
    device.touch()
    device.chmod(0o660)
    if os.geteuid() == 0:
        os.chown(device, 0, 20)
        assert access_remedy(device, "dialout", "ttyUSB*")[-1] == "log out and in again"
        assert access_remedy(device, "dialout", "ttyUSB*")[0].startswith("sudo usermod -aG ")
    device.chmod(0o600)
    rule, reload, *_ = access_remedy(device, "dialout", "ttyUSB*")
    assert 'KERNEL=="ttyUSB*", MODE="0660", GROUP="dialout"' in rule
    assert "udevadm" in reload


def test_a_device_that_went_away_meanwhile_is_to_be_plugged_in_again(terminal):
    (remedy,) = access_remedy(terminal.with_name("no_such"), "dialout", "ttyUSB*")
    assert "plug it in again" in remedy


def test_what_this_user_may_read_and_write_can_be_used(terminal):
    assert stat.S_ISCHR(terminal.stat().st_mode)
    assert may_use(terminal)
    assert not may_use(terminal.with_name("no_such"))
