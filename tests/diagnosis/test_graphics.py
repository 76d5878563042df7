"""Drawing without a display, by processes that may crash."""

import pytest

from paramove.diagnosis.finding import Level, Machine
from paramove.diagnosis.graphics import failure_to_draw, graphics_backend, graphics_findings


def found(failures, backend):
    (finding,) = graphics_findings(Machine(), lambda name: failures.get(name, ""), backend)
    return finding


def test_this_machine_draws():
    assert failure_to_draw(graphics_backend()) == ""


@pytest.mark.parametrize(
    ("script", "reason"),
    [
        ("import os; os.abort()", "crash (SIGABRT)"),
        ("raise OSError('no libEGL.so.1')", "OSError: no libEGL.so.1"),
        ("import sys; sys.exit('the picture is black')", "the picture is black"),
    ],
)
def test_a_crash_is_a_reason(script, reason):
    assert reason in failure_to_draw("egl", script)


def test_what_draws_is_named():
    finding = found({}, "osmesa")
    assert (finding.level, finding.facts["backend"]) == (Level.OK, "osmesa")


def test_the_other_library_is_offered_where_it_draws():
    finding = found({"egl": "no libEGL"}, "egl")
    assert finding.level is Level.PROBLEM
    assert "no libEGL" in finding.detail
    assert finding.remedy == ("export MUJOCO_GL=osmesa",)


def test_the_package_is_named_where_nothing_draws():
    finding = found({"egl": "no libEGL", "osmesa": "no libOSMesa"}, "egl")
    assert "apt-get install -y --no-install-recommends libosmesa6" in finding.remedy[0]


@pytest.mark.parametrize("name", ["egl", "osmesa"])
def test_the_environment_chooses(monkeypatch, name):
    monkeypatch.setenv("MUJOCO_GL", name.upper())
    assert graphics_backend() == name
