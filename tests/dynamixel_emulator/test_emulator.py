"""The unmodified dynamixel-sdk works with the emulated port as with a bus of servos."""

import fcntl
import os
import termios
import time

import pytest
from dynamixel_sdk import (
    COMM_RX_TIMEOUT,
    COMM_SUCCESS,
    GroupBulkRead,
    GroupBulkWrite,
    GroupSyncRead,
    GroupSyncWrite,
    PacketHandler,
    PortHandler,
    port_handler,
)

from dynamixel_emulator import servo as emulated_servo
from dynamixel_emulator.emulator import TCGETS2, TERMIOS2, TIOCGEXCL, DynamixelEmulator
from dynamixel_emulator.errors import EmulatorError
from dynamixel_emulator.models import BAUD_RATES, XL430_W250
from dynamixel_emulator.packets import Instruction, Packet, StatusError, encoded
from dynamixel_emulator.servo import EmulatedServo

TORQUE, LED, GOAL, PRESENT, MODE, WATCHDOG, ERROR_STATUS = 64, 65, 116, 132, 11, 98, 70
ID, BAUD, LEVEL, PROFILE_VELOCITY, REGISTERED, MOVING = 7, 8, 68, 112, 69, 122
INDIRECT_ADDRESS, INDIRECT_DATA = 168, 224
TCSETS2, RATE_BITS, RATE_IS_A_NUMBER = 0x402C542B, 0o10017, 0o10000  # asm-generic: CBAUD, BOTHER


class Client:
    """The SDK connected to the emulated port, with access to the emulator."""

    def __init__(self, emulator, baud_rate=57600):
        self.emulator, self.handler = emulator, PacketHandler(2.0)
        self.port = PortHandler(emulator.port)
        assert self.port.openPort()
        assert self.port.setBaudRate(baud_rate)

    def servo(self, number):
        return next(one for one in self.emulator.bus.servos if one.id == number)

    def write(self, number, address, value, size=1):
        name = f"write{size}ByteTxRx"
        result, error = getattr(self.handler, name)(self.port, number, address, value)
        assert result == COMM_SUCCESS
        return error

    def read(self, number, address, size=4):
        value, result, error = getattr(self.handler, f"read{size}ByteTxRx")(self.port, number, address)
        assert (result, error) == (COMM_SUCCESS, 0)
        return value

    def until(self, done, within_s=60.0):
        """Polls until the condition holds; each request takes its time on the wire."""
        end_s = time.monotonic() + within_s
        while not done():
            assert time.monotonic() < end_s, "timeout"

    def moves_to(self, number, goal):
        assert self.write(number, GOAL, goal, 4) == 0
        self.until(lambda: abs(self.read(number, PRESENT) - goal) <= 1)


@pytest.fixture(autouse=True)
def long_timeout(monkeypatch):
    """Increases the SDK's timeout, because other programs can delay the emulator."""
    monkeypatch.setattr(port_handler, "LATENCY_TIMER", 150)  # ms; half of the timeout


@pytest.fixture
def client():
    servos = [EmulatedServo("xl430_w250", 1), EmulatedServo("xm430_w350", 2), EmulatedServo("xl330_m288", 3)]
    with DynamixelEmulator(servos) as emulator:
        client = Client(emulator)
        yield client
        client.port.closePort()


def test_ping(client):
    assert client.handler.ping(client.port, 2) == (1020, COMM_SUCCESS, 0)
    assert client.handler.ping(client.port, 9)[1] == COMM_RX_TIMEOUT


def test_broadcast_ping(client):
    found, result = client.handler.broadcastPing(client.port)
    assert result == COMM_SUCCESS
    assert {number: model for number, (model, _) in found.items()} == {1: 1060, 2: 1020, 3: 1200}


def test_read_and_write(client):
    assert client.write(1, TORQUE, 1) == 0
    client.moves_to(1, 1000)
    client.moves_to(1, 3000)
    assert client.write(1, TORQUE, 0) == 0


def test_a_slow_profile_takes_its_time(client):
    client.write(1, PROFILE_VELOCITY, 20, 4)  # 4.58 rev/min: 1000 pulses in 3.2 s
    client.write(1, TORQUE, 1)
    client.write(1, GOAL, 3048, 4)
    client.until(lambda: client.read(1, MOVING, 1) == 1)
    client.until(lambda: client.read(1, PRESENT) > 2100)
    assert client.read(1, PRESENT) < 2600
    assert abs(client.read(1, 128) - 20) <= 1


