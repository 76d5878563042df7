"""Whether MuJoCo can draw without a display, and by which library."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from ctypes.util import find_library

from paramove.diagnosis.finding import Finding, Level, Machine, as_root

PACKAGES = {"egl": "libegl1 libgl1", "osmesa": "libosmesa6"}
"""Debian's."""
INSTALL = "apt-get install -y --no-install-recommends"
TIMEOUT_S = 60.0
DRAW = """
import sys
from importlib import import_module
import mujoco, numpy
context = import_module("mujoco." + sys.argv[1]).GLContext(64, 48)
context.make_current()
model = mujoco.MjModel.from_xml_string(
    "<mujoco><worldbody><light pos='0 0 3'/><geom size='.5' rgba='1 0 0 1'/>"
    "<camera name='c' pos='0 -2 0' xyaxes='1 0 0 0 0 1'/></worldbody></mujoco>")
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
scene, camera = mujoco.MjvScene(model, maxgeom=10), mujoco.MjvCamera()
camera.type, camera.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, 0
drawn = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, drawn)
mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, camera, mujoco.mjtCatBit.mjCAT_ALL, scene)
mujoco.mjr_render(mujoco.MjrRect(0, 0, 64, 48), scene, drawn)
picture = numpy.empty((48, 64, 3), dtype=numpy.uint8)
mujoco.mjr_readPixels(picture, None, mujoco.MjrRect(0, 0, 64, 48), drawn)
sys.exit(0 if picture[24, 32, 0] > 0 else "the picture is black")
"""
"""A red ball."""


def graphics_backend() -> str:
    """`egl` or `osmesa`: that of MUJOCO_GL, else EGL where its library is, else software."""
    requested = os.environ.get("MUJOCO_GL", "").lower()
    if requested in PACKAGES:
        return requested
    return "egl" if find_library("EGL") or not find_library("OSMesa") else "osmesa"


def failure_to_draw(backend: str, script: str = DRAW) -> str:
    """Why a process of its own, which may crash, could not draw; "" if it could.

    Args:
        backend: `egl` or `osmesa`. MUJOCO_GL is set to it unless it is what the simulation would take.
        script: Is given it as its argument.
    """
    variables = dict(os.environ) if backend == graphics_backend() else {**os.environ, "MUJOCO_GL": backend}
    command = [sys.executable, "-P", "-c", script, backend]
    try:
        done = subprocess.run(command, env=variables, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
    except subprocess.TimeoutExpired:
        return f"nothing was drawn within {TIMEOUT_S:g} s"
    if done.returncode < 0:
        return f"its libraries crash ({signal.Signals(-done.returncode).name})"
    error = done.stderr.strip().splitlines()[-1:] or [f"exit code {done.returncode}"]
    return error[0] if done.returncode != 0 else ""


def graphics_findings(
    _: Machine, failure: Callable[[str], str] = failure_to_draw, backend: str | None = None
) -> Iterator[Finding]:
    """The library with which the simulation would draw, and if that fails, whether the other one works.

    Args:
        failure: Why a library does not draw, "" if it does.
        backend: That the simulation would take; default: by `graphics_backend`.
    """
    chosen = backend or graphics_backend()
    reason = failure(chosen)
    if not reason:
        facts = {"backend": chosen}
        yield Finding("graphics", Level.OK, f"MuJoCo draws without a display ({chosen})", facts=facts)
        return
    other = next(name for name in PACKAGES if name != chosen)
    message = f"MuJoCo does not draw with {chosen}: {reason}"
    if failure(other):
        remedy = (f"{as_root('apt-get update')} && {as_root(INSTALL)} {PACKAGES['osmesa']}", "export MUJOCO_GL=osmesa")
        yield Finding("graphics", Level.PROBLEM, message, remedy)
    else:
        yield Finding("graphics", Level.PROBLEM, f"{message}; with {other} it does", (f"export MUJOCO_GL={other}",))
