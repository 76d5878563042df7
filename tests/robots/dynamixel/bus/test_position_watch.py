"""Positions of servos that cannot be true: what no motor and no hand does in so short a time is another's angle."""

import re

import numpy as np
import pytest

from dynamixel_emulator.emulator import DynamixelEmulator
from dynamixel_emulator.wire_faults import WireFaults
from paramove.robots.description import RobotDescription
from paramove.robots.dynamixel.arm.gravity_compensated_arm import TorqueOffArm
from paramove.robots.dynamixel.arm.servo_arm import ServoArm
from paramove.robots.dynamixel.arm.setup import joint_servos, servo_port
from paramove.robots.dynamixel.bus.position_watch import NOISE, PositionWatch
from paramove.robots.dynamixel.bus.servo_chain import ServoChain
from paramove.robots.dynamixel.bus.servo_models import XL430_W250
from sim.emulated_arm import emulated_servos
from tests.robots.dynamixel.untrue_replies import FaultyChain, OneAsTheNext, OneElsewhere, SameAsTheNext

ROBOT = RobotDescription.load("robot_description/open_manipulator_x")
MS = 1_000_000
TOP = XL430_W250.top_speed / 60.0 * 4096 * 14.0 / 11.1
"""Pulses per second at 14 V, the most that this servo bears; it has 57 rev/min at 11.1 V."""


def watch(position: int = 2048) -> PositionWatch:
    """Of a servo that was asked at 0 ms, and answered after 1 ms."""
    made = PositionWatch({1: XL430_W250})
    assert made.accepts(1, position, (0, MS), torque=True)
    return made


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("age_ms", [2, 11, 100])
def test_a_servo_with_torque_turns_as_fast_as_its_motor_since_it_was_last_asked(sign, age_ms):
    way = int(NOISE + TOP * 1e-3 * age_ms)
    assert watch().accepts(1, 2048 + sign * way, ((age_ms - 1) * MS, age_ms * MS), torque=True)
    made = watch()
    assert not made.accepts(1, 2048 + sign * (way + 1), ((age_ms - 1) * MS, age_ms * MS), torque=True)
    assert (made.jump.number, made.jump.before, made.jump.position) == (1, 2048, 2048 + sign * (way + 1))
    assert made.jump.seconds == pytest.approx(1e-3 * age_ms)


def test_a_hand_turns_a_servo_without_torque_faster_and_a_foreign_angle_is_still_rejected():
    assert watch().accepts(1, 2048 + 140, (10 * MS, 11 * MS), torque=False)
    made = watch()
    assert not made.accepts(1, 2048 + 464, (10 * MS, 11 * MS), torque=False)
    assert "jumped by 40.8 deg, from 2048 to 2512 pulses, within 11.0 ms, allowed 13." in str(made.jump)


def test_a_rejected_position_moves_nothing_and_a_true_one_is_believed_at_once():
    made = watch()
    assert not made.accepts(1, 3000, (9 * MS, 10 * MS), torque=True)
    assert not made.accepts(1, 3000, (19 * MS, 20 * MS), torque=True)
    assert made.accepts(1, 2050, (29 * MS, 30 * MS), torque=True)
    assert made.jump.position == 3000


@pytest.mark.parametrize("far", [400, 1500, -1900])
def test_three_positions_in_a_row_that_agree_are_true_however_far_they_are(far):
    made = watch()
    accepted = []
    for ms, position in (
        (10, 2048 + far),
        (11, 2048 + far + 300),
        (12, 2048 + far),
        (13, 2048 + far),
        (14, 2048 + far),
    ):
        accepted.append(made.accepts(1, position, (ms * MS, ms * MS + MS), torque=True))
    assert accepted == [False, False, False, False, True]


