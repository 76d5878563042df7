"""A servo gets its ID and baud rate only when it is alone, and what was written is read back."""

import pytest

from dynamixel_emulator.emulator import DynamixelEmulator
from dynamixel_emulator.servo import EmulatedServo
from paramove.documents.input_error import InputError
from paramove.robots.dynamixel.bus.servo_chain import ServoChain
from paramove.robots.dynamixel.bus.servo_models import BAUD_RATES, XL430_W250
from paramove.robots.dynamixel.bus.servo_port import ServoPort
from paramove.robots.dynamixel.bus.servo_setup import only_servo, set_up

RATES = (2_000_000, 1_000_000)


@pytest.fixture
def connected():
    """Servos on a bus and the chain to them."""
    opened = []

    def connect(*servos):
        emulator = DynamixelEmulator(servos).__enter__()
        port = ServoPort(emulator.port, 2_000_000, latency_s=0.1)
        port.open()
        opened.append((port, emulator))
        return ServoChain(port), emulator

    yield connect
    for port, emulator in opened:
        port.close()
        emulator.__exit__(None, None, None)


@pytest.mark.parametrize("before", [(1, 2_000_000), (7, 2_000_000), (3, 2_000_000), (1, 1_000_000)])
def test_a_servo_is_set_up_from_any_id_and_baud_rate(connected, before):
    servo = EmulatedServo("xl330_m288", *before)
    servo.memory["Torque Enable"] = 1  # its settings are locked until it is off
    chain, _ = connected(servo)
    found = set_up(chain, only_servo(chain, RATES), 3, 1_000_000, "xl330_m288")
    assert (found.number, found.baud_rate, found.torque) == (3, 1_000_000, False)
    assert (servo.id, servo.baud_rate, servo.memory["Return Delay Time"]) == (3, 1_000_000, 0)
    assert chain.port.baud_rate == 1_000_000


def test_two_servos_are_refused(connected):
    chain, emulator = connected(EmulatedServo("xl330_m288", 1, 2_000_000), EmulatedServo("xl330_m288", 4, 1_000_000))
    with pytest.raises(InputError, match=r"exactly one servo .*found ID 1 \(xl330_m288\), ID 4 .*connect one alone"):
        only_servo(chain, RATES)
    chain, emulator = connected(EmulatedServo("xl330_m288", 1, 2_000_000), EmulatedServo("xl330_m288", 1, 2_000_000))
    emulator.bus.servos[1].temperature = 45.0
    with pytest.raises(InputError, match=r"found ID 1 \(.*probably two servos have this ID.*connect one alone"):
        only_servo(chain, RATES, range(4))


def test_no_servo_is_told(connected):
    chain, _ = connected(EmulatedServo("xl330_m288", 1, 9600))
    with pytest.raises(InputError, match=r"found none at 2000000, 1000000: check its power"):
        only_servo(chain, RATES)


@pytest.mark.parametrize(
    ("number", "baud_rate", "model", "told"),
    [
        (3, 1_000_000, "xl430_w250", "expected a servo xl430_w250 for ID 3, found xl330_m288"),
        (253, 1_000_000, "", "an ID is 0 to 252, found 253"),
        (3, 4_500_000, "", "xl330_m288 .* 9600, .*4000000, found 4500000"),
    ],
)
def test_what_cannot_be_is_refused_before_anything_is_written(connected, number, baud_rate, model, told):
    servo = EmulatedServo("xl330_m288", 1, 2_000_000)
    chain, _ = connected(servo)
    before = bytes(servo.memory.read(0, 64))
    with pytest.raises(InputError, match=told):
        set_up(chain, only_servo(chain, RATES), number, baud_rate, model)
    assert bytes(servo.memory.read(0, 64)) == before


def test_a_value_that_does_not_stay_is_told(connected, monkeypatch):
    servo = EmulatedServo("xl430_w250", 1, 2_000_000)
    chain, _ = connected(servo)
    found = only_servo(chain, RATES)
    write = chain.write
    lost = XL430_W250.registers["Return Delay Time"]
    monkeypatch.setattr(chain, "write", lambda number, one, value: None if one is lost else write(number, one, value))
    with pytest.raises(InputError, match="Return Delay Time was written as 0, but reads 250"):
        set_up(chain, found, 2, 2_000_000)
    assert servo.memory["Baud Rate"] == BAUD_RATES.index(2_000_000)
