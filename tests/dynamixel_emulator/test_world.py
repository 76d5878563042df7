"""Servos in a world with gravity: loads that they hold, loads that they do not, and falling without torque."""

import math

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dynamixel_emulator.body import OVERLOAD_S, HardwareError
from dynamixel_emulator.bus import EmulatedBus
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
from dynamixel_emulator.servo import EmulatedServo
from dynamixel_emulator.world import MujocoMechanics
from tests.robots.dynamixel.arm_world import COUNTS_PER_RAD, WORLD, Arm


def holding(arm, mode=3):
    """Switches torque on in this mode, at the present pose."""
    for number in (1, 2):
        arm.write(number, "Operating Mode", mode)
        arm.write(number, "Torque Enable", 1)
    return arm


def test_an_arm_falls_without_torque_and_holds_with_torque(tmp_path):
    torque_off, held = Arm(tmp_path, XM430_W350), holding(Arm(tmp_path, XM430_W350))
    for arm in (torque_off, held):
        arm.run(3.0)
    assert torque_off.angle() == pytest.approx(-math.pi / 2, abs=0.05)
    assert held.angle() == pytest.approx(0.0, abs=0.02)
    assert held.angle() < 0.0  # P control has a steady-state error
    assert held.servos[0].memory["Present Current"] > 5
    assert torque_off.servos[0].memory["Present Current"] == 0


def test_a_hand_lifts_a_joint_without_torque_until_it_is_released(tmp_path):
    arm = Arm(tmp_path, XL430_W250, posture={"shoulder": -1.5})
    arm.servos[0].lead(2048 + 0.5 * COUNTS_PER_RAD)
    max_speed = 0.0
    for _ in range(400):
        before = arm.angle()
        arm.run(0.01)
        max_speed = max(max_speed, abs(arm.angle() - before) / 0.01)
    assert arm.angle() == pytest.approx(0.5, abs=0.005)
    assert max_speed < 1.5
    assert arm.servos[0].memory["Present Load"] == 0  # the motor does not lift
    arm.servos[0].hand = None
    arm.run(3.0)
    assert arm.angle() == pytest.approx(-math.pi / 2, abs=0.05)


@pytest.mark.parametrize(("model", "yields"), [(XL330_M288, True), (XM430_W350, False)])
def test_the_torque_of_a_hand_is_limited(model, yields, tmp_path):
    arm = holding(Arm(tmp_path, model, mass=0.01))
    arm.servos[0].lead(2048 + COUNTS_PER_RAD)
    arm.run(2.0)
    assert (arm.angle() > 0.8) is yields
    assert arm.angle() > 0.01


def test_a_hand_leads_a_joint_with_an_inverted_or_reversed_servo(tmp_path):
    arm = Arm(tmp_path, XL430_W250)
    arm.servos[0].preset("Drive Mode", 1)
    arm.servos[0].lead(2048 + 0.3 * COUNTS_PER_RAD)
    arm.servos[1].lead(2048 - 0.6 * COUNTS_PER_RAD)
    arm.run(3.0)
    assert arm.angle() == pytest.approx(0.3, abs=0.005)
    assert arm.angle("elbow") == pytest.approx(0.6, abs=0.005)


@pytest.mark.parametrize("name", sorted(MODELS))
def test_goals_are_reached_in_both_mounting_directions(name, tmp_path):
    arm = holding(Arm(tmp_path, MODELS[name], mass=0.01))
    for number in (1, 2):
        arm.write(number, "Goal Position", 2048 + 300)
    arm.run(2.0)
    assert arm.angle() == pytest.approx(300 / COUNTS_PER_RAD, abs=0.05)
    assert arm.angle("elbow") == pytest.approx(-300 / COUNTS_PER_RAD, abs=0.05)
    assert abs(arm.servos[0].memory["Present Position"] - 2348) < 30
    assert arm.servos[0].memory["Moving"] == 0


def test_no_servo_exceeds_its_no_load_speed(tmp_path):
    arm = holding(Arm(tmp_path, XL330_M288, mass=0.01, posture={"shoulder": -1.5}))
    arm.write(1, "Goal Position", 3000)
    max_speed = 0.0
    for _ in range(200):
        arm.run(0.005)
        max_speed = max(max_speed, arm.servos[0].velocity)
    assert 0.5 < max_speed / (103.0 * 4096 / 60) <= 1.0


