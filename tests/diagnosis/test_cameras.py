"""Cameras of a system that a test makes."""

import pytest

from paramove.diagnosis.cameras import camera_findings
from paramove.diagnosis.finding import Level, Machine
from tests.diagnosis.unprivileged import as_nobody, needs_root


@pytest.fixture
def machine(open_folder):
    """With devices video0 and video1 of one camera, and video10 of another."""
    (open_folder / "dev").mkdir()
    for number, name, index in ((0, "Webcam C270", 0), (1, "Webcam C270", 1), (10, "Other\x1b[2J", 0)):
        (open_folder / "dev" / f"video{number}").touch()
        about = open_folder / "sys" / "class" / "video4linux" / f"video{number}"
        about.mkdir(parents=True)
        (about / "name").write_text(f"{name}\n")
        (about / "index").write_text(f"{index}\n")
    return Machine(devices=open_folder / "dev", sysfs=open_folder / "sys")


def test_devices_that_give_images_are_named(machine):
    found = list(camera_findings(machine))
    assert [one.facts["device"].rpartition("/")[2] for one in found] == ["video0", "video10"]
    assert all(one.level is Level.OK for one in found)
    assert found[0].detail.startswith("Webcam C270: ")


def test_no_camera_is_a_warning(tmp_path):
    (finding,) = camera_findings(Machine(devices=tmp_path))
    assert finding.level is Level.WARNING


@needs_root
def test_a_camera_that_may_not_be_used_is_told_with_the_command(machine):
    (machine.devices / "video0").chmod(0)
    code = "machine = Machine(devices=Path(sys.argv[1]), sysfs=Path(sys.argv[2]))\n"
    code += "print(json.dumps([told(one) for one in camera_findings(machine)]))"
    first = as_nobody(camera_findings, code, machine.devices, machine.sysfs)[0]
    assert first["level"] == "problem"
    assert "Webcam C270: this user may not" in first["sentence"]
    assert "sudo usermod -aG video $USER" in first["remedy"]
