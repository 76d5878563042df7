"""Adapters are known by their USB serial numbers, whatever the system calls them today."""

import pytest

from paramove.documents.input_error import InputError
from paramove.robots.dynamixel.bus.serial_adapters import (
    BY_ID_VARIABLE,
    SerialAdapter,
    serial_adapter,
    serial_adapters,
)


def plugged(folder, *names):
    """Links as udev makes them, each to a device of its own."""
    for place, name in enumerate(names):
        device = folder.parent / f"ttyUSB{place}"
        device.touch()
        folder.mkdir(exist_ok=True)
        (folder / name).symlink_to(device)
    return folder


@pytest.mark.parametrize(
    ("name", "serial"),
    [
        ("usb-FTDI_USB__-__Serial_Converter_FT6Z5NCH-if00-port0", "FT6Z5NCH"),
        ("usb-ROBOTIS_OpenRB-150_8D2A0F0A5055344C31202020FF0C1B2E-if00", "8D2A0F0A5055344C31202020FF0C1B2E"),
        ("usb-1a86_USB_Single_Serial_58FA083324-if00", "58FA083324"),
        ("port", "port"),
    ],
)
def test_the_number_is_in_the_name_of_the_link(tmp_path, name, serial):
    (tmp_path / name).touch()
    found = SerialAdapter.at(tmp_path / name)
    assert (found.serial, found.is_numbered) == (serial, True)


UNNUMBERED = (
    "usb-1a86_USB_Serial-if00-port0",
    "usb-1a86_USB2.0-Serial-if00-port0",
    "usb-Prolific_Technology_Inc._USB-Serial_Controller-if00-port0",
    "usb-Silicon_Labs_CP2102_USB_to_UART_Bridge_Controller_0001-if00-port0",
)
PORTS = ("pci-0000:00:14.0-usb-0:1:1.0-port0", "pci-0000:00:14.0-usb-0:2:1.0-port0")


@pytest.mark.parametrize("name", UNNUMBERED)
def test_an_adapter_without_a_number_of_its_own_is_known_by_its_usb_port(tmp_path, name):
    link = plugged(tmp_path / "by-id", name) / name
    assert SerialAdapter.at(link) == SerialAdapter(name.removeprefix("usb-").removesuffix("-if00-port0"), link, False)
    (tmp_path / "by-path").mkdir()
    for form in ("usb", "usbv2"):
        (tmp_path / "by-path" / PORTS[0].replace("usb", form)).symlink_to(link.resolve())
    assert SerialAdapter.at(link) == SerialAdapter("pci-0000:00:14.0-usb-0:1:1.0", link, False)


def test_two_adapters_of_one_name_are_both_found(tmp_path):
    """Both have the one link by name in turn, as udev makes it: whoever came last."""
    name = UNNUMBERED[0]
    folder, found = tmp_path / "by-id", []
    folder.mkdir()
    plugged(tmp_path / "by-path", *PORTS)
    for last in (0, 1):
        (folder / name).unlink(missing_ok=True)
        (folder / name).symlink_to(tmp_path / f"ttyUSB{last}")
        found.append([(one.serial, one.device) for one in serial_adapters(folder)])
    assert found[0] == found[1]
    assert [serial for serial, _ in found[0]] == ["pci-0000:00:14.0-usb-0:1:1.0", "pci-0000:00:14.0-usb-0:2:1.0"]
    assert serial_adapter("pci-0000:00:14.0-usb-0:2:1.0", folder).device == str(tmp_path / "ttyUSB1")


def test_adapters_are_found_by_their_number(tmp_path):
    folder = plugged(tmp_path / "by-id", "usb-FTDI_Converter_B7-if00-port0", "usb-FTDI_Converter_A1-if00-port0")
    (folder / "usb-FTDI_Converter_GONE-if00-port0").symlink_to(tmp_path / "unplugged")
    assert [one.serial for one in serial_adapters(folder)] == ["A1", "B7"]
    assert serial_adapter("B7", folder).device == str(tmp_path / "ttyUSB0")
    with pytest.raises(InputError, match=r"several .*A1 .*B7 .*--serial"):
        serial_adapter("", folder)
    with pytest.raises(InputError, match=r"no serial adapter 'C9'.*found A1") as told:
        serial_adapter("C9", folder)
    assert told.value.missing


def test_nothing_plugged_in_is_told_with_what_helps(tmp_path, monkeypatch):
    with pytest.raises(InputError, match=r"no serial adapter in .*plug in.*dialout") as told:
        serial_adapter("", tmp_path / "by-id")
    assert told.value.missing
    monkeypatch.setenv(BY_ID_VARIABLE, str(plugged(tmp_path / "by-id", "usb-FTDI_Converter_A1-if00-port0")))
    assert serial_adapter().serial == "A1"


def test_two_adapters_of_one_number_are_refused(tmp_path):
    folder = plugged(tmp_path / "by-id", "usb-1a86_USB_Serial_77A1-if00-port0", "usb-2b97_USB_Serial_77A1-if00-port0")
    with pytest.raises(InputError, match=r"two adapters have the serial number '77A1'"):
        serial_adapter("77A1", folder)