def test_a_gear_reduces_speed_and_increases_torque(tmp_path):
    arm = holding(Arm(tmp_path, XL430_W250, counts=(2 * COUNTS_PER_RAD, -COUNTS_PER_RAD)))
    arm.write(1, "Goal Position", 2448)
    arm.run(2.0)
    assert arm.angle() == pytest.approx(200 / COUNTS_PER_RAD, abs=0.02)


def test_a_velocity_based_profile_is_followed_under_load(tmp_path):
    arm = Arm(tmp_path, XM430_W350)
    arm.write(1, "Profile Velocity", 20)  # 4.58 rev/min, 313 pulses/s
    arm.write(1, "Profile Acceleration", 10)
    holding(arm)
    arm.write(1, "Goal Position", 2048 + 600)
    arm.run(1.0)
    assert arm.servos[0].velocity == pytest.approx(313, abs=15)
    assert arm.servos[0].memory["Velocity Trajectory"] == 20
    assert arm.servos[0].memory["Moving"] == 1


@pytest.mark.parametrize("acceleration_ms", [0, 300, 5000])
def test_a_time_based_profile_takes_its_duration(acceleration_ms, tmp_path):
    arm = Arm(tmp_path, XM430_W350)
    for name, value in (("Drive Mode", 4), ("Profile Velocity", 1000), ("Profile Acceleration", acceleration_ms)):
        assert arm.write(1, name, value) == 0
    holding(arm)
    arm.write(1, "Goal Position", 2548)
    arm.run(0.5)
    assert arm.servos[0].loops.trajectory.position == pytest.approx(2298, abs=3)  # half the time, half the distance
    arm.run(0.45)
    assert arm.servos[0].loops.trajectory.velocity > 0.0
    arm.run(0.07)
    assert arm.servos[0].loops.trajectory.position == pytest.approx(2548, abs=2)


def test_velocity_mode_reaches_its_goal_against_gravity(tmp_path):
    arm = holding(Arm(tmp_path, XM430_W350, posture={"shoulder": -1.5}), mode=1)
    arm.write(1, "Goal Velocity", 60)
    arm.run(1.5)
    assert arm.servos[0].memory["Present Velocity"] == pytest.approx(60, abs=6)


def test_current_mode_controls_torque(tmp_path):
    arm = holding(Arm(tmp_path, XM430_W350), mode=0)
    assert arm.servos[0].memory["Goal Current"] == 0
    torque = 9.81 * (0.1 * 0.075 + 0.02 * 0.2)  # N m, horizontal
    units = round(torque / 4.1 * 2.3 / 0.00269)
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


def test_current_based_position_yields_to_loads_above_its_goal_current(tmp_path):
    arm = holding(Arm(tmp_path, XL330_M288, mass=0.15), mode=5)
    arm.run(0.5)
    assert abs(arm.angle()) < 0.15
    arm.write(1, "Goal Current", 200)  # 0.07 N m
    arm.run(1.0)
    assert arm.angle() < -1.0
    assert abs(arm.servos[0].memory["Present Current"]) <= 200


def test_pwm_mode_turns_in_proportion_to_goal_pwm(tmp_path):
    arm = holding(Arm(tmp_path, XM430_W350, mass=0.01), mode=16)
    arm.write(1, "Goal PWM", 443)
    arm.run(1.0)
    top = 46.0 * 4096 / 60
    assert 0.3 < arm.servos[0].velocity / top < 0.6
    assert arm.servos[0].memory["Present PWM"] == 443


def test_goal_pwm_limits_the_load_of_position_control(tmp_path):
    arm = holding(Arm(tmp_path, XL430_W250, mass=0.6))
    arm.run(0.5)
    before = arm.angle()
    arm.write(1, "Goal PWM", 100)  # 11 % of 1.4 N m; 0.48 N m are required
    arm.run(1.0)
    assert before > -0.1
    assert arm.angle() < -0.5


def test_reverse_mode_inverts_position_and_torque(tmp_path):
    arm = Arm(tmp_path, XM430_W350)
    assert arm.write(1, "Drive Mode", 1) == 0
    assert arm.servos[0].memory["Present Position"] == 2048  # 4096 - 2048
    holding(arm)
    arm.write(1, "Goal Position", 2248)
    arm.run(1.0)
    assert arm.angle() == pytest.approx(-200 / COUNTS_PER_RAD, abs=0.03)
    assert arm.servos[0].memory["Present Position"] == pytest.approx(2248, abs=20)


