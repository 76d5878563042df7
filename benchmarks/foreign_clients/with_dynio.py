"""dynio (dynamixel-controller): three operating modes, one after the other, each with torque off before."""

import sys
import time

from dynio.dynamixel_controller import DynamixelIO

motor = DynamixelIO(sys.argv[1], 1_000_000).new_mx28(1, protocol=2, control_table_protocol=2)
motor.set_position_mode()
motor.torque_enable()
motor.set_position(1000)
time.sleep(1.5)
assert motor.get_position() == 1000
assert round(motor.get_angle(), 3) == 87.891
motor.torque_disable()
motor.set_extended_position_mode()
motor.torque_enable()
motor.set_position(6000)
time.sleep(2.5)
assert motor.get_position() == 6000
motor.torque_disable()
motor.set_velocity_mode()
motor.torque_enable()
motor.set_velocity(50)
time.sleep(0.5)
assert motor.read_control_table("Present_Velocity") == 50
motor.set_velocity(0)
motor.torque_disable()
sys.stdout.write("position, extended position and velocity mode")
