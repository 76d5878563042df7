"""The sample programs of dynamixel-sdk for Protocol 2.0, rewritten from its documented calls.

The SDK is unmodified; only the name of the port and the baud rate are the emulator's.
"""

import time

import pytest
from dynamixel_easy_sdk import Connector
from dynamixel_easy_sdk.data_types import Direction, OperatingMode, ProfileConfiguration
from dynamixel_easy_sdk.dynamixel_error import DxlError, DxlRuntimeError
from dynamixel_sdk import (
    COMM_SUCCESS,
    DXL_HIBYTE,
    DXL_HIWORD,
    DXL_LOBYTE,
    DXL_LOWORD,
    GroupBulkRead,
    GroupBulkWrite,
    GroupSyncRead,
    GroupSyncWrite,
    PacketHandler,
    PortHandler,
    port_handler,
)

from dynamixel_emulator.emulator import DynamixelEmulator
from dynamixel_emulator.models import XL430_W250, XM430_W210, XM430_W350
from dynamixel_emulator.servo import EmulatedServo

BAUD = 1_000_000
ID, BAUD_RATE, DRIVE_MODE, MODE = 7, 8, 10, 11
TORQUE, LED, GOAL_PWM, GOAL_VELOCITY, PROFILE_VELOCITY, GOAL, MOVING = 64, 65, 100, 104, 112, 116, 122
PRESENT_VELOCITY, PRESENT = 128, 132
INDIRECT_ADDRESS, INDIRECT_DATA = 168, 224
NEAR = 20
LOW, HIGH = 1800, 2300


@pytest.fixture(autouse=True)
def long_timeout(monkeypatch):
    """Increases the SDK's timeout, because other programs can delay the emulator."""
    monkeypatch.setattr(port_handler, "LATENCY_TIMER", 150)


@pytest.fixture
def emulator():
    models = (XL430_W250, XM430_W350, XM430_W210)
    with DynamixelEmulator([EmulatedServo(model, n, BAUD) for n, model in enumerate(models, start=1)]) as emulator:
        yield emulator


@pytest.fixture
def port(emulator):
    port = PortHandler(emulator.port)
    assert port.openPort()
    assert port.setBaudRate(BAUD)
    yield port
    port.closePort()


packets = PacketHandler(2.0)


def succeeded(reply):
    """Fails the test on an error, which the sample programs print; returns the value that was read, if any."""
    *value, result, error = reply
    assert result == COMM_SUCCESS, packets.getTxRxResult(result)
    assert error == 0, packets.getRxPacketError(error)
    return value[0] if value else None


def parts(value):
    """The four bytes of a position, as in the samples."""
    low, high = DXL_LOWORD(value), DXL_HIWORD(value)
    return [DXL_LOBYTE(low), DXL_HIBYTE(low), DXL_LOBYTE(high), DXL_HIBYTE(high)]


def until(done, within_s=60.0):
    end_s = time.monotonic() + within_s
    while not done():
        assert time.monotonic() < end_s, "timeout"


def goes_to(port, number, goal):
    succeeded(packets.write4ByteTxRx(port, number, GOAL, goal))
    until(lambda: abs(succeeded(packets.read4ByteTxRx(port, number, PRESENT)) - goal) <= NEAR)


def test_ping(port):
    assert succeeded(packets.ping(port, 1)) == 1060


def test_broadcast_ping(port):
    found, result = packets.broadcastPing(port)
    assert result == COMM_SUCCESS
    assert found == {1: [1060, 46], 2: [1020, 46], 3: [1030, 46]}


def test_read_write(port):
    succeeded(packets.write1ByteTxRx(port, 1, TORQUE, 1))
    for goal in (LOW, HIGH):
        goes_to(port, 1, goal)
    succeeded(packets.write1ByteTxRx(port, 1, TORQUE, 0))


def test_sync_read_write_and_fast_sync_read(port):
    writer, reader = GroupSyncWrite(port, packets, GOAL, 4), GroupSyncRead(port, packets, PRESENT, 4)
    for number in (1, 2):
        succeeded(packets.write1ByteTxRx(port, number, TORQUE, 1))
        assert reader.addParam(number)
    for goal, read in ((LOW, reader.txRxPacket), (HIGH, reader.fastSyncRead)):
        for number in (1, 2):
            assert writer.addParam(number, parts(goal))
        assert writer.txPacket() == COMM_SUCCESS
        writer.clearParam()

        def there(goal=goal, read=read):
            assert read() == COMM_SUCCESS
            assert all(reader.isAvailable(number, PRESENT, 4) for number in (1, 2))
            return all(abs(reader.getData(number, PRESENT, 4) - goal) <= NEAR for number in (1, 2))

        until(there)


