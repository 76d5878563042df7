"""Python, packages and OpenCV, judged by metadata that a test writes."""

import subprocess
from importlib.metadata import distributions

import pytest

from paramove.diagnosis.finding import Level, Machine
from paramove.diagnosis.installation import (
    installation_findings,
    opencv_finding,
    packages_finding,
    platform_finding,
    python_finding,
)

REQUIRED = ["numba>=0.63", "Opencv_Contrib.Python-headless>=4.12,<5", 'hypothesis>=6; extra == "dev"']
OPENCV = "opencv-contrib-python-headless"
VERSION = "print('4.14.0')"


@pytest.fixture
def installed(tmp_path):
    """Metadata of packages."""

    def make(**versions):
        for name, version in versions.items():
            folder = tmp_path / f"{name}-{version}.dist-info"
            folder.mkdir()
            metadata = f"Metadata-Version: 2.1\nName: {name.replace('_', '-')}\nVersion: {version}\n"
            if name == "paramove":
                metadata += f"Requires-Dist: {OPENCV}<5,>=4.12\n"
            if name == "mediapipe":
                metadata += "Requires-Dist: OpenCV_Python\n"
            (folder / "METADATA").write_text(metadata)
            owned = "cv2" if name.startswith("opencv") else name
            (folder / "RECORD").write_text(f"LICENSE,,\n{owned}/__init__.py,,\n")
        return list(distributions(path=[str(tmp_path)]))

    return make


@pytest.mark.parametrize(
    ("version", "level"), [("3.11.7", Level.OK), ("3.13.0rc1", Level.OK), ("3.14.1", Level.PROBLEM)]
)
def test_python_is_one_of_those_that_are_allowed(version, level):
    finding = python_finding(">=3.11,<3.14", version)
    assert (finding.level, version in finding.detail) == (level, True)
    assert bool(finding.remedy) == (level is Level.PROBLEM)


def test_another_platform_is_told():
    assert platform_finding("Linux", "x86_64").level is Level.OK
    assert platform_finding("Linux", "aarch64").level is Level.WARNING


def test_packages_in_their_ranges_are_well(installed):
    finding = packages_finding(REQUIRED, installed(numba="0.68.1", opencv_contrib_python_headless="4.14.0.94"))
    assert (finding.level, finding.detail) == (Level.OK, "all 2 required packages are installed")


def test_packages_outside_of_their_ranges_and_missing_ones_are_named_with_the_command(installed):
    finding = packages_finding(REQUIRED, installed(opencv_contrib_python_headless="5.0.0.93"))
    assert finding.level is Level.PROBLEM
    assert "numba is missing, numba>=0.63 is needed" in finding.detail
    assert "is 5.0.0.93" in finding.detail
    assert finding.remedy[0].endswith("-m pip install 'numba>=0.63' 'Opencv_Contrib.Python-headless<5,>=4.12'")


def test_what_an_interrupted_pip_left_is_passed_over_and_paramove_must_be_there(installed, tmp_path, monkeypatch):
    (tmp_path / "half-1.0.dist-info").mkdir()
    found = installed(numba="0.68.1")
    monkeypatch.setattr("paramove.diagnosis.installation.distributions", lambda: found)
    (finding,) = installation_findings(Machine())
    assert (finding.level, finding.detail) == (Level.PROBLEM, "paramove itself is not installed")
    assert len(found) == 2


def test_two_packages_that_hold_cv2_are_told_and_mended(installed, monkeypatch):
    found = installed(opencv_contrib_python_headless="4.14", opencv_python="4.12", mediapipe="0.10", paramove="0.1.0")
    finding = opencv_finding(found, VERSION)
    assert finding.level is Level.PROBLEM
    assert f"{OPENCV} (of paramove) and opencv-python (of mediapipe) both" in finding.detail
    calls = []
    monkeypatch.setattr(subprocess, "run", lambda command, **_: calls.append(" ".join(command[1:])))
    finding.fix.do()
    assert calls == [
        f"-P -m pip uninstall -y {OPENCV} opencv-python",
        f"-P -m pip install --force-reinstall --no-deps {OPENCV}<5,>=4.12",
    ]


def test_one_package_that_holds_cv2_is_well(installed):
    finding = opencv_finding(installed(opencv_contrib_python_headless="4.14"), VERSION)
    assert (finding.level, finding.detail) == (Level.OK, f"cv2 4.14.0 of {OPENCV}")


@pytest.mark.parametrize(
    ("script", "reason"),
    [("raise ImportError('libGL.so.1: cannot open')", "libGL.so.1"), ("import os; os.abort()", "exit code -6")],
)
def test_a_broken_cv2_is_told_with_its_reason(installed, script, reason):
    finding = opencv_finding(installed(opencv_contrib_python_headless="4.14"), script)
    assert finding.level is Level.PROBLEM
    assert reason in finding.detail
    assert "--force-reinstall" in finding.remedy[0]
