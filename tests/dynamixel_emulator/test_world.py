"""Servos in a world with gravity: what they can carry, what they cannot, and what happens when they let go."""

import math

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dynamixel_emulator.body import OVERLOAD_S, HardwareError
from dynamixel_emulator.errors import EmulatorError
from dynamixel_emulator.mechanics import DrivenJoint
from dynamixel_emulator.models import (
    MODELS,
    XL330_M077,
    XL330_M288,
    XL430_W250,
    XM430_W350,
)
from dynamixel_emulator.packets import ALERT, Instruction, StatusError
from dynamixel_emulator.world import MujocoMechanics
from tests.robots.dynamixel.arm_world import COUNTS_PER_RAD, WORLD, Arm


def holding(arm, mode=3):
    """Torque on in this mode, holding the pose it has."""
    for number in (1, 2):
        arm.write(number, "Operating Mode", mode)
        arm.write(number, "Torque Enable", 1)
    return arm


def test_an_arm_without_torque_falls_and_with_torque_it_stays(tmp_path):
    torque_off, held = Arm(tmp_path, XM430_W350), holding(Arm(tmp_path, XM430_W350))
    for arm in (torque_off, held):
        arm.run(3.0)
    assert torque_off.angle() == pytest.approx(-math.pi / 2, abs=0.05)
    assert held.angle() == pytest.approx(0.0, abs=0.02)
    assert held.angle() < 0.0  # a P gain alone gives way a little
    assert held.servos[0].memory["Present Current"] > 5
    assert torque_off.servos[0].memory["Present Current"] == 0


def test_a_hand_leads_a_limp_joint_against_its_weight_and_lets_it_fall(tmp_path):
    arm = Arm(tmp_path, XL430_W250, posture={"shoulder": -1.5})
    arm.servos[0].lead(2048 + 0.5 * COUNTS_PER_RAD)
    fastest = 0.0
    for _ in range(400):
        before = arm.angle()
        arm.run(0.01)
        fastest = max(fastest, abs(arm.angle() - before) / 0.01)
    assert arm.angle() == pytest.approx(0.5, abs=0.005)
    assert fastest < 1.5
    assert arm.servos[0].memory["Present Load"] == 0  # it is not the motor that lifts
    arm.servos[0].hand = None
    arm.run(3.0)
    assert arm.angle() == pytest.approx(-math.pi / 2, abs=0.05)


@pytest.mark.parametrize(("model", "gives_way"), [(XL330_M288, True), (XM430_W350, False)])
def test_a_hand_is_not_stronger_than_a_hand(model, gives_way, tmp_path):
    arm = holding(Arm(tmp_path, model, mass=0.01))
    arm.servos[0].lead(2048 + COUNTS_PER_RAD)
    arm.run(2.0)
    assert (arm.angle() > 0.8) is gives_way
    assert arm.angle() > 0.01


def test_a_hand_leads_a_joint_whose_servo_is_turned_round_or_reversed(tmp_path):
    arm = Arm(tmp_path, XL430_W250)
    arm.servos[0].preset("Drive Mode", 1)
    arm.servos[0].lead(2048 + 0.3 * COUNTS_PER_RAD)
    arm.servos[1].lead(2048 - 0.6 * COUNTS_PER_RAD)
    arm.run(3.0)
    assert arm.angle() == pytest.approx(0.3, abs=0.005)
    assert arm.angle("elbow") == pytest.approx(0.6, abs=0.005)


@pytest.mark.parametrize("name", sorted(MODELS))
def test_goals_are_reached_whichever_way_the_servo_is_built_in(name, tmp_path):
    arm = holding(Arm(tmp_path, MODELS[name], mass=0.01))
    for number in (1, 2):
        arm.write(number, "Goal Position", 2048 + 300)
    arm.run(2.0)
    assert arm.angle() == pytest.approx(300 / COUNTS_PER_RAD, abs=0.05)
    assert arm.angle("elbow") == pytest.approx(-300 / COUNTS_PER_RAD, abs=0.05)
    assert abs(arm.servos[0].memory["Present Position"] - 2348) < 30
    assert arm.servos[0].memory["Moving"] == 0


