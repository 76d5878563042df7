"""Our port under the SDK's packet handler: what it waits for, who may open it, and what is left after a pulled plug."""

import pytest
from dynamixel_sdk import COMM_RX_TIMEOUT, COMM_SUCCESS, PacketHandler

from paramove.input_error import InputError
from paramove.robots.dynamixel.emulated_servo import EmulatedServo
from paramove.robots.dynamixel.emulator import DynamixelEmulator
from paramove.robots.dynamixel.servo_models import XL330_M288, XL430_W250
from paramove.robots.dynamixel.servo_port import LATENCY_S, PortLostError, ServoPort

INDIRECT_DATA = 224
PATIENT_S = 0.3
"""Other programs may keep the emulator waiting."""


@pytest.fixture
def emulator():
    with DynamixelEmulator([EmulatedServo(XL430_W250, 1, 1_000_000), EmulatedServo(XL330_M288, 2)]) as emulator:
        yield emulator


@pytest.fixture
def handler():
    return PacketHandler(2.0)


def test_servos_answer_through_it(emulator, handler):
    with ServoPort(emulator.port, latency_s=PATIENT_S) as port:
        assert handler.ping(port, 1) == (1060, COMM_SUCCESS, 0)
        assert handler.ping(port, 2)[1] == COMM_RX_TIMEOUT
        assert port.setBaudRate(57600)
        assert handler.ping(port, 2) == (1200, COMM_SUCCESS, 0)
        assert set(handler.broadcastPing(port)[0]) == {2}
        assert not port.low_latency  # of a pseudo-terminal


@pytest.mark.parametrize("data", [[0xFF, 0xFF, 0xFD], [0xFF, 0xFF, 0xFD, 0xFD], [0xFF, 0xFF, 0xFF, 0xFD, 0x00, 0xFF]])
def test_bytes_like_a_header_arrive(emulator, handler, data):
    with ServoPort(emulator.port, latency_s=PATIENT_S) as port:
        assert handler.writeTxRx(port, 1, INDIRECT_DATA, len(data), data) == (COMM_SUCCESS, 0)
        assert handler.readTxRx(port, 1, INDIRECT_DATA, len(data)) == (data, COMM_SUCCESS, 0)


def test_a_missing_servo_is_waited_for_as_long_as_its_bytes_take(emulator, handler):
    with ServoPort(emulator.port) as port:
        assert handler.ping(port, 9)[1] == COMM_RX_TIMEOUT
        assert port.timeout_s == pytest.approx((10 + 11) * 10 / 1_000_000 + 508e-6 + LATENCY_S)


def test_a_pulled_plug_is_told_and_leaves_nothing_busy(emulator, handler):
    port = ServoPort(emulator.port, latency_s=PATIENT_S)
    port.open()
    assert handler.ping(port, 1)[1] == COMM_SUCCESS
    emulator.unplug()
    with pytest.raises(PortLostError, match=r"went away \([A-Z][a-z/ ]+\): is its cable plugged in"):
        handler.ping(port, 1)
    assert not port.is_using
    with pytest.raises(PortLostError, match="not open"):
        handler.ping(port, 1)
    emulator.plug_in()
    port.name = emulator.port
    port.open()
    assert handler.ping(port, 1) == (1060, COMM_SUCCESS, 0)
    port.close()
    port.close()


def test_a_second_program_is_refused(emulator):
    with ServoPort(emulator.port), pytest.raises(InputError, match="in use by another program"):
        ServoPort(emulator.port).open()
    with ServoPort(emulator.port):
        pass


def test_a_port_that_is_not_there_or_none_is_told_with_those_that_are(tmp_path, monkeypatch):
    (tmp_path / "usb-FTDI_0001-if00-port0").touch()
    monkeypatch.setenv("PARAMOVE_SERIAL_BY_ID", str(tmp_path))
    with pytest.raises(InputError, match=r"found are: .*usb-FTDI_0001-if00-port0") as missing:
        ServoPort(str(tmp_path / "ttyUSB7")).open()
    assert missing.value.missing
    file = tmp_path / "file"
    file.touch()
    with pytest.raises(InputError, match="file is no serial port but something else: name a link in"):
        ServoPort(str(file)).open()
    with pytest.raises(InputError, match="is no serial port but something else"):
        ServoPort(str(tmp_path)).open()
