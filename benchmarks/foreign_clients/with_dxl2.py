"""dynamixel-python: a whole Protocol 2.0 of its own, without dynamixel-sdk; every instruction is tried."""

import sys
import time

from dxl2.v2 import BulkParams, MotorBus, SyncParams

TORQUE, LED, P_GAIN, REGISTERED, GOAL, POSITION, VOLTAGE = 64, 65, 84, 69, 116, 132, 144
RANGE_ERROR, LIMIT_ERROR, ACCESS_ERROR = 4, 6, 7

bus = MotorBus(sys.argv[1], 1_000_000, 0.2)
bus.connect()


def data_of(response):
    assert response.ok, response
    return response.data


def bulk_params():
    params = BulkParams()
    params.add_address(1, LED, 1)
    params.add_address(2, VOLTAGE, 2)
    params.add_address(3, POSITION, 4, signed=True)
    return params


def all_of(address, length):
    params = SyncParams(address, length, signed=True)
    for number in (1, 2, 3):
        params.add_motor(number)
    return params


models = {number: info["model_number"] for number, info in data_of(bus.broadcast_ping()).items()}
assert models == {1: 1060, 2: 1200, 3: 1200}
assert data_of(bus.ping(2))["model_number"] == 1200
assert bus.ping(9).timeout

data_of(bus.write(1, TORQUE, 1, 1))
assert bus.write(1, 7, 1, 5).error == ACCESS_ERROR
assert bus.write(1, GOAL, 4, 99_999).error == LIMIT_ERROR
data_of(bus.reg_write(1, GOAL, 4, 2500))
assert data_of(bus.read(1, REGISTERED, 1)) == 1
data_of(bus.action(1))
time.sleep(1.5)
assert data_of(bus.sync_read(all_of(POSITION, 4))) == [2500, 2048, 2048]
assert data_of(bus.fast_sync_read(all_of(POSITION, 4))) == [2500, 2048, 2048]

lights = SyncParams(LED, 1)
for number in (1, 2, 3):
    lights.add_value(number, 1)
bus.sync_write(lights)
light, voltage, position = data_of(bus.bulk_read(bulk_params()))
assert (light, position) == (1, 2048)
assert data_of(bus.fast_bulk_read(bulk_params())) == [light, voltage, position]
settings = BulkParams()
settings.add_value(1, LED, 1, 0)
settings.add_value(2, P_GAIN, 2, 500)
bus.bulk_write(settings)
assert (data_of(bus.read(1, LED, 1)), data_of(bus.read(2, P_GAIN, 2))) == (0, 500)

data_of(bus.reboot(1))
time.sleep(0.6)
assert data_of(bus.read(1, TORQUE, 1)) == 0
data_of(bus.clear_position(1))
assert bus.clear_errors(1).error == RANGE_ERROR  # of the Y series only
data_of(bus.control_table_backup(2))
data_of(bus.write(2, 11, 1, 4))
data_of(bus.control_table_restore(2))
time.sleep(0.6)
assert data_of(bus.read(2, 11, 1)) == 3
data_of(bus.factory_reset_except_id_baudrate(3))
time.sleep(0.6)
data_of(bus.ping(3))
data_of(bus.factory_reset_except_id(3))
time.sleep(0.6)
assert bus.ping(3).timeout
bus.set_baudrate(57_600)
data_of(bus.ping(3))
bus.disconnect()
sys.stdout.write(
    "ping, ping to all; read, write, reg write and action, sync and bulk read and write, fast sync and bulk read, "
    "reboot, clear, backup, factory reset; refusals by number"
)
