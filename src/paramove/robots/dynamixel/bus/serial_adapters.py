"""USB adapters of serial buses, identified by their serial numbers: /dev/ttyUSB0 may be another after the next boot.

Adapters of some chips, such as the CH340, have no number, and those of others all the same. These are identified by
their kind and the USB port that they are plugged into, as udev's links in `by-path` have it.
"""

from __future__ import annotations

import os
import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from serial.tools.list_ports_linux import SysFS

from paramove.documents import InputError

BY_ID = Path("/dev/serial/by-id")
BY_ID_VARIABLE = "PARAMOVE_SERIAL_BY_ID"
INTERFACE = re.compile(r"-if\d+(-port\d+)?$")
BY_PATH = "by-path"
USB = "usb-"
"""Beginning of a link that names a USB adapter."""
NUMBER = re.compile(r"[0-9A-Za-z]*[0-9][0-9A-Za-z]*")
"""The form of numbers; the end of the name of an adapter without one is a word, such as Serial or USB2.0-Serial."""
SAME_FOR_ALL = re.compile(r"0*1?")
"""No number, and those that chips have until a maker writes another one, such as 0001 of the CP2102."""
NOTHING_FOUND = (
    "plug in the adapter and switch on its power; `ls /dev/ttyUSB* /dev/ttyACM*` shows whether the system detects it, "
    "`sudo usermod -aG dialout $USER` and a new login let you open it, and in a container the folder must be passed in"
)


@dataclass(frozen=True)
class SerialAdapter:
    """One adapter that is plugged in.

    Attributes:
        serial: Number that its maker gave it, such as FT6Z5NCH; without one, its kind and USB port:
            1a86:7523@pci-0000:00:14.0-usb-0:2:1.0.
        link: Name that stays the same from boot to boot.
        is_numbered: Whether its maker gave it a number. Otherwise another may take its place unnoticed.
    """

    serial: str
    link: Path
    is_numbered: bool = True

    @classmethod
    def at(cls, link: Path) -> SerialAdapter:
        """The adapter behind a link of udev, or behind any other name, which then takes the place of its number."""
        device = link.resolve()
        system = SysFS(str(device)) if device.is_relative_to("/dev") else None
        name = INTERFACE.sub("", link.name)
        last = name.rpartition("_")[2]
        if system is not None and system.usb_device_path:
            kind = f"{system.vid:04x}:{system.pid:04x}"
            number = system.serial_number or ""
        else:
            kind = ""
            is_unnumbered = link.parent.name == BY_PATH or (name.startswith(USB) and not NUMBER.fullmatch(last))
            number = "" if is_unnumbered else last
        if not SAME_FOR_ALL.fullmatch(number):
            return cls(number, link)
        port = _usb_port(link)
        identity = "@".join(filter(None, (kind, port))) if port else name.removeprefix(USB)
        return cls(identity, link, is_numbered=False)

    @property
    def device(self) -> str:
        """Name that it has now, such as /dev/ttyUSB0."""
        return str(self.link.resolve())


def _usb_port(link: Path) -> str:
    """Name of the USB port; "" where udev has made no link of it. Of two names it is the first in their order."""
    device = link.resolve()
    names = sorted(other.name for other in adapter_links(by_path(link.parent)) if other.resolve() == device)
    return re.sub(r"-port\d+$", "", names[0]) if names else ""


def by_path(by_id: Path) -> Path:
    """Folder of the links that name USB ports, beside that of the links that name adapters."""
    return by_id.parent / BY_PATH


def default_by_id() -> Path:
    """Folder of the links: $PARAMOVE_SERIAL_BY_ID, else /dev/serial/by-id."""
    return Path(os.environ.get(BY_ID_VARIABLE) or BY_ID)


def serial_adapters(by_id: Path | None = None) -> list[SerialAdapter]:
    """All that are plugged in, by serial number. A folder that is not there holds none.

    Of two adapters of one name udev links one by its name: the other is found by its USB port.
    """
    folder = by_id or default_by_id()
    links: dict[Path, Path] = {}
    for link in (*adapter_links(folder), *adapter_links(by_path(folder))):
        if link.exists():
            links.setdefault(link.resolve(), link)
    return sorted(map(SerialAdapter.at, links.values()), key=lambda one: one.serial)


def adapter_links(folder: Path) -> list[Path]:
    """All links of the folder, sorted; none if it is not there: udev takes it away with its last link."""
    try:
        return sorted(folder.iterdir())
    except FileNotFoundError:
        return []


def serial_adapter(serial: str = "", by_id: Path | None = None) -> SerialAdapter:
    """The adapter with this number; without one the only adapter there is.

    Raises:
        InputError: There is none or more than one; names those found and the remedy.
    """
    folder = by_id or default_by_id()
    found = serial_adapters(folder)
    if not found:
        raise InputError(f"no serial adapter in {folder}: {NOTHING_FOUND}", missing=True)
    listed = ", ".join(f"{one.serial} ({one.device})" for one in found)
    matches = [one for one in found if serial in ("", one.serial)]
    if not matches:
        raise InputError(f"no serial adapter {serial!r} in {folder}, found {listed}", missing=True)
    twice = [number for number, count in Counter(one.serial for one in matches).items() if count > 1]
    if twice:
        raise InputError(f"two adapters have the serial number {twice[0]!r}, found {listed}: unplug one of them")
    if len(matches) > 1:
        raise InputError(f"several serial adapters, found {listed}: name one by its number with --serial")
    return matches[0]