def test_a_goal_switches_torque_on_if_drive_mode_enables_it(tmp_path):
    arm = Arm(tmp_path, XM430_W350)
    arm.write(1, "Drive Mode", 8)
    arm.write(1, "Goal Velocity", 10)  # not the goal register of this mode
    assert arm.servos[0].memory["Torque Enable"] == 0
    arm.write(1, "Goal Position", 2100)
    assert arm.servos[0].memory["Torque Enable"] == 1


def test_a_blocked_joint_overloads_its_servo_which_shuts_down_until_a_reboot(tmp_path):
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


def test_a_loaded_servo_heats_up_and_shuts_down_when_overheated(tmp_path):
    arm = holding(Arm(tmp_path, XM430_W350, mass=0.8))
    arm.run(1.0)
    initial = arm.servos[0].temperature
    arm.run(2.0)
    assert initial < arm.servos[0].temperature < initial + 1.0
    assert arm.servos[1].temperature < arm.servos[0].temperature
    arm.servos[0].temperature = 80.6
    arm.run(0.01)
    assert arm.servos[0].memory["Hardware Error Status"] == HardwareError.OVERHEATING
    assert arm.servos[0].memory["Torque Enable"] == 0


@pytest.mark.parametrize(("model", "shuts_down"), [(XL330_M077, True), (XM430_W350, False)])
def test_a_voltage_error_is_reported_and_shuts_down_only_if_enabled(model, shuts_down, tmp_path):
    arm = holding(Arm(tmp_path, model, mass=0.01))
    arm.servos[0].voltage = 0.5 * model.voltage
    arm.run(0.01)
    memory = arm.servos[0].memory
    assert memory["Hardware Error Status"] == HardwareError.VOLTAGE
    assert memory["Present Input Voltage"] == round(5 * model.voltage)
    assert memory["Torque Enable"] == (0 if shuts_down else 1)
    assert arm.servos[0].do(Instruction.PING).error & ALERT


@pytest.mark.parametrize("mode", [1, 3, 4, 5, 16])
def test_the_bus_watchdog_stops_the_arm_on_time_and_rejects_goals_until_cleared(mode, tmp_path):
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
    assert goal == "Goal PWM" or arm.angle() == pytest.approx(
        stopped, abs=0.06
    )  # it does not continue to the earlier goal
    assert arm.write(1, goal, arm.servos[0].memory[goal]) == 0


def test_a_servo_without_power_has_no_torque_and_receives_nothing(tmp_path):
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


def test_the_same_requests_cause_the_same_movement(tmp_path):
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
def test_any_writes_leave_the_world_stable_and_torque_within_limits(tmp_path, model, writes):
    arm = Arm(tmp_path, MODELS[model])
    for number, name, value in writes:
        if name in arm.servos[0].memory:
            arm.write(number, name, value)
        arm.run(0.02)
        for servo in arm.servos:
            assert abs(servo.torque) <= 2.01 * servo.model.stall_torque  # reversing adds the back-EMF
    assert all(math.isfinite(angle) for angle in (arm.angle(), arm.angle("elbow")))


@pytest.mark.parametrize("integrator", ["RK4", "Euler", "implicit"])
def test_a_light_link_is_stable_with_any_integrator(integrator, tmp_path):
    """Its servo's damping is much for so little inertia."""
    path = tmp_path / "light.xml"
    light = WORLD.format(mass=1e-4, damping=0.0).replace('armature="0.002"', "").replace('0.02"', '1e-4"')
    path.write_text(light.replace("implicitfast", integrator))
    mechanics = MujocoMechanics(path, [DrivenJoint("shoulder", COUNTS_PER_RAD), DrivenJoint("elbow", COUNTS_PER_RAD)])
    bus = EmulatedBus([EmulatedServo(XM430_W350, number) for number in (1, 2)], mechanics)
    for servo in bus.servos:
        servo.hold()
    bus.run_to(0.5)
    assert abs(mechanics.angles(["shoulder"])[0]) < 0.02


def test_an_invalid_world_is_rejected_with_its_cause(tmp_path):
    with pytest.raises(EmulatorError, match="is not a model") as missing:
        MujocoMechanics(tmp_path / "none.xml", [])
    assert missing.value.missing
    path = tmp_path / "arm.xml"
    path.write_text(WORLD.format(mass=0.1, damping=0.02))
    with pytest.raises(EmulatorError, match=r"no hinge or slide 'sholder' for a servo; .*shoulder"):
        MujocoMechanics(path, [DrivenJoint("sholder", COUNTS_PER_RAD)])
    path.write_text("<mujoco><wordbody/></mujoco>")
    with pytest.raises(EmulatorError, match="is not a model that MuJoCo can load"):
        MujocoMechanics(path, [])
