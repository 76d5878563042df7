"""Checks of all parts of a machine, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from paramove.diagnosis.bus_findings import servos_findings
from paramove.diagnosis.cameras import camera_findings
from paramove.diagnosis.finding import Finding, Level, Machine, Part
from paramove.diagnosis.graphics import graphics_findings
from paramove.diagnosis.installation import installation_findings
from paramove.diagnosis.resources import resources_findings
from paramove.diagnosis.serial_ports import serial_findings

CHECKS: dict[Part, Callable[[Machine], Iterable[Finding]]] = {
    Part.INSTALLATION: installation_findings,
    Part.GRAPHICS: graphics_findings,
    Part.RESOURCES: resources_findings,
    Part.CAMERAS: camera_findings,
    Part.SERIAL: serial_findings,
    Part.SERVOS: servos_findings,
}


def examined(part: Part, machine: Machine) -> Sequence[Finding]:
    """The findings of a part; a check that fails itself is a finding too."""
    try:
        return list(CHECKS[part](machine))
    except OSError as error:
        return [Finding(part.value, Level.PROBLEM, f"cannot be checked: {error}")]