@pytest.mark.parametrize(("apart", "speed"), [(20, 0.0), (45, 0.0), (455, 0.0), (130, 400.0), (455, 400.0)])
@pytest.mark.parametrize(
    ("faults", "timeout_ms"),
    [
        ({"damaged": 0.3, "foreign": 0.1}, 8),
        ({"damaged": 0.3, "foreign": 0.1}, 80),
        ({"lost": 0.3, "foreign": 0.2}, 20),
    ],
)
def test_damaged_and_foreign_replies_give_no_joint_anothers_angle(speed, apart, faults, timeout_ms):
    """Joints next to each other, at rest and turning to and fro; pulses and pulses per second."""
    starts = {number: 1500.0 + apart * number for number in range(1, 6)}
    chain = FaultyChain(dict(starts), WireFaults(), timeout_ms)
    made = PositionWatch(dict.fromkeys(starts, XL430_W250))
    made.read(chain, held=starts)
    chain._faults = WireFaults(**faults, seed=apart)
    worst, accepted = 0.0, 0
    for _ in range(600):
        for number, start in starts.items():
            turned = 1e-9 * chain.now_ns * speed % 600.0
            chain.positions[number] = start + (turned if turned < 300.0 else 600.0 - turned)
        for number, one in made.read(chain, held=starts).items():
            accepted += 1
            worst = max(worst, abs(one.values["Present Position"] - chain.positions[number]))
    assert worst <= NOISE + 1
    assert accepted > 300


def test_a_servo_that_stays_where_it_was_turned_is_believed_after_a_while():
    made = watch()
    assert [made.accepts(1, 2448, (ms * MS, (ms + 1) * MS), torque=True) for ms in (10, 40, 100)] == [
        False,
        False,
        True,
    ]


def test_the_first_position_of_all_is_believed_where_nobody_is_missing_or_two_agree():
    made = PositionWatch({1: XL430_W250})
    told = []
    for ms, position in ((0, 2512), (10, 2048), (20, 2050), (30, 2049)):
        told.append(made.accepts(1, position, (ms * MS, (ms + 1) * MS), torque=False, complete=False))
    assert told == [False, False, False, True]
    assert made.jump is None


def test_where_a_servo_is_missing_no_hand_explains_a_jump():
    assert not watch().accepts(1, 2048 + 140, (10 * MS, 11 * MS), torque=False, complete=False)
    assert watch().accepts(1, 2048 + 50, (10 * MS, 11 * MS), torque=False, complete=False)


def test_a_servo_that_was_switched_off_begins_within_a_turn_again_but_loses_none_while_it_holds():
    assert watch(4196).accepts(1, 100, (9 * MS, 10 * MS), torque=False)
    made = watch(4196)
    assert not made.accepts(1, 100, (9 * MS, 10 * MS), torque=True)
    assert not made.accepts(1, 100, (60_000 * MS, 60_001 * MS), torque=True)
    assert made.jump.allowed < 4096


@pytest.fixture
def emulator():
    with DynamixelEmulator(emulated_servos(ROBOT)) as emulator:
        for servo, place in zip(emulator.bus.servos, (1800.0, 1500.0, 2300.0, 2600.0, 2048.0), strict=True):
            servo.turned(place)
        yield emulator


@pytest.fixture
def port(emulator):
    closed = servo_port(ROBOT, emulator.port)
    closed.latency_s = 0.02
    with closed as port:
        yield port


def looks_at_faults(emulator, each: int, look) -> int:
    while look() is None:
        pass
    right = look()
    emulator.faults = OneAsTheNext(each)
    found = [one for one in (look() for _ in range(40)) if one is not None]
    for one in found:
        np.testing.assert_allclose(one, right, rtol=0.0, atol=np.deg2rad(1.0))
    return len(found)


def test_no_joint_of_an_arm_that_is_led_has_anothers_angle(emulator, port):
    arm = TorqueOffArm(ServoChain(port), ROBOT)

    def look():
        found = arm.measured()
        return found and found[1]

    assert looks_at_faults(emulator, 3, look) > 10


