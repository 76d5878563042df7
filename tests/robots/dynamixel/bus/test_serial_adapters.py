"""Adapters are known by their USB serial numbers, whatever the system calls them today."""

import pytest

from paramove.documents.input_error import InputError
from paramove.robots.dynamixel.bus.serial_adapters import BY_ID_VARIABLE, serial_adapter, serial_adapters, serial_of


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
    ],
)
def test_the_number_is_in_the_name_of_the_link(name, serial):
    assert serial_of(name) == serial


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
    folder = plugged(tmp_path / "by-id", "usb-1a86_USB_Serial-if00-port0", "usb-2b97_USB_Serial-if00-port0")
    with pytest.raises(InputError, match=r"two adapters have the serial number 'Serial'"):
        serial_adapter("Serial", folder)