def test_bulk_read_write_and_fast_bulk_read(port):
    writer, reader = GroupBulkWrite(port, packets), GroupBulkRead(port, packets)
    succeeded(packets.write1ByteTxRx(port, 1, TORQUE, 1))
    assert reader.addParam(1, PRESENT, 4)
    assert reader.addParam(2, LED, 1)
    for goal, led, read in ((LOW, 0, reader.txRxPacket), (HIGH, 1, reader.fastBulkRead)):
        assert writer.addParam(1, GOAL, 4, parts(goal))
        assert writer.addParam(2, LED, 1, [led])
        assert writer.txPacket() == COMM_SUCCESS
        writer.clearParam()

        def there(goal=goal, read=read):
            assert read() == COMM_SUCCESS
            return abs(reader.getData(1, PRESENT, 4) - goal) <= NEAR

        until(there)
        assert reader.getData(2, LED, 1) == led


def test_indirect_address(port):
    for i in range(4):
        succeeded(packets.write2ByteTxRx(port, 1, INDIRECT_ADDRESS + 2 * i, GOAL + i))
        succeeded(packets.write2ByteTxRx(port, 1, INDIRECT_ADDRESS + 2 * (5 + i), PRESENT + i))
    succeeded(packets.write2ByteTxRx(port, 1, INDIRECT_ADDRESS + 2 * 4, LED))
    succeeded(packets.write2ByteTxRx(port, 1, INDIRECT_ADDRESS + 2 * 9, MOVING))
    succeeded(packets.write1ByteTxRx(port, 1, TORQUE, 1))
    writer = GroupSyncWrite(port, packets, INDIRECT_DATA, 5)
    reader = GroupSyncRead(port, packets, INDIRECT_DATA + 5, 5)
    assert reader.addParam(1)
    assert writer.addParam(1, [*parts(HIGH), 1])
    assert writer.txPacket() == COMM_SUCCESS

    def there():
        assert reader.txRxPacket() == COMM_SUCCESS
        return abs(reader.getData(1, INDIRECT_DATA + 5, 4) - HIGH) <= NEAR

    until(there)
    assert succeeded(packets.read1ByteTxRx(port, 1, LED)) == 1
    until(lambda: there() and reader.getData(1, INDIRECT_DATA + 9, 1) == 0)


def test_reboot(port):
    succeeded(packets.write1ByteTxRx(port, 1, LED, 1))
    succeeded(packets.reboot(port, 1))
    until(lambda: packets.ping(port, 1)[1] == COMM_SUCCESS)
    assert succeeded(packets.read1ByteTxRx(port, 1, LED)) == 0


def test_factory_reset(port):
    succeeded(packets.write1ByteTxRx(port, 1, MODE, 1))
    succeeded(packets.factoryReset(port, 1, 0x01))  # except the ID
    assert port.setBaudRate(57600)
    until(lambda: packets.ping(port, 1)[1] == COMM_SUCCESS)
    assert succeeded(packets.read1ByteTxRx(port, 1, BAUD_RATE)) == 1
    assert succeeded(packets.read1ByteTxRx(port, 1, MODE)) == 3
    succeeded(packets.write1ByteTxRx(port, 1, BAUD_RATE, 3))
    assert port.setBaudRate(BAUD)
    assert succeeded(packets.ping(port, 1)) == 1060


def test_extended_position_and_clear_multi_turn(port):
    succeeded(packets.write1ByteTxRx(port, 1, MODE, 4))
    succeeded(packets.write1ByteTxRx(port, 1, TORQUE, 1))
    goes_to(port, 1, 4300)
    succeeded(packets.write4ByteTxRx(port, 1, GOAL, 2**32 - 500))

    def at_minus_500():
        return abs(succeeded(packets.read4ByteTxRx(port, 1, PRESENT)) - 2**32 + 500) <= NEAR

    until(at_minus_500)
    until(lambda: succeeded(packets.read4ByteTxRx(port, 1, PRESENT_VELOCITY)) == 0)
    succeeded(packets.write1ByteTxRx(port, 1, TORQUE, 0))
    succeeded(packets.clearMultiTurn(port, 1))
    assert abs(succeeded(packets.read4ByteTxRx(port, 1, PRESENT)) - (4096 - 500)) <= NEAR