@pytest.mark.parametrize("each", [1, 3])
def test_no_joint_of_a_servo_arm_has_anothers_angle(emulator, port, each):
    arm = ServoArm(joint_servos(ROBOT), ServoChain(port), 0.01)

    def look():
        reading = arm.measured()
        return None if reading is None else ROBOT.units.to_radians(reading.counts)

    assert looks_at_faults(emulator, each, look) == 40


@pytest.fixture
def still(monkeypatch):
    """Nothing can move, however long the machine pauses."""
    monkeypatch.setattr("paramove.robots.dynamixel.bus.position_watch.HAND_SPEED", 0.0)
    monkeypatch.setattr("paramove.robots.dynamixel.bus.position_watch._top_speed", lambda model: 0.0)


def test_a_joint_that_jumps_is_a_fault_and_keeps_its_angle(emulator, port, still):
    port.latency_s = 0.3
    arm = ServoArm(joint_servos(ROBOT), ServoChain(port), 1.0)
    before = arm.measured().counts
    emulator.faults = OneElsewhere(12, 1900)
    reading = arm.measured()
    np.testing.assert_array_equal(reading.counts, before)
    fault = arm.fault_of_answers(reading)
    assert (fault.code, fault.joint) == ("joint_jumped", ROBOT.joint_names[1])
    assert re.search(r"jumped by 167\.0 deg, from 1500 to 3400 pulses, within [0-9.]+ ms, allowed", fault.detail)
    assert arm.fault_of_answers(arm.measured()) is None
    emulator.faults = OneElsewhere(12, 1900)
    assert [fault.code for fault in arm.check()] == ["joint_jumped"]


def test_a_position_that_is_withheld_counts_as_a_lost_reply_and_stops_the_arm_as_one(emulator, port):
    port.latency_s = 0.004
    arm = ServoArm(joint_servos(ROBOT), ServoChain(port), 0.01)
    while arm.measured() is None:
        pass
    before = arm.measured().counts
    emulator.faults = SameAsTheNext(12)
    codes = []
    while "joint_silent" not in codes:
        reading = arm.measured()
        np.testing.assert_array_equal(reading.counts, before)
        fault = arm.fault_of_answers(reading)
        codes += [] if fault is None else [fault.code]
    assert (reading.ages_s[[1, 2]] > 0.05).all()
    assert (reading.ages_s[[0, 3, 4]] < reading.ages_s[1]).all()


def test_ids_that_were_exchanged_while_it_is_disarmed_keep_the_arm_from_being_armed(emulator, port):
    """Servos of one model, so that nothing else tells them apart; exchanged back, they are right."""
    port.latency_s = 0.1
    arm = ServoArm(joint_servos(ROBOT), ServoChain(port), 1.0)
    while arm.measured() is None:
        pass
    for expected in (["servos_exchanged"], []):
        with emulator.lock:
            one, other = (emulator.bus.servos[index].memory for index in (1, 3))
            one["ID"], other["ID"] = other["ID"], one["ID"]
        for _ in range(4):
            arm.measured()
        faults = arm.check()
        assert [fault.code for fault in faults] == expected
        assert all("servo 12 (" in fault.detail and "servo 14 (" in fault.detail for fault in faults)


def test_an_arm_is_not_held_where_another_servo_stands(emulator, port, still):
    """Torque on with the goal of another joint would move this one there."""
    port.latency_s = 0.3
    arm = ServoArm(joint_servos(ROBOT), ServoChain(port), 1.0)
    arm.measured()
    emulator.faults = OneElsewhere(12, 1900)
    (fault,) = arm.take_hold()
    assert (fault.code, fault.joint) == ("servo_refused", ROBOT.joint_names[1])
    assert "from 1500 to 3400 pulses" in fault.detail
    assert emulator.bus.servos[1].memory["Torque Enable"] == 0
