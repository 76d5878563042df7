"""An arm of servos as it is connected: who answers, how reliably, that it holds without a jump, and moves a little."""

import numpy as np
import pytest

from paramove.robots.dynamixel.arm.driven_arm import DrivenArm
from paramove.robots.dynamixel.arm.servo_arm import ServoArm, Timeouts
from paramove.robots.dynamixel.arm.servo_loop import LoopSettings
from paramove.robots.dynamixel.arm.setup import joint_servos
from paramove.robots.dynamixel.bus.servo_chain import ServoChain
from tests.robots.dynamixel.person import Person

SETTINGS = LoopSettings(torque_off=True, timeouts=Timeouts(silent_s=1.0, watchdog_s=2.0, read_s=1.0))
A_LITTLE = np.deg2rad(3.0)


@pytest.fixture
def arm(robot, port):
    with port:
        yield ServoArm(joint_servos(robot), ServoChain(port), 1e-6 * robot.stream.period_us, SETTINGS.timeouts)


def test_every_servo_of_the_description_answers_as_the_model_that_it_is(robot, port):
    with port:
        found = {one.number: one.model_number for one in ServoChain(port).ping_all()}
    assert {joint.number: joint.model.number for joint in joint_servos(robot)}.items() <= found.items()


def test_nothing_keeps_it_from_being_armed(arm):
    assert [fault.detail for fault in arm.check() if fault.code != "bus_slow"] == []


def test_no_answer_is_lost_and_the_positions_are_those_of_an_arm_at_rest(robot, port, arm):
    readings = [arm.measured().counts for _ in range(100)]
    assert np.ptp(readings, axis=0).max() <= 2
    angles = robot.units.to_radians(np.median(readings, axis=0).round())
    assert (angles >= robot.lower).all()
    assert (angles <= robot.upper).all()


def test_it_holds_without_a_jump(arm):
    before = arm.measured().counts
    assert arm.take_hold() == ()
    for _ in range(50):
        assert np.abs(arm.measured().counts - before).max() < 20
    assert arm.let_go(torque_off=True) == ()


def test_it_moves_its_last_joint_a_little_and_back(robot, port):
    place = robot.chain.indices[-1]
    joint = robot.joint_names[place]
    with DrivenArm(robot, joint_servos(robot), port, SETTINGS) as driven:
        person = Person(driven)
        person.hears_until(lambda: person.angles)
        person.arms_and_waits()
        angle = person.angles[-1][place]
        there = angle - np.copysign(A_LITTLE, angle)
        person.publish("a little", [joint], [(0.0, [angle]), (1.0, [there]), (2.0, [angle])])
        person.is_told("SUCCEEDED")
        angles = np.array(person.angles)[:, place]
        assert np.abs(angles - there).min() < np.deg2rad(1.0)
        assert angles[-1] == pytest.approx(angle, abs=np.deg2rad(1.0))
