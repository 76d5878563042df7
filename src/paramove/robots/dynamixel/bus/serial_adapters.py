"""USB adapters of serial buses, identified by their serial numbers: /dev/ttyUSB0 may be another after the next boot."""

from __future__ import annotations

import os
import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from paramove.documents import InputError

BY_ID = Path("/dev/serial/by-id")
BY_ID_VARIABLE = "PARAMOVE_SERIAL_BY_ID"
INTERFACE = re.compile(r"-if\d+(-port\d+)?$")
NOTHING_FOUND = (
    "plug in the adapter and switch on its power; `ls /dev/ttyUSB* /dev/ttyACM*` shows whether the system detects it, "
    "`sudo usermod -aG dialout $USER` and a new login let you open it, and in a container the folder must be passed in"
)


@dataclass(frozen=True)
class SerialAdapter:
    """One adapter that is plugged in.

    Attributes:
        serial: Number that its maker gave it, such as FT6Z5NCH.
        link: Name that stays the same from boot to boot.
    """

    serial: str
    link: Path

    @property
    def device(self) -> str:
        """Name that it has now, such as /dev/ttyUSB0."""
        return str(self.link.resolve())


def default_by_id() -> Path:
    """Folder of the links: $PARAMOVE_SERIAL_BY_ID, else /dev/serial/by-id."""
    return Path(os.environ.get(BY_ID_VARIABLE) or BY_ID)


def serial_of(name: str) -> str:
    """USB serial number within a link's name: FT6Z5NCH of usb-FTDI_USB__-__Serial_Converter_FT6Z5NCH-if00-port0."""
    return INTERFACE.sub("", name).rpartition("_")[2]


def serial_adapters(by_id: Path | None = None) -> list[SerialAdapter]:
    """All that are plugged in, by serial number. A folder that is not there holds none."""
    links = [path for path in adapter_links(by_id or default_by_id()) if path.exists()]
    return sorted((SerialAdapter(serial_of(path.name), path) for path in links), key=lambda one: one.serial)


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