def test_sync_write_and_read(client):
    for number in (1, 2, 3):
        client.write(number, TORQUE, 1)
    goals = {1: 1500, 2: 1800, 3: 2500}
    group = GroupSyncWrite(client.port, client.handler, GOAL, 4)
    for number, goal in goals.items():
        assert group.addParam(number, list(goal.to_bytes(4, "little")))
    assert group.txPacket() == COMM_SUCCESS
    reader = GroupSyncRead(client.port, client.handler, PRESENT, 4)
    for number in goals:
        assert reader.addParam(number)

    def there():
        assert reader.txRxPacket() == COMM_SUCCESS
        return all(abs(reader.getData(number, PRESENT, 4) - goal) <= 1 for number, goal in goals.items())

    client.until(there)
    assert reader.fastSyncRead() == COMM_SUCCESS
    assert [reader.getData(number, PRESENT, 4) for number in goals] == pytest.approx(list(goals.values()), abs=1)


def test_bulk_write_and_read(client):
    writer = GroupBulkWrite(client.port, client.handler)
    assert writer.addParam(1, GOAL, 4, list((1700).to_bytes(4, "little")))
    assert writer.addParam(2, LED, 1, [1])
    assert writer.txPacket() == COMM_SUCCESS
    reader = GroupBulkRead(client.port, client.handler)
    assert reader.addParam(1, GOAL, 4)
    assert reader.addParam(2, LED, 1)
    assert reader.txRxPacket() == COMM_SUCCESS
    assert (reader.getData(1, GOAL, 4), reader.getData(2, LED, 1)) == (1700, 1)
    assert reader.fastBulkRead() == COMM_SUCCESS
    assert (reader.getData(1, GOAL, 4), reader.getData(2, LED, 1)) == (1700, 1)


def test_indirect_access(client):
    addresses = [*range(GOAL, GOAL + 4), LED]
    for i, address in enumerate(addresses):
        assert client.write(1, INDIRECT_ADDRESS + 2 * i, address, 2) == 0
    client.write(1, TORQUE, 1)
    assert client.write(1, INDIRECT_ADDRESS, 132, 2) == StatusError.ACCESS
    data = [*(1234).to_bytes(4, "little"), 1]
    assert client.handler.writeTxRx(client.port, 1, INDIRECT_DATA, 5, data) == (COMM_SUCCESS, 0)
    assert (client.read(1, GOAL), client.read(1, LED, 1)) == (1234, 1)
    assert client.handler.readTxRx(client.port, 1, INDIRECT_DATA, 5)[0] == data


def test_a_registered_write_is_executed_by_action(client):
    data = list((900).to_bytes(4, "little"))
    assert client.handler.regWriteTxRx(client.port, 1, GOAL, 4, data) == (COMM_SUCCESS, 0)
    assert (client.read(1, GOAL), client.read(1, REGISTERED, 1)) == (2048, 1)
    assert client.handler.action(client.port, 254) == COMM_SUCCESS
    client.until(lambda: client.read(1, GOAL) == 900)
    assert client.read(1, REGISTERED, 1) == 0


def test_a_reboot_switches_torque_off_and_receives_nothing_for_a_while(client, monkeypatch):
    monkeypatch.setattr(emulated_servo, "REBOOT_S", 1.5)  # longer than other programs can delay this one
    client.write(1, TORQUE, 1)
    client.moves_to(1, 1000)
    assert client.handler.reboot(client.port, 1) == (COMM_SUCCESS, 0)
    assert client.handler.ping(client.port, 1)[1] == COMM_RX_TIMEOUT
    client.until(lambda: client.handler.ping(client.port, 1)[1] == COMM_SUCCESS)
    assert (client.read(1, TORQUE, 1), client.read(1, GOAL)) == (0, pytest.approx(1000, abs=5))


def test_factory_reset_keeps_id_and_baud_rate_on_request(client):
    client.write(3, ID, 12)
    client.write(12, MODE, 4)
    assert client.handler.factoryReset(client.port, 12, 0x02) == (COMM_SUCCESS, 0)
    client.until(lambda: client.handler.ping(client.port, 12)[1] == COMM_SUCCESS)
    assert client.read(12, MODE, 1) == 3
    client.handler.factoryReset(client.port, 254, 0xFF)  # would leave all of them with one id
    assert set(client.handler.broadcastPing(client.port)[0]) == {1, 2, 12}


