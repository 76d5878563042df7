"""The arms of `robot_description/` behind an emulated port, as seen by a driver."""

import numpy as np
import pytest
from dynamixel_sdk import COMM_SUCCESS, GroupSyncRead, PacketHandler

from dynamixel_emulator.control import request
from paramove.documents.input_error import InputError
from paramove.robots.dynamixel.bus.servo_port import ServoPort
from sim.emulated_arm import EmulatedArm
from tests.robots.hoap3.movements import HOAP3
from tests.robots.servo_arms import ARMS, KOCH

LONG_TIMEOUT_S = 0.3


@pytest.mark.parametrize("robot", ARMS, ids=lambda robot: robot.name)
def test_a_client_finds_each_servo_in_the_base_pose(robot, tmp_path):
    link = tmp_path / "by-id" / "usb-arm"
    with EmulatedArm(robot, link=link) as arm, ServoPort(str(link), robot.bus.baud_rate, LONG_TIMEOUT_S) as port:
        handler = PacketHandler(2.0)
        reader = GroupSyncRead(port, handler, 132, 4)
        for number in robot.servo_ids:
            assert reader.addParam(number)
        assert reader.txRxPacket() == COMM_SUCCESS
        counts = [reader.getData(number, 132, 4) for number in robot.servo_ids]
        truth = arm.truth(5)
    assert np.abs(robot.units.to_radians(np.array(counts)) - robot.base_pose).max() < 0.3  # it has started to fall
    assert truth.time_ns == 5
    assert len(truth.joint_positions) == robot.n_joints
    assert {body.name for body in truth.objects} == {"red_cube", "green_cube", "blue_cylinder"}
    assert len(truth.gripper) == 3
    assert not link.exists()


@pytest.mark.parametrize("robot", ARMS, ids=lambda robot: robot.name)
def test_servos_hold_the_arm_and_lift_it(robot):
    arm = EmulatedArm(robot, posture_deg={robot.joint_names[1]: np.rad2deg(robot.base_pose[1]) + 10.0})
    with arm:
        pass  # only the bus is used, at simulated times
    bus, servos = arm.emulator.bus, arm.emulator.bus.servos
    initial = arm.mechanics.angles(robot.joint_names)
    for servo in servos:
        servo.hold()
    bus.run_to(arm.mechanics.data.time + 2.0)
    assert np.abs(np.array(arm.mechanics.angles(robot.joint_names)) - initial).max() < 0.15  # an XL330 has a low gain
    servos[1].memory["Goal Position"] -= 150
    bus.run_to(arm.mechanics.data.time + 3.0)
    assert arm.mechanics.angles(robot.joint_names[1:2])[0] - initial[1] == pytest.approx(-150 * np.pi / 2048, abs=0.1)
    assert all(servo.memory["Hardware Error Status"] == 0 for servo in servos)


def test_the_control_socket_accepts_joint_names(tmp_path):
    with EmulatedArm(KOCH, control=tmp_path / "control") as arm:
        request(tmp_path / "control", "block elbow_flex")
        assert [servo.blocked for servo in arm.emulator.bus.servos] == [False, False, True, False, False, False]
        assert "koch_v1_1 at /dev/" in arm.detail
        request(tmp_path / "control", "unplug")
        assert "unplugged" in arm.detail


def test_an_arm_that_cannot_be_emulated_is_rejected(tmp_path):
    with pytest.raises(InputError, match="hoap3 is not a servo arm"):
        EmulatedArm(HOAP3)
    with pytest.raises(InputError, match="no joint 'elbow'"):
        EmulatedArm(KOCH, posture_deg={"elbow": 3.0})
    file = tmp_path / "mine"
    file.touch()
    with pytest.raises(InputError, match="not a link"), EmulatedArm(KOCH, link=file):
        pass
    assert file.is_file()


def test_an_unstable_world_is_reported(tmp_path):
    with EmulatedArm(KOCH) as arm:
        arm.emulator.check()
        with arm.emulator.lock:
            arm.mechanics.data.qvel[:] = np.nan
        arm.emulator._thread.join(60.0)
        with pytest.raises(RuntimeError, match="the emulated servos have stopped: the emulated servos' world broke"):
            arm.emulator.check()
