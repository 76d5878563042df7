"""Folders, sockets, disks and limits."""

import os
import resource

import pytest

from paramove.diagnosis.finding import Level, Machine
from paramove.diagnosis.resources import (
    FEW_BYTES,
    LITTLE_BYTES,
    disk_finding,
    environment_findings,
    folder_finding,
    may_set_any_priority,
    open_files_finding,
    priority_finding,
    resources_findings,
    sockets_finding,
)
from paramove.supervision.environment import OPEN_FILES
from paramove.workspace import Workspace
from tests.diagnosis.unprivileged import NOBODY, as_nobody, needs_root
from tests.docs.markdown import ROOT


def test_a_folder_that_can_be_made_is_well(tmp_path):
    assert folder_finding("cache", tmp_path / "a" / "b").level is Level.OK
    assert not (tmp_path / "a").exists()


def test_a_file_in_the_place_of_a_folder_is_told(tmp_path):
    (tmp_path / "cache").touch()
    finding = folder_finding("cache", tmp_path / "cache" / "models")
    assert (finding.level, "is no folder" in finding.detail) == (Level.PROBLEM, True)


@needs_root
def test_what_root_made_in_an_own_folder_is_for_root_to_give(open_folder):
    os.chown(open_folder, NOBODY, NOBODY)
    runs = open_folder / "runs"
    runs.mkdir()
    code = "print(json.dumps(told(folder_finding('runs', Path(sys.argv[1])))))"
    finding = as_nobody(folder_finding, code, runs)
    assert (finding["level"], finding["fix"]) == ("problem", False)
    assert finding["remedy"] == [f"sudo chown -R {NOBODY} {runs}"]


@needs_root
def test_what_is_not_the_users_is_left_alone():
    folders = ["/no_such/x", "/home", "/var/cache/paramove", "/dev/null", "/root/.cache/paramove"]
    code = "found = [told(folder_finding(n, Path(f))) for n in ('cache', 'temporary', 'runs') for f in sys.argv[1:]]\n"
    for finding in as_nobody(folder_finding, code + "print(json.dumps(found))", *folders):
        assert (finding["level"], finding["fix"]) == ("problem", False)
        (remedy,) = finding["remedy"]
        assert not {"chown", "chmod", "mv", "sudo"} & set(remedy.split())
        assert ("export" in remedy) != ("--runs" in remedy)


@needs_root
def test_a_link_to_a_folder_of_somebody_else_is_not_given_away(open_folder, short_folder):
    os.chown(open_folder, NOBODY, NOBODY)
    (open_folder / "cache").symlink_to("/var/cache")
    code = "print(json.dumps(told(folder_finding('cache', Path(sys.argv[1])))))"
    assert "chown" not in as_nobody(folder_finding, code, open_folder / "cache")["remedy"][0]


@needs_root
def test_an_own_folder_is_mended(open_folder):
    os.chown(open_folder, NOBODY, NOBODY)
    open_folder.chmod(0o500)
    code = "before = folder_finding('runs', Path(sys.argv[1])); before.fix.do()\n"
    code += "print(json.dumps([told(before), told(folder_finding('runs', Path(sys.argv[1])))]))"
    before, after = as_nobody(folder_finding, code, open_folder)
    assert before["remedy"] == [f"chmod u+rwx {open_folder}"]
    assert (before["level"], after["level"]) == ("problem", "ok")


def test_a_runtime_folder_that_is_too_long_for_sockets_is_told(tmp_path, monkeypatch):
    long = tmp_path / ("x" * 80)
    long.mkdir()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(long))
    finding = sockets_finding()
    assert finding.level is Level.PROBLEM
    assert "too long" in finding.detail
    assert "export XDG_RUNTIME_DIR=/tmp/" in finding.remedy[0]


def test_a_runtime_folder_that_is_a_link_is_told(tmp_path, monkeypatch, short_folder):
    (short_folder / "paramove").symlink_to(tmp_path)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(short_folder))
    assert "no folder of this user" in sockets_finding().detail


def test_a_name_that_no_domain_has_is_told(monkeypatch):
    monkeypatch.setenv("PARAMOVE_DOMAIN", "Two Words")
    finding = sockets_finding()
    assert (finding.level, finding.remedy) == (Level.PROBLEM, ("unset PARAMOVE_DOMAIN",))


def test_a_short_runtime_folder_is_well(monkeypatch, short_folder):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(short_folder))
    monkeypatch.delenv("PARAMOVE_DOMAIN", raising=False)
    assert sockets_finding().facts["folder"] == str(short_folder / "paramove" / "default")
    assert sockets_finding().level is Level.OK


@pytest.mark.parametrize(
    ("free", "level"),
    [(FEW_BYTES, Level.OK), (FEW_BYTES - 1, Level.WARNING), (LITTLE_BYTES - 1, Level.PROBLEM)],
)
def test_little_room_on_a_disk_is_told(tmp_path, free, level):
    finding = disk_finding("runs", tmp_path, free)
    assert finding.level is level
    assert bool(finding.remedy) == (level is not Level.OK)


@pytest.mark.parametrize(
    ("limit", "level"),
    [(resource.RLIM_INFINITY, Level.OK), (OPEN_FILES, Level.OK), (OPEN_FILES - 1, Level.PROBLEM)],
)
def test_too_few_open_files_are_told(limit, level):
    assert open_files_finding(limit).level is level


@pytest.mark.parametrize(
    ("may_set_any", "limit", "level"),
    [
        (True, 0, Level.OK),
        (False, resource.RLIM_INFINITY, Level.OK),
        (False, 30, Level.OK),
        (False, 29, Level.WARNING),
        (False, 0, Level.WARNING),
    ],
)
def test_a_driver_that_may_not_come_before_other_programs_is_reported(may_set_any, limit, level):
    assert priority_finding(may_set_any, limit).level is level


@needs_root
def test_the_remedy_gives_an_ordinary_user_the_priority():
    code = "print(json.dumps(told(priority_finding(False, 0))))"
    line, _ = as_nobody(priority_finding, code)["remedy"]
    assert line.startswith("echo $(id -un) - nice -10 | sudo tee /etc/security/limits.d/")


@needs_root
def test_the_capability_is_that_of_the_process(tmp_path):
    status = tmp_path / "status"
    for mask, may in (("0000000000800000", True), ("000001ffff7fffff", False)):
        status.write_text(f"CapPrm:\tffffffffffffffff\nCapEff:\t{mask}\n")
        assert may_set_any_priority(status) == may
    assert not as_nobody(may_set_any_priority, "print(json.dumps(may_set_any_priority()))")


def test_a_variable_in_the_way_is_told(monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", "/no/such/folder")
    assert any(
        "XDG_RUNTIME_DIR" in one.detail
        for one in environment_findings(Workspace.at(ROOT))
        if one.level is Level.WARNING
    )


def test_outside_of_a_clone_runs_lie_where_one_is(tmp_path):
    found = {one.subject: one for one in resources_findings(Machine(folder=tmp_path))}
    assert found["runs folder"].facts["folder"] == str(tmp_path / "runs")
