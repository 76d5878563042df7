"""dynamixel-python: a whole Protocol 2.0 of its own, without dynamixel-sdk; every instruction is tried."""

import sys
import time

from dxl2.v2 import BulkParams, MotorBus, SyncParams

TORQUE, LED, P_GAIN, REGISTERED, GOAL, POSITION, VOLTAGE = 64, 65, 84, 69, 116, 132, 144
RANGE_ERROR, LIMIT_ERROR, ACCESS_ERROR = 4, 6, 7

bus = MotorBus(sys.argv[1], 1_000_000, 0.2)
bus.connect()


def told(response):
    assert response.ok, response
    return response.data


def asked():
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


found = {number: info["model_number"] for number, info in told(bus.broadcast_ping()).items()}
assert found == {1: 1060, 2: 1200, 3: 1200}
assert told(bus.ping(2))["model_number"] == 1200
assert bus.ping(9).timeout

told(bus.write(1, TORQUE, 1, 1))
assert bus.write(1, 7, 1, 5).error == ACCESS_ERROR
assert bus.write(1, GOAL, 4, 99_999).error == LIMIT_ERROR
told(bus.reg_write(1, GOAL, 4, 2500))
assert told(bus.read(1, REGISTERED, 1)) == 1
told(bus.action(1))
time.sleep(1.5)
assert told(bus.sync_read(all_of(POSITION, 4))) == [2500, 2048, 2048]
assert told(bus.fast_sync_read(all_of(POSITION, 4))) == [2500, 2048, 2048]

lights = SyncParams(LED, 1)
for number in (1, 2, 3):
    lights.add_value(number, 1)
bus.sync_write(lights)
light, voltage, position = told(bus.bulk_read(asked()))
assert (light, position) == (1, 2048)
assert told(bus.fast_bulk_read(asked())) == [light, voltage, position]
settings = BulkParams()
settings.add_value(1, LED, 1, 0)
settings.add_value(2, P_GAIN, 2, 500)
bus.bulk_write(settings)
assert (told(bus.read(1, LED, 1)), told(bus.read(2, P_GAIN, 2))) == (0, 500)

told(bus.reboot(1))
time.sleep(0.6)
assert told(bus.read(1, TORQUE, 1)) == 0
told(bus.clear_position(1))
assert bus.clear_errors(1).error == RANGE_ERROR  # of the Y series only
told(bus.control_table_backup(2))
told(bus.write(2, 11, 1, 4))
told(bus.control_table_restore(2))
time.sleep(0.6)
assert told(bus.read(2, 11, 1)) == 3
told(bus.factory_reset_except_id_baudrate(3))
time.sleep(0.6)
told(bus.ping(3))
told(bus.factory_reset_except_id(3))
time.sleep(0.6)
assert bus.ping(3).timeout
bus.set_baudrate(57_600)
told(bus.ping(3))
bus.disconnect()
sys.stdout.write(
    "ping, ping to all; read, write, reg write and action, sync and bulk read and write, fast sync and bulk read, "
    "reboot, clear, backup, factory reset; refusals by number"
)
