"""rustypot: the protocol written in Rust; its serial port sets the line's rate as a number."""

import sys
import time

import rustypot

bus = rustypot.Xl330PyController(sys.argv[1], 1_000_000, 0.5)
assert [bus.ping(number) for number in (1, 2, 3, 4)] == [True, True, True, False]
assert bus.broadcast_scan() == {1: 1060, 2: 1200, 3: 1200}
assert bus.sync_read_model_number([1, 2, 3]) == [1060, 1200, 1200]
bus.sync_write_torque_enable([2, 3], [True, True])
bus.sync_write_goal_position([2, 3], [0.5, -0.5])
time.sleep(1.5)
bus.set_fast_sync_read(True)
positions = bus.sync_read_present_position([1, 2, 3])
assert max(abs(one - expected) for one, expected in zip(positions, (0.0, 0.5, -0.5), strict=True)) < 0.005, positions
assert bus.reboot(2)
time.sleep(0.6)
assert bus.ping(2)
assert bus.read_torque_enable(2) == [False]
assert bus.read_torque_enable(3) == [True]
sys.stdout.write("ping, ping to all, sync read and write, fast sync read, reboot")
