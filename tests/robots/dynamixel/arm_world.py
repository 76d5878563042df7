"""A small world for servos: one or two links that hang from joints, of a weight that the servos can just hold."""

import math

from dynamixel_emulator.bus import EmulatedBus
from dynamixel_emulator.mechanics import DrivenJoint
from dynamixel_emulator.servo import EmulatedServo
from dynamixel_emulator.world import MujocoMechanics
from paramove.robots.dynamixel.bus.packets import Instruction, Packet, encoded

COUNTS_PER_RAD = 4096 / (2 * math.pi)
BAUD = 57600
WORLD = """
<mujoco>
  <compiler angle="radian"/>
  <option integrator="implicitfast"/>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" axis="0 -1 0" damping="{damping}" armature="0.002"/>
      <geom type="capsule" fromto="0 0 0 0.15 0 0" size="0.01" mass="{mass}"/>
      <body name="lower" pos="0.15 0 0">
        <joint name="elbow" axis="0 -1 0" damping="{damping}" armature="0.002"/>
        <geom type="capsule" fromto="0 0 0 0.1 0 0" size="0.01" mass="0.02"/>
      </body>
    </body>
  </worldbody>
  <actuator><position name="not_a_servo" joint="shoulder" kp="50"/></actuator>
</mujoco>
"""
"""At 0 the arm lies level; positive angles lift it."""


class Arm:
    """Two servos, the second turned round, and the time, which goes on when it is told to."""

    def __init__(self, folder, model, mass=0.1, damping=0.02, counts=(COUNTS_PER_RAD, -COUNTS_PER_RAD), posture=None):
        path = folder / "arm.xml"
        path.write_text(WORLD.format(mass=mass, damping=damping))
        joints = [DrivenJoint("shoulder", counts[0]), DrivenJoint("elbow", counts[1])]
        self.mechanics = MujocoMechanics(path, joints, posture)
        self.bus = EmulatedBus([EmulatedServo(model, number) for number in (1, 2)], self.mechanics)
        self.servos = self.bus.servos
        self.now_s = 0.0

    def write(self, number, name, value):
        """Error number of the answer."""
        register = self.servos[number - 1].model.registers[name]
        data = (value % (1 << 8 * register.size)).to_bytes(register.size, "little")
        question = Packet(number, Instruction.WRITE, register.address.to_bytes(2, "little") + data)
        ((_, answer),) = self.bus.receive(encoded(question), BAUD, self.now_s)
        return answer[8]

    def run(self, seconds):
        self.now_s += seconds
        self.bus.run_to(self.now_s)

    def angle(self, name="shoulder"):
        return self.mechanics.angles([name])[0]