def test_clear_multi_turn(client):
    client.write(1, MODE, 4)
    client.write(1, TORQUE, 1)
    client.moves_to(1, 5000)
    client.write(1, PROFILE_VELOCITY, 20, 4)  # slow enough to be still moving
    client.write(1, GOAL, 9000, 4)
    assert client.handler.clearMultiTurn(client.port, 1) == (COMM_SUCCESS, StatusError.RESULT_FAIL)
    client.write(1, PROFILE_VELOCITY, 0, 4)
    client.moves_to(1, 5000)
    client.until(lambda: client.read(1, 128) == 0)
    assert client.handler.clearMultiTurn(client.port, 1) == (COMM_SUCCESS, 0)
    assert client.read(1, PRESENT) == pytest.approx(5000 - 4096, abs=1)


@pytest.mark.parametrize(
    ("address", "value", "size", "error"),
    [
        (ID, 253, 1, StatusError.DATA_RANGE),
        (MODE, 0, 1, StatusError.DATA_RANGE),  # an XL430 has no current to control
        (GOAL, 4096, 4, StatusError.DATA_LIMIT),
        (GOAL, 100, 2, StatusError.DATA_LENGTH),
        (PRESENT, 100, 4, StatusError.ACCESS),
        (40, 1, 1, StatusError.ACCESS),  # no register
        (5000, 1, 1, StatusError.ACCESS),
    ],
)
def test_an_invalid_write_is_rejected_and_changes_nothing(client, address, value, size, error):
    before = bytes(client.servo(1).memory.read(0, 140))
    assert client.write(1, address, value, size) == error
    with client.emulator.lock:
        after = bytes(client.servo(1).memory.read(0, 140))
    assert before[:120] == after[:120]  # measurements are above


def test_eeprom_is_locked_while_torque_is_on(client):
    client.write(1, TORQUE, 1)
    assert client.write(1, ID, 5) == StatusError.ACCESS
    client.write(1, TORQUE, 0)
    assert client.write(1, ID, 5) == 0
    assert client.handler.ping(client.port, 5)[1] == COMM_SUCCESS


def test_a_servo_at_another_baud_rate_receives_nothing(client):
    assert client.write(1, BAUD, 3) == 0
    assert client.handler.ping(client.port, 1)[1] == COMM_RX_TIMEOUT
    client.port.setBaudRate(1_000_000)
    assert client.handler.ping(client.port, 1)[1] == COMM_SUCCESS
    assert client.handler.ping(client.port, 2)[1] == COMM_RX_TIMEOUT


@pytest.mark.parametrize("baud_rate", [57_600, 1_000_000])
def test_a_numeric_baud_rate_equals_the_predefined_one(client, baud_rate):
    """Programs in Rust set numeric rates, as do programs with a rate that is not predefined."""
    client.servo(1).memory["Baud Rate"] = BAUD_RATES.index(baud_rate)
    settings = bytearray(fcntl.ioctl(client.port.ser.fileno(), TCGETS2, bytes(TERMIOS2.size)))
    modes = list(TERMIOS2.unpack(settings))
    modes[2] = modes[2] & ~RATE_BITS | RATE_IS_A_NUMBER
    modes[-2:] = [baud_rate, baud_rate]
    fcntl.ioctl(client.port.ser.fileno(), TCSETS2, TERMIOS2.pack(*modes))
    assert client.emulator.baud_rate == baud_rate
    assert client.handler.ping(client.port, 1) == (XL430_W250.number, COMM_SUCCESS, 0)


def test_exclusive_access_of_a_killed_program_is_released(client):
    client.port.closePort()
    emulator = client.emulator
    first = os.open(emulator.port, os.O_RDWR | os.O_NOCTTY)
    fcntl.flock(first, fcntl.LOCK_EX)
    fcntl.ioctl(first, termios.TIOCEXCL)

    def exclusive() -> bool:
        return fcntl.ioctl(emulator._slave, TIOCGEXCL, bytes(4)) != bytes(4)

    for _ in range(5):  # idle iterations of the emulator
        emulator._stopped.wait(0.01)
        assert exclusive()
    os.close(first)  # as if it was killed
    client.until(lambda: not exclusive())
    assert client.port.openPort()
    assert client.handler.ping(client.port, 1)[1] == COMM_SUCCESS


