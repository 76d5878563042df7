"""Which cameras are plugged in, and whether this user may use them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from paramove.devices import access_remedy, holders, may_use
from paramove.diagnosis.finding import Finding, Level, Machine


def camera_findings(machine: Machine) -> Iterator[Finding]:
    """One for each device that gives images."""
    devices = sorted(machine.devices.glob("video[0-9]*"), key=lambda path: (len(path.name), path.name))
    cameras = [path for path in devices if _about(machine.sysfs, path, "index") in ("", "0")]
    for path in cameras:
        yield camera_finding(path, _about(machine.sysfs, path, "name") or "unnamed")
    if not cameras:
        message = f"none found ({machine.devices}/video*): plug one in; the simulation needs none"
        yield Finding("cameras", Level.WARNING, message)


def camera_finding(device: Path, name: str) -> Finding:
    """Whether it may be used, and is not used by another program."""
    facts = {"device": str(device), "name": name}
    if not may_use(device):
        message = f"{name}: this user may not read {device}"
        return Finding("camera", Level.PROBLEM, message, access_remedy(device, "video", "video*"), facts=facts)
    if held := holders(device):
        who = ", ".join(map(str, held))
        remedy = (f"end it in its terminal, or: kill {held[0].pid}",)
        return Finding("camera", Level.WARNING, f"{name}: {device} is in use by {who}", remedy, facts=facts)
    return Finding("camera", Level.OK, f"{name}: {device}", facts=facts)


def _about(sysfs: Path, device: Path, attribute: str) -> str:
    """A second device of a camera, with index 1, gives data about the images; "" without the attribute."""
    path = sysfs / "class" / "video4linux" / device.name / attribute
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:  # it has none, or went away
        return ""