def test_no_servo_is_faster_than_without_load(tmp_path):
    arm = holding(Arm(tmp_path, XL330_M288, mass=0.01, posture={"shoulder": -1.5}))
    arm.write(1, "Goal Position", 3000)
    fastest = 0.0
    for _ in range(200):
        arm.run(0.005)
        fastest = max(fastest, arm.servos[0].velocity)
    assert 0.5 < fastest / (103.0 * 4096 / 60) <= 1.0


def test_a_gear_between_servo_and_joint_slows_and_strengthens(tmp_path):
    arm = holding(Arm(tmp_path, XL430_W250, counts=(2 * COUNTS_PER_RAD, -COUNTS_PER_RAD)))
    arm.write(1, "Goal Position", 2448)
    arm.run(2.0)
    assert arm.angle() == pytest.approx(200 / COUNTS_PER_RAD, abs=0.02)


def test_a_profile_by_velocity_is_followed_in_the_world_too(tmp_path):
    arm = Arm(tmp_path, XM430_W350)
    arm.write(1, "Profile Velocity", 20)  # 4.58 rev/min, 313 pulses/s
    arm.write(1, "Profile Acceleration", 10)
    holding(arm)
    arm.write(1, "Goal Position", 2048 + 600)
    arm.run(1.0)
    assert arm.servos[0].velocity == pytest.approx(313, abs=15)
    assert arm.servos[0].memory["Velocity Trajectory"] == 20
    assert arm.servos[0].memory["Moving"] == 1


@pytest.mark.parametrize("gaining_ms", [0, 300, 5000])
def test_a_profile_by_time_takes_that_time(gaining_ms, tmp_path):
    arm = Arm(tmp_path, XM430_W350)
    for name, value in (("Drive Mode", 4), ("Profile Velocity", 1000), ("Profile Acceleration", gaining_ms)):
        assert arm.write(1, name, value) == 0
    holding(arm)
    arm.write(1, "Goal Position", 2548)
    arm.run(0.5)
    assert arm.servos[0].loops.course.position == pytest.approx(2298, abs=3)  # half the time, half the way
    arm.run(0.45)
    assert arm.servos[0].loops.course.velocity > 0.0
    arm.run(0.07)
    assert arm.servos[0].loops.course.position == pytest.approx(2548, abs=2)


def test_in_velocity_mode_it_turns_at_the_goal_and_the_gravity_does_not_stop_it(tmp_path):
    arm = holding(Arm(tmp_path, XM430_W350, posture={"shoulder": -1.5}), mode=1)
    arm.write(1, "Goal Velocity", 60)
    arm.run(1.5)
    assert arm.servos[0].memory["Present Velocity"] == pytest.approx(60, abs=6)


def test_in_current_mode_the_torque_is_that_of_the_current(tmp_path):
    arm = holding(Arm(tmp_path, XM430_W350), mode=0)
    assert arm.servos[0].memory["Goal Current"] == 0
    needed = 9.81 * (0.1 * 0.075 + 0.02 * 0.2)  # N m at level
    units = round(needed / 4.1 * 2.3 / 0.00269)
    arm.write(1, "Goal Current", units + 3)
    arm.write(2, "Torque Enable", 0)
    arm.write(2, "Operating Mode", 3)
    arm.write(2, "Torque Enable", 1)
    arm.run(0.2)
    assert 0.0 < arm.angle() < 0.5
    assert arm.servos[0].memory["Present Current"] == units + 3
    arm.write(1, "Goal Current", units - 3)
    arm.run(0.8)
    assert arm.servos[0].velocity < 0.0


def test_current_based_position_gives_way_to_what_is_heavier_than_its_goal_current(tmp_path):
    arm = holding(Arm(tmp_path, XL330_M288, mass=0.15), mode=5)
    arm.run(0.5)
    assert abs(arm.angle()) < 0.15
    arm.write(1, "Goal Current", 200)  # 0.07 N m
    arm.run(1.0)
    assert arm.angle() < -1.0
    assert abs(arm.servos[0].memory["Present Current"]) <= 200


def test_in_pwm_mode_nothing_turns_before_a_goal(tmp_path):
    arm = holding(Arm(tmp_path, XM430_W350, mass=0.01), mode=16)
    arm.write(1, "Goal PWM", 443)
    arm.run(1.0)
    top = 46.0 * 4096 / 60
    assert 0.3 < arm.servos[0].velocity / top < 0.6
    assert arm.servos[0].memory["Present PWM"] == 443