def test_a_program_that_never_reads_does_not_block_the_servos(client):
    """A serial port drops bytes when its buffer is full; so does the emulated one."""
    client.servo(1).memory["Baud Rate"] = 6  # fast
    client.port.setBaudRate(4_000_000)
    request = encoded(Packet(1, Instruction.READ, bytes([0, 0, 0x95, 0x02])))
    for _ in range(60):  # 40 kB of replies
        client.port.ser.write(request)
    client.port.ser.write(encoded(Packet(1, Instruction.WRITE, bytes([LED, 0, 1]))))

    def received():
        with client.emulator.lock:
            return client.servo(1).memory["LED"] == 1

    client.until(received)
    led = (1, COMM_SUCCESS, 0)
    client.until(lambda: client.handler.read1ByteTxRx(client.port, 1, LED) == led)  # after the buffered replies


def test_status_return_level(client):
    assert client.write(1, LEVEL, 1) == 0
    assert client.handler.write1ByteTxRx(client.port, 1, LED, 1)[0] == COMM_RX_TIMEOUT
    assert client.read(1, LED, 1) == 1
    client.handler.write1ByteTxOnly(client.port, 1, LEVEL, 0)
    assert client.handler.read1ByteTxRx(client.port, 1, LED)[1] == COMM_RX_TIMEOUT
    assert client.handler.ping(client.port, 1)[1] == COMM_SUCCESS


def test_the_bus_watchdog_stops_the_servo_and_rejects_goals_until_it_is_cleared(client):
    client.write(1, PROFILE_VELOCITY, 20, 4)
    client.write(1, TORQUE, 1)
    client.write(1, GOAL, 4000, 4)
    assert client.write(1, WATCHDOG, 1) == 0  # 20 ms
    servo = client.servo(1)

    def tripped():
        with client.emulator.lock:
            return servo.memory["Bus Watchdog"] == 0xFF and servo.velocity == 0.0

    client.until(tripped)
    assert client.read(1, PRESENT) < 3000
    assert client.write(1, GOAL, 2000, 4) == StatusError.DATA_RANGE
    assert client.write(1, WATCHDOG, 0) == 0
    client.write(1, PROFILE_VELOCITY, 0, 4)
    client.moves_to(1, 2000)


def test_a_hardware_error_sets_the_alert_bit_of_every_reply(client):
    with client.emulator.lock:
        client.servo(1).memory["Hardware Error Status"] = 0x20  # overload
    _, _, error = client.handler.ping(client.port, 1)
    assert error & 0x80
    assert client.handler.read1ByteTxRx(client.port, 1, ERROR_STATUS) == (0x20, COMM_SUCCESS, 0x80)


class SlowWorld:
    """Each simulated millisecond takes 20 ms of processor time."""

    def shafts(self):
        return [(2048.0, 0.0)]

    def step(self, efforts, blocked):
        end_s = time.thread_time() + 0.02
        while time.thread_time() < end_s:
            pass


def test_no_answer_waits_for_a_world_that_is_behind_and_other_programs_run_before_it():
    with DynamixelEmulator([EmulatedServo("xl430_w250")], mechanics=SlowWorld()) as emulator:
        client = Client(emulator)
        began_s = time.monotonic()
        client.until(lambda: emulator.bus.now_s > 0.02)
        for _ in range(3):  # the SDK's timeout can expire on a busy machine
            client.until(lambda: client.handler.ping(client.port, 1)[1] == COMM_SUCCESS)
        with emulator.lock:
            assert emulator.bus.now_s < 0.5 * (time.monotonic() - began_s)

        def has_normal_priority():
            emulator._stopped.wait(0.02)  # no polling: both threads share one interpreter
            return os.sched_getscheduler(emulator._thread.native_id) == os.SCHED_OTHER

        client.until(has_normal_priority, 30.0)
        client.port.closePort()


@pytest.mark.parametrize("allowed", [True, False])
def test_servos_run_before_other_programs_where_the_system_allows_it(allowed, monkeypatch):
    requested = []

    def set_scheduler(pid, policy, parameter):
        requested.append((pid, policy, parameter.sched_priority))
        if not allowed:
            raise PermissionError

    monkeypatch.setattr(os, "sched_setscheduler", set_scheduler)
    with DynamixelEmulator([EmulatedServo("xl430_w250")]) as emulator:
        client = Client(emulator)
        assert client.handler.ping(client.port, 1)[1] == COMM_SUCCESS
        client.port.closePort()
    assert (0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, 1) in requested


