"""Which serial ports there are, whether they can be used, and the latency of their adapters."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from paramove.devices import holders, may_use, serial_remedy
from paramove.diagnosis.finding import Finding, Fix, Level, Machine, as_root
from paramove.robots.dynamixel import ServoPort, adapter_links

LATENCY_MS = 1
RULE = 'ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", ATTR{latency_timer}="1"'


def port_links(machine: Machine) -> list[Path]:
    """By the name of their adapter, or by their own name without one."""
    folder = _folder(machine)
    links = adapter_links(folder)
    if machine.by_id is not None:
        return links
    named = {link.resolve() for link in links}
    others = [path for kind in ("ttyUSB*", "ttyACM*") for path in sorted(machine.devices.glob(kind))]
    return [*links, *(path for path in others if path.resolve() not in named)]


def _folder(machine: Machine) -> Path:
    return machine.by_id or machine.devices / "serial" / "by-id"


def usable_ports(machine: Machine) -> list[Path]:
    """Those that are there, that this user may use, and that no other program has open."""
    return [port for port in port_links(machine) if port.exists() and may_use(port) and not holders(port)]


def serial_findings(machine: Machine) -> Iterator[Finding]:
    """One or two for each port."""
    links = port_links(machine)
    if not links:
        message = f"none found in {_folder(machine)}: plug in the adapter of the arm; the simulation needs none"
        yield Finding("serial ports", Level.WARNING, message)
    for link in links:
        yield port_finding(link)
        timer = machine.sysfs / "bus" / "usb-serial" / "devices" / link.resolve().name / "latency_timer"
        with contextlib.suppress(FileNotFoundError):  # not every adapter has one
            yield latency_finding(link, timer)


def port_finding(link: Path) -> Finding:
    """Whether the port may be used, and is not used by another program."""
    device = link.resolve()
    facts: dict[str, object] = {"port": str(link), "device": str(device)}
    if not device.exists():
        message = f"{link.name} leads to {device}, which does not exist"
        return Finding("serial port", Level.PROBLEM, message, ("unplug the adapter and plug it in again",), None, facts)
    if not may_use(link):
        message = f"{link.name}: this user may not use {device}"
        return Finding("serial port", Level.PROBLEM, message, serial_remedy(device), None, facts)
    if held := holders(link):
        facts["pid"] = held[0].pid
        message = f"{link.name}: {device} is in use by {', '.join(map(str, held))}"
        return Finding(
            "serial port", Level.PROBLEM, message, (f"end it in its terminal, or: kill {held[0].pid}",), None, facts
        )
    return Finding("serial port", Level.OK, f"{link.name}: {device} is free", facts=facts)


def latency_finding(link: Path, timer: Path) -> Finding:
    """Whether the adapter hands over received bytes within 1 ms; by default one of FTDI takes 16 ms.

    Args:
        link: The port.
        timer: File from which the time is read, ms, and to which another is written.
    """
    latency_ms = int(timer.read_text(encoding="utf-8"))
    facts = {"port": str(link), "latency_ms": latency_ms}
    if latency_ms <= LATENCY_MS:
        return Finding("usb latency", Level.OK, f"{link.name} hands over within {latency_ms} ms", facts=facts)
    message = (
        f"{link.name} hands over received bytes after up to {latency_ms} ms: each request to a servo takes as long"
    )
    remedy = (
        f"echo {LATENCY_MS} | {as_root('tee')} {timer}",
        f"for good: echo '{RULE}' | {as_root('tee')} /etc/udev/rules.d/99-paramove-latency.rules && "
        f"{as_root('udevadm control --reload-rules')} && {as_root('udevadm trigger --action=add')}",
    )
    fix = (
        Fix(f"set it to {LATENCY_MS} ms until it is unplugged", partial(_hasten, link, timer))
        if may_use(link)
        else None
    )
    return Finding("usb latency", Level.WARNING, message, remedy, fix, facts)


def _hasten(link: Path, timer: Path) -> None:
    """By the driver's file, which usually only root may write; else by a flag of the port, which its user may set."""
    if os.access(timer, os.W_OK):
        timer.write_text(f"{LATENCY_MS}\n", encoding="utf-8")
        return
    with ServoPort(str(link)) as port:
        if not port.low_latency:
            raise OSError(f"the driver of {link.name} has no low latency mode")