def test_goal_pwm_limits_what_position_control_can_carry(tmp_path):
    arm = holding(Arm(tmp_path, XL430_W250, mass=0.6))
    arm.run(0.5)
    stays = arm.angle()
    arm.write(1, "Goal PWM", 100)  # 11 % of 1.4 N m, where 0.48 are needed
    arm.run(1.0)
    assert stays > -0.1
    assert arm.angle() < -0.5


def test_reverse_mode_turns_position_and_torque_round(tmp_path):
    arm = Arm(tmp_path, XM430_W350)
    assert arm.write(1, "Drive Mode", 1) == 0
    assert arm.servos[0].memory["Present Position"] == 2048  # 4096 - 2048
    holding(arm)
    arm.write(1, "Goal Position", 2248)
    arm.run(1.0)
    assert arm.angle() == pytest.approx(-200 / COUNTS_PER_RAD, abs=0.03)
    assert arm.servos[0].memory["Present Position"] == pytest.approx(2248, abs=20)


def test_torque_comes_on_by_a_goal_if_drive_mode_says_so(tmp_path):
    arm = Arm(tmp_path, XM430_W350)
    arm.write(1, "Drive Mode", 8)
    arm.write(1, "Goal Velocity", 10)  # not the goal of this mode
    assert arm.servos[0].memory["Torque Enable"] == 0
    arm.write(1, "Goal Position", 2100)
    assert arm.servos[0].memory["Torque Enable"] == 1


def test_a_held_joint_overloads_its_servo_which_lets_go_until_a_reboot(tmp_path):
    arm = holding(Arm(tmp_path, XL430_W250, mass=0.05))
    arm.servos[0].blocked = True
    arm.write(1, "Goal Position", 2548)
    arm.run(OVERLOAD_S / 2)
    assert arm.angle() == pytest.approx(0.0, abs=0.01)
    assert arm.servos[0].memory["Present Load"] == 1000
    assert arm.servos[0].memory["Torque Enable"] == 1
    arm.run(OVERLOAD_S)
    assert arm.servos[0].memory["Hardware Error Status"] == HardwareError.OVERLOAD
    assert arm.servos[0].memory["Torque Enable"] == 0
    assert arm.servos[1].memory["Torque Enable"] == 1
    assert arm.write(1, "Torque Enable", 1) == StatusError.RESULT_FAIL | ALERT
    arm.servos[0].blocked = False
    arm.run(1.0)
    assert arm.angle() < -1.0
    arm.servos[0].do(Instruction.REBOOT)
    arm.run(1.0)
    assert arm.write(1, "Torque Enable", 1) == 0


def test_a_servo_that_works_hard_gets_warm_and_stops_when_it_is_hot(tmp_path):
    arm = holding(Arm(tmp_path, XM430_W350, mass=0.8))
    arm.run(1.0)
    began = arm.servos[0].temperature
    arm.run(2.0)
    assert began < arm.servos[0].temperature < began + 1.0
    assert arm.servos[1].temperature < arm.servos[0].temperature
    arm.servos[0].temperature = 80.6
    arm.run(0.01)
    assert arm.servos[0].memory["Hardware Error Status"] == HardwareError.OVERHEATING
    assert arm.servos[0].memory["Torque Enable"] == 0


@pytest.mark.parametrize(("model", "goes_limp"), [(XL330_M077, True), (XM430_W350, False)])
def test_a_wrong_voltage_is_told_and_switches_off_whom_shutdown_says(model, goes_limp, tmp_path):
    arm = holding(Arm(tmp_path, model, mass=0.01))
    arm.servos[0].voltage = 0.5 * model.voltage
    arm.run(0.01)
    memory = arm.servos[0].memory
    assert memory["Hardware Error Status"] == HardwareError.VOLTAGE
    assert memory["Present Input Voltage"] == round(5 * model.voltage)
    assert memory["Torque Enable"] == (0 if goes_limp else 1)
    assert arm.servos[0].do(Instruction.PING).error & ALERT