def test_a_link_exists_as_long_as_the_port(tmp_path):
    link = tmp_path / "usb-emulated"
    with DynamixelEmulator([EmulatedServo("xl430_w250")], link) as emulator:
        assert str(link.resolve()) == emulator.port
        port = PortHandler(str(link))
        port.openPort()
        port.setBaudRate(57600)
        assert PacketHandler(2.0).ping(port, 1)[0] == 1060
        port.closePort()
    assert not link.exists()


def test_a_second_emulator_cannot_use_the_same_link(tmp_path):
    link = tmp_path / "usb-emulated"
    with DynamixelEmulator([EmulatedServo("xl430_w250")], link) as emulator:
        with pytest.raises(EmulatorError, match="usb-emulated is the port of another running emulator"):
            DynamixelEmulator([EmulatedServo("xl430_w250")], link)
        emulator.unplug()
        with pytest.raises(EmulatorError, match="another running emulator"):
            DynamixelEmulator([EmulatedServo("xl430_w250")], link)
        emulator.plug_in()
        assert str(link.resolve()) == emulator.port
    with DynamixelEmulator([EmulatedServo("xl430_w250")], link) as emulator:
        assert str(link.resolve()) == emulator.port


def test_unplugging_removes_the_port_and_plugging_in_restores_the_link(tmp_path):
    link = tmp_path / "usb-emulated"
    with DynamixelEmulator([EmulatedServo("xl430_w250")], link) as emulator:
        client = Client(emulator)
        client.write(1, LED, 1)
        emulator.unplug()
        assert not link.exists()
        with pytest.raises(OSError, match=r"returned no data|Input/output|Bad file"):
            client.until(lambda: client.port.ser.read(1) == b"?")
        emulator.plug_in()
        assert str(link.resolve()) == emulator.port
        again = Client(emulator)
        assert again.read(1, LED, 1) == 1  # the servos kept their power
        again.port.closePort()
        client.port.closePort()


def test_a_link_replaces_only_links_of_earlier_emulators(tmp_path):
    file, adapter, old = (tmp_path / name for name in ("file", "usb-FTDI", "usb-emulated"))
    file.write_text("mine")
    adapter.symlink_to("/dev/ttyUSB7")
    old.symlink_to("/dev/pts/9999")  # of a killed emulator
    for taken in (file, adapter):
        with pytest.raises(EmulatorError, match=f"{taken.name} exists"):
            DynamixelEmulator([EmulatedServo("xl430_w250")], taken)
    assert (file.read_text(), os.readlink(adapter)) == ("mine", "/dev/ttyUSB7")
    with DynamixelEmulator([EmulatedServo("xl430_w250")], old) as emulator:
        assert os.readlink(old) == emulator.port


def test_a_link_is_removed_before_its_terminal_is_closed(tmp_path, monkeypatch):
    link, link_exists = tmp_path / "usb-emulated", []
    close = os.close
    with DynamixelEmulator([EmulatedServo("xl430_w250")], link) as emulator:
        monkeypatch.setattr(
            "dynamixel_emulator.emulator.os.close",
            lambda number: link_exists.append(link.is_symlink()) or close(number),
        )
        emulator.unplug()
        assert link_exists[:2] == [False, False]
        monkeypatch.undo()


def test_a_paced_emulator_moves_only_when_its_time_runs():
    """The same request at the same time has the same answer, whatever the clock on the wall."""
    positions = []
    for _ in range(2):
        with DynamixelEmulator([EmulatedServo("xl430_w250", 1)], paced=True) as emulator:
            client = Client(emulator)
            assert client.write(1, TORQUE, 1) == 0
            assert client.write(1, GOAL, 3000, 4) == 0
            run = []
            for period in range(1, 21):
                with emulator.lock:
                    emulator.run_to(10_000_000 * period)
                run.append(client.read(1, PRESENT))
            assert client.read(1, PRESENT) == run[-1], "time stands still"
            with emulator.lock:
                emulator.run_to(10_000_000)
            assert client.read(1, PRESENT) == run[-1], "time does not run back"
            client.port.closePort()
        positions.append(run)
    assert positions[0] == positions[1]
    assert positions[0] == sorted(positions[0])
    assert positions[0][0] < positions[0][-1]


def test_time_that_runs_by_itself_cannot_be_paced(client):
    with pytest.raises(EmulatorError, match="paced"), client.emulator.lock:
        client.emulator.run_to(1)
