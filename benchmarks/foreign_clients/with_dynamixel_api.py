"""dynamixel_api: asks on before it has read the answers; its tables name the initial value of each register."""

import sys
import time

from dynamixel_api.models.xl430w250t import XL430W250TConnector

servo = XL430W250TConnector(sys.argv[1], 1_000_000, 1)
servo.connect()
n_equal = 0
for name, register in servo.fields.items():
    # Baud Rate is set by this program; Startup Configuration (60) is 0 in the e-Manual, 3 in its tables.
    if register.initial_value is not None and name not in ("baud_rate", "startup_configuration"):
        value = servo.read_field(name)
        assert value == register.initial_value, (name, value, register.initial_value)
        n_equal += 1
futures = [servo.read_field_async("present_position") for _ in range(20)]
assert [future.result() for future in futures] == [2048] * 20
servo.write_field("torque_enable", 1)
servo.write_field("goal_position", 2500)
time.sleep(1.5)
assert abs(servo.read_field("present_position") - 2500) <= 1
servo.disconnect()
sys.stdout.write(f"{n_equal} registers with their initial values, 20 questions asked at once, a goal")