@pytest.mark.parametrize("mode", [1, 3, 4, 5, 16])
def test_the_bus_watchdog_stops_the_arm_in_its_time_and_refuses_goals_until_zero(mode, tmp_path):
    arm = holding(Arm(tmp_path, XM430_W350, mass=0.02, damping=0.1, posture={"shoulder": -1.4}), mode)
    goal = {1: "Goal Velocity", 16: "Goal PWM"}.get(mode, "Goal Position")
    arm.write(1, goal, 100 if goal != "Goal Position" else 3000)
    assert arm.write(1, "Bus Watchdog", 5) == 0  # 100 ms
    arm.run(0.099)
    assert arm.servos[0].memory["Bus Watchdog"] == 5
    assert arm.servos[0].velocity > 100.0
    arm.run(0.020)
    assert arm.servos[0].memory["Bus Watchdog"] == 0xFF
    stopped = arm.angle()
    arm.run(0.3)
    assert arm.angle() == pytest.approx(stopped, abs=0.06)
    assert abs(arm.servos[0].velocity) < 60.0  # in PWM mode it only brakes
    assert arm.write(1, goal, 10) == StatusError.DATA_RANGE
    assert arm.write(1, "Bus Watchdog", 0) == 0
    arm.run(0.2)
    assert goal == "Goal PWM" or arm.angle() == pytest.approx(stopped, abs=0.06)  # no goal of before is gone on to
    assert arm.write(1, goal, arm.servos[0].memory[goal]) == 0


def test_a_servo_without_power_is_limp_and_deaf_and_comes_back_without_torque(tmp_path):
    arm = holding(Arm(tmp_path, XM430_W350))
    servo = arm.servos[0]
    servo.powered = False
    arm.run(1.0)
    assert arm.angle() < -1.0
    assert not servo.listens
    servo.powered = True
    servo.reboot()
    arm.run(1.0)
    assert servo.listens
    assert servo.memory["Torque Enable"] == 0
    assert servo.memory["Present Position"] == round(2048 + arm.angle() * COUNTS_PER_RAD)


def test_the_same_questions_lead_to_the_same_movement(tmp_path):
    ends = []
    for _ in range(2):
        arm = holding(Arm(tmp_path, XL430_W250))
        arm.write(1, "Goal Position", 2500)
        arm.run(0.5)
        ends.append((arm.angle(), arm.angle("elbow")))
    assert ends[0] == ends[1]


names = ["Goal Position", "Goal Velocity", "Goal Current", "Goal PWM", "Torque Enable", "Operating Mode", "Drive Mode"]
names += ["Profile Velocity", "Profile Acceleration", "Position P Gain", "Position I Gain", "Position D Gain"]
names += [
    "Velocity P Gain",
    "Velocity I Gain",
    "Homing Offset",
    "Bus Watchdog",
    "PWM Limit",
    "Current Limit",
    "Shutdown",
]
values = st.sampled_from([0, 1, 3, 4, 5, 16, -1, 885, -885, 4095]) | st.integers(-20_000, 40_000)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    model=st.sampled_from(sorted(MODELS)),
    writes=st.lists(st.tuples(st.integers(1, 2), st.sampled_from(names), values), max_size=15),
)
def test_whatever_is_written_the_world_goes_on_and_no_motor_exceeds_itself(tmp_path, model, writes):
    arm = Arm(tmp_path, MODELS[model])
    for number, name, value in writes:
        if name in arm.servos[0].memory:
            arm.write(number, name, value)
        arm.run(0.02)
        for servo in arm.servos:
            assert abs(servo.torque) <= 2.01 * servo.model.stall_torque  # the way back adds what it drives against
    assert all(math.isfinite(place) for place in (arm.angle(), arm.angle("elbow")))


def test_what_is_wrong_with_a_world_is_told(tmp_path):
    with pytest.raises(EmulatorError, match="is no world") as missing:
        MujocoMechanics(tmp_path / "none.xml", [])
    assert missing.value.missing
    path = tmp_path / "arm.xml"
    path.write_text(WORLD.format(mass=0.1, damping=0.02))
    with pytest.raises(EmulatorError, match=r"no hinge or slide 'sholder' for a servo; .*shoulder"):
        MujocoMechanics(path, [DrivenJoint("sholder", COUNTS_PER_RAD)])
    path.write_text("<mujoco><wordbody/></mujoco>")
    with pytest.raises(EmulatorError, match="is no world that MuJoCo reads"):
        MujocoMechanics(path, [])
