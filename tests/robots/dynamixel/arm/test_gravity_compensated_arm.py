"""A floating arm stays where a hand leaves it, a limp one falls; what currents are asked for, and how it ends."""

import mujoco
import numpy as np
import pytest

from dynamixel_emulator.memory import TRIPPED
from paramove.documents.input_error import InputError
from paramove.robots.dynamixel.arm.gravity_compensated_arm import ArmWeight, GravityCompensatedArm, TorqueOffArm
from paramove.robots.dynamixel.bus.servo_chain import ServoChain
from paramove.robots.dynamixel.bus.servo_port import ServoPort
from sim.emulated_arm import EmulatedArm
from tests.robots.servo_arms import KOCH, OPEN_MANIPULATOR_X

ROBOT = OPEN_MANIPULATOR_X
ARM_JOINTS = ROBOT.chain.indices
STRETCHED = dict(zip(ROBOT.chain.joints, (0.0, 30.0, -40.0, 0.0), strict=True))
"""Leaning forward, clear of the table, deg."""
LED_S = 0.6
STAYS = 0.15
"""How far an arm may go in that time that is carried, rad; a limp one goes twice as far."""
ANSWERED_S = 10.0
"""What moves a world may be kept waiting by other programs."""


def angles(arm):
    while (found := arm.measured()) is None:
        pass  # until it gives up
    return found


def led(kind, link, look=lambda emulated: None):
    """How far the joints went in 0.6 s of the arm's own time from where they were held, largest, rad."""
    with (
        EmulatedArm(ROBOT, link=link, posture_deg=STRETCHED, held=True) as emulated,
        ServoPort(str(link), ROBOT.bus.baud_rate, ANSWERED_S) as port,
    ):
        arm = kind(ServoChain(port), ROBOT)
        arm.release()
        _, began = angles(arm)
        end_s = emulated.mechanics.data.time + LED_S
        while emulated.mechanics.data.time < end_s:
            emulated.emulator.check()
            arm.measured()
        look(emulated)
        _, ended = angles(arm)
        assert arm.put_down() == ()
        memories = [servo.memory for servo in emulated.emulator.bus.servos]
    return np.abs(ended - began)[ARM_JOINTS].max(), memories


def test_it_stays_where_it_is_left(tmp_path):
    def look(emulated):
        for place in ARM_JOINTS:
            memory = emulated.emulator.bus.servos[place].memory
            assert abs(memory["Goal Current"]) <= memory["Current Limit"] // 3
            assert memory["Bus Watchdog"] == 10
        assert emulated.emulator.bus.servos[ARM_JOINTS[1]].memory["Goal Current"] != 0

    for _ in range(3):  # where other programs keep the loop waiting, the arm moves on with the currents of before
        moved, memories = led(GravityCompensatedArm, tmp_path / "arm", look)
        if moved < STAYS:
            break
    assert moved < STAYS
    for place in ARM_JOINTS:
        assert memories[place]["Torque Enable"] == 0
        assert memories[place]["Operating Mode"] == 3
        assert memories[place]["Bus Watchdog"] == 0


def test_a_limp_one_falls(tmp_path):
    assert led(TorqueOffArm, tmp_path / "arm")[0] > 0.3


def test_the_weight_is_the_slope_of_the_energy():
    weight = ArmWeight(ROBOT)
    model = mujoco.MjModel.from_xml_path(str(ROBOT.model_path))
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data = mujoco.MjData(model)

    def energy(angles):
        for name, angle in zip(ROBOT.joint_names, angles, strict=True):
            data.joint(name).qpos[0] = angle
        mujoco.mj_forward(model, data)
        return data.energy[0]

    angles, step = ROBOT.base_pose + 0.1, 1e-5
    for place in ARM_JOINTS:
        moved = step * np.eye(ROBOT.n_joints)[place]
        slope = (energy(angles + moved) - energy(angles - moved)) / (2.0 * step)
        assert weight.torques(angles)[place] == pytest.approx(slope, abs=1e-6)


def test_servos_without_a_current_mode_are_told(tmp_path):
    with pytest.raises(
        InputError, match=r"shoulder_pan has a xl430_w250, which has no current mode: .* without --float"
    ):
        GravityCompensatedArm(ServoChain(ServoPort("/dev/null", 1_000_000)), KOCH)


@pytest.fixture
def floating(tmp_path):
    """An emulated arm that is led, and its servos."""
    link = tmp_path / "arm"
    with (
        EmulatedArm(ROBOT, link=link, posture_deg=STRETCHED, held=True) as emulated,
        ServoPort(str(link), ROBOT.bus.baud_rate, ANSWERED_S) as port,
    ):
        arm = GravityCompensatedArm(ServoChain(port), ROBOT)
        arm.release()
        assert arm.measured() is not None
        port.latency_s = 0.05  # for the silence of a servo
        yield arm, emulated, [emulated.emulator.bus.servos[place] for place in ARM_JOINTS]


def test_after_a_pause_that_trips_the_watchdogs_it_carries_again(floating):
    arm, emulated, servos = floating
    end_s = emulated.mechanics.data.time + 2.0
    while any(servo.memory["Bus Watchdog"] != TRIPPED for servo in servos):
        emulated.emulator.check()
        assert emulated.mechanics.data.time < end_s
    while arm.measured() is None:
        emulated.emulator.check()
    assert [servo.memory["Bus Watchdog"] for servo in servos] == [10] * 4
    end_s = emulated.mechanics.data.time + 2.0
    while servos[1].memory["Goal Current"] == 0:
        arm.measured()
        assert emulated.mechanics.data.time < end_s


def test_while_a_servo_is_silent_the_others_carry_nothing(floating):
    arm, emulated, servos = floating
    with emulated.emulator.lock:
        servos[0].preset("ID", 99)
    end_s = emulated.mechanics.data.time + 2.0
    while any(servo.memory["Goal Current"] for servo in servos[1:]):
        assert arm.measured() is None
        assert emulated.mechanics.data.time < end_s


def test_a_servo_that_does_not_hear_the_last_word_is_told_and_the_others_hear_it(floating):
    arm, emulated, (silent, *others) = floating
    with emulated.emulator.lock:
        silent.preset("ID", 99)
    (failed,) = arm.put_down()
    assert failed.startswith(f"{ROBOT.joint_names[ARM_JOINTS[0]]}: servo {ROBOT.servo_ids[ARM_JOINTS[0]]} ")
    assert [servo.memory["Torque Enable"] for servo in others] == [0, 0, 0]