def test_reg_write_and_action(port):
    for number in (1, 2):
        succeeded(packets.write1ByteTxRx(port, number, TORQUE, 1))
        succeeded(packets.regWriteTxRx(port, number, GOAL, 4, parts(LOW)))
    assert succeeded(packets.read4ByteTxRx(port, 1, PRESENT)) == 2048
    assert packets.action(port, 254) == COMM_SUCCESS
    for number in (1, 2):
        until(lambda number=number: abs(succeeded(packets.read4ByteTxRx(port, number, PRESENT)) - LOW) <= NEAR)


def test_velocity_mode_and_a_time_based_profile(port):
    succeeded(packets.write1ByteTxRx(port, 2, MODE, 1))
    succeeded(packets.write1ByteTxRx(port, 2, TORQUE, 1))
    succeeded(packets.write4ByteTxRx(port, 2, GOAL_VELOCITY, 2**32 - 50))
    until(lambda: succeeded(packets.read4ByteTxRx(port, 2, PRESENT_VELOCITY)) == 2**32 - 50)
    succeeded(packets.write1ByteTxRx(port, 3, DRIVE_MODE, 4))
    succeeded(packets.write4ByteTxRx(port, 3, PROFILE_VELOCITY, 300))
    succeeded(packets.write1ByteTxRx(port, 3, TORQUE, 1))
    goes_to(port, 3, HIGH)


class TestEasySdk:
    """The high-level client of the SDK."""

    @pytest.fixture
    def connector(self, emulator):
        connector = Connector(emulator.port, BAUD)
        yield connector
        connector.closePort()

    def test_it_finds_all_servos_and_their_models(self, connector):
        motors = connector.createAllMotors()
        assert [(motor.id, motor.model_number) for motor in motors] == [(1, 1060), (2, 1020), (3, 1030)]
        assert [motor.operating_mode_status for motor in motors] == [OperatingMode.POSITION] * 3

    def test_it_moves_one_servo(self, connector):
        motor = connector.createMotor(2)
        motor.setPositionPGain(900)
        motor.setProfileConfiguration(ProfileConfiguration.TIME_BASED)
        motor.setDirection(Direction.REVERSE)
        motor.setHomingOffset(100)
        motor.setMaxPositionLimit(3500)
        assert motor.getMaxPositionLimit() == 3500
        motor.enableTorque()
        assert motor.isTorqueOn() == 1
        motor.setGoalPosition(2500)
        until(lambda: abs(motor.getPresentPosition() - 2500) <= NEAR)
        with pytest.raises(DxlRuntimeError):
            motor.setGoalPosition(3501)
        motor.disableTorque()
        motor.setOperatingMode(OperatingMode.VELOCITY)
        motor.enableTorque()
        motor.setGoalVelocity(-40)
        until(lambda: motor.getPresentVelocity() == -40)
        assert motor.getPresentCurrent() == 0  # no load
        motor.disableTorque()
        motor.changeID(7)
        assert motor.ping() == 1020
        motor.factoryResetExceptIDAndBaudRate()
        until(lambda: _replies(motor))
        assert motor.getOperatingMode() == OperatingMode.POSITION

    def test_it_moves_several_servos_simultaneously(self, connector):
        first, second = connector.createMotor(1), connector.createMotor(3)
        group = connector.createGroupExecutor()
        for motor in (first, second):
            group.addCmd(motor.stageEnableTorque())
        group.executeWrite()
        group.clearStagedWriteCommands()
        group.addCmd(first.stageSetGoalPosition(LOW))
        group.addCmd(second.stageSetGoalPosition(HIGH))
        group.executeWrite()
        for motor in (first, second):
            group.addCmd(motor.stageGetPresentPosition())
        until(lambda: all(abs(a - b) <= NEAR for a, b in zip(group.executeRead(), (LOW, HIGH), strict=True)))
        group.clearStagedReadCommands()
        group.addCmd(first.stageIsLEDOn())
        group.addCmd(second.stageGetPresentVelocity())
        until(lambda: group.executeRead() == [0, 0])

    def test_a_missing_servo_is_reported(self, connector):
        with pytest.raises(DxlRuntimeError) as error:
            connector.createMotor(9)
        assert error.value.dxl_error == DxlError.SDK_COMM_RX_TIMEOUT


def _replies(motor):
    try:
        return motor.ping() > 0
    except DxlRuntimeError:
        return False


def test_easy_sdk_supports_xl330_m077():
    with DynamixelEmulator([EmulatedServo("xl330_m077", 1, BAUD)]) as emulator:
        connector = Connector(emulator.port, BAUD)
        (motor,) = connector.createAllMotors()
        assert (motor.model_name, motor.getVelocityLimit(), motor.getCurrentLimit()) == ("xl330_m077.model", 1620, 1750)
        connector.closePort()
