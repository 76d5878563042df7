"""LeRobot's own bus of Dynamixel motors; torch and what else it imports and a bus does not need is left out."""

import sys
import time
from unittest.mock import MagicMock

for name in ("torch", "accelerate", "accelerate.utils", "datasets", "datasets.utils", "datasets.utils.logging"):
    sys.modules[name] = MagicMock()

from lerobot.motors import Motor, MotorCalibration, MotorNormMode  # noqa: E402
from lerobot.motors.dynamixel import DynamixelMotorsBus, OperatingMode  # noqa: E402

motors = {
    "shoulder": Motor(1, "xl430-w250", MotorNormMode.DEGREES),
    "elbow": Motor(2, "xl330-m288", MotorNormMode.DEGREES),
    "gripper": Motor(3, "xl330-m288", MotorNormMode.RANGE_0_100),
}
bus = DynamixelMotorsBus(sys.argv[1], motors)
bus.connect()
assert bus.broadcast_ping(num_retry=3) == {1: 1060, 2: 1200, 3: 1200}
bus.disable_torque(num_retry=3)
bus.configure_motors()
for name in motors:
    mode = OperatingMode.CURRENT_POSITION if name == "gripper" else OperatingMode.EXTENDED_POSITION
    bus.write("Operating_Mode", name, mode.value, num_retry=3)
homing = bus.set_half_turn_homings()
bus.write_calibration({name: MotorCalibration(motor.id, 0, homing[name], 500, 3500) for name, motor in motors.items()})
assert bus.is_calibrated
bus.enable_torque(num_retry=3)
goal = {"shoulder": 20.0, "elbow": -30.0, "gripper": 60.0}
bus.sync_write("Goal_Position", goal)
time.sleep(1.5)
position = bus.sync_read("Present_Position", num_retry=3)
assert all(abs(position[name] - goal[name]) < 0.2 for name in goal), position
rejection = ""
try:
    bus.write("ID", "shoulder", 9)
except RuntimeError as error:
    rejection = str(error)
assert "not available" in rejection, rejection
bus.disconnect()
sys.stdout.write("ping to all, operating modes, homing, limits, torque, goals; an ID is rejected while torque is on")
