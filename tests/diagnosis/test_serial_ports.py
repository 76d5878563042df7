"""Serial ports that lead to pseudo-terminals, and adapters in a tree that a test makes."""

import grp
import os
from dataclasses import replace
from pathlib import Path

import pytest

from paramove.diagnosis.bus_findings import servos_findings
from paramove.diagnosis.finding import Level, Machine
from paramove.diagnosis.serial_ports import port_links, serial_findings, usable_ports
from tests.diagnosis.conftest import HOLD
from tests.diagnosis.unprivileged import as_nobody, needs_root

LINK = "usb-FTDI_USB__-__Serial_Converter_FT1-if00-port0"
LOOK = "machine = Machine(by_id=Path(sys.argv[1]), devices=Path(sys.argv[1]))\n"
LOOK += "print(json.dumps([told(one) for one in serial_findings(machine)]))"


@pytest.fixture
def port():
    """A pseudo-terminal; this process has both ends."""
    ours, theirs = os.openpty()
    yield Path(os.ttyname(theirs))
    os.close(ours)
    os.close(theirs)


@pytest.fixture
def machine(open_folder, port):
    """With the port under the name of its adapter, whose latency timer is 16 ms."""
    by_id = open_folder / "by-id"
    by_id.mkdir()
    (by_id / LINK).symlink_to(port)
    timer = open_folder / "sys" / "bus" / "usb-serial" / "devices" / port.name
    timer.mkdir(parents=True)
    (timer / "latency_timer").write_text("16\n")
    return Machine(by_id=by_id, devices=open_folder, sysfs=open_folder / "sys")


def test_a_free_port_is_listed_with_its_latency(machine, port):
    free, latency = serial_findings(machine)
    assert (free.level, free.detail) == (Level.OK, f"{LINK}: {port} is free")
    assert (latency.level, latency.facts["latency_ms"]) == (Level.WARNING, 16)
    assert latency.remedy[0].startswith("echo 1 | ")
    assert latency.remedy[0].endswith(f"/{port.name}/latency_timer")
    assert 'ATTR{latency_timer}="1"' in latency.remedy[1]
    assert usable_ports(machine) == [machine.by_id / LINK]


def test_the_latency_is_mended(machine):
    _, latency = serial_findings(machine)
    latency.fix.do()
    _, latency = serial_findings(machine)
    assert (latency.level, latency.facts["latency_ms"]) == (Level.OK, 1)


@needs_root
def test_a_driver_without_low_latency_is_told_to_who_may_not_write_its_file(machine, port):
    port.chmod(0o666)
    code = LOOK.replace("Path(sys.argv[1]), dev", "Path(sys.argv[1]), sysfs=Path(sys.argv[2]), dev")
    code = code.partition("print")[0] + "fix = list(serial_findings(machine))[1].fix\n"
    code += "try:\n    fix.do()\nexcept OSError as error:\n    print(json.dumps(str(error)))"
    assert "no low latency mode" in as_nobody(serial_findings, code, machine.by_id, machine.sysfs)


def test_a_port_that_another_program_has_open_is_not_asked(machine, port, started):
    program, _ = started(HOLD, str(port))
    held = next(iter(serial_findings(machine)))
    assert (held.level, held.remedy) == (Level.PROBLEM, (f"end it in its terminal, or: kill {program.pid}",))
    assert f"{port} is in use by pid {program.pid} (python" in held.detail
    assert usable_ports(machine) == []
    (finding,) = servos_findings(machine)
    assert (finding.level, "no serial port is free" in finding.detail) == (Level.WARNING, True)


def test_ports_without_such_a_name_are_listed_unless_a_folder_is_given(machine, port):
    (machine.devices / "serial").mkdir()
    (machine.devices / "serial" / "by-id").symlink_to(machine.by_id)
    (machine.devices / "ttyUSB0").symlink_to(port)
    (machine.devices / "ttyACM3").touch()
    assert port_links(machine) == [machine.by_id / LINK]
    named = machine.devices / "serial" / "by-id" / LINK
    assert port_links(replace(machine, by_id=None)) == [named, machine.devices / "ttyACM3"]


def test_a_link_that_leads_nowhere_is_told(machine):
    (machine.by_id / "usb-gone").symlink_to("/dev/pts/no_such")
    assert "does not exist" in list(serial_findings(machine))[-1].detail


def test_no_port_is_a_warning(tmp_path):
    (finding,) = serial_findings(Machine(by_id=tmp_path / "by-id", devices=tmp_path))
    assert finding.level is Level.WARNING


@needs_root
def test_a_port_of_another_group_needs_the_group(machine, port):
    group = next(one for one in grp.getgrall() if one.gr_gid)
    os.chown(port, 0, group.gr_gid)
    port.chmod(0o660)
    first = as_nobody(serial_findings, LOOK, machine.by_id)[0]
    assert first["level"] == "problem"
    assert "this user may not use" in first["sentence"]
    assert first["remedy"] == [f"sudo usermod -aG {group.gr_name} $USER", "log out and in again"]


@needs_root
def test_a_port_without_rights_needs_a_rule(machine, port):
    port.chmod(0)
    first = as_nobody(serial_findings, LOOK, machine.by_id)[0]
    assert 'MODE="0660", GROUP="dialout"' in first["remedy"][0]
    assert "sudo usermod -aG dialout $USER" in first["remedy"]
