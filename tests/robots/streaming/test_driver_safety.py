"""What the arm driver hands on to the safety gate: emergency stop, failed checks, faults; and another period."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from paramove.msgs.joint_trajectory_pb2 import TrajectoryStatus
from paramove.msgs.safety_state_pb2 import ArmRequest, LinkState, SafetyState
from paramove.robots.streaming.driver import SAFETY_STATES, ArmDriver
from paramove.robots.streaming.stream import StreamReader
from paramove.safety.gate_io import Fault, SafetySettings, State
from tests.robots.hoap3.movements import HOAP3
from tests.robots.streaming.fake_robot import TICK_NS, Rig, armed, trajectory
from tests.robots.streaming.test_driver import GOAL, expect_within_limits


def in_motion() -> Rig:
    rig = armed()
    rig.send("one", GOAL, duration_s=2.0)
    for _ in range(8):
        rig.tick()
    assert not rig.robot.reader.at_rest
    return rig


def codes(rig: Rig) -> list[str]:
    assert rig.output is not None
    return [fault.code for fault in rig.output.safety.faults]


def test_every_state_of_the_gate_has_its_word_on_the_bus() -> None:
    assert set(SAFETY_STATES) == set(State)
    assert set(SAFETY_STATES.values()) | {SafetyState.STATE_UNSPECIFIED} == set(SafetyState.State.values())


def test_the_emergency_stop_stops_in_motion_and_is_left_only_by_release_and_a_new_word() -> None:
    rig = in_motion()
    rig.driver.on_emergency(True)
    rig.driver.on_emergency(False)  # a flicker within one period is a press
    output = rig.tick()
    assert output is not None
    assert output.safety.state == SafetyState.STATE_ESTOP
    assert output.stream is not None
    assert output.stream.stop_ramp_frames == len(output.stream.frames)
    assert rig.statuses[-1].state == TrajectoryStatus.STATE_STOPPED
    assert "the emergency stop is pressed" in rig.statuses[-1].reason
    for _ in range(20):
        rig.tick()
    assert rig.robot.reader.at_rest
    rig.arm()
    assert rig.driver.state is State.ESTOP
    resting = rig.robot.reader.target.copy()
    rig.driver.on_emergency(False)
    rig.tick()
    assert rig.driver.state is State.DISARMED
    np.testing.assert_array_equal(rig.robot.reader.target, resting)
    rig.arm()
    assert rig.driver.state is State.ARMED
    expect_within_limits(rig)


def test_failed_checks_are_all_told_and_forbid_arming_until_they_pass() -> None:
    rig = Rig()
    rig.tick()
    rig.driver.on_arming_checks((Fault("voltage", "", "9 V"), Fault("model", "right_elbow", "another model")))
    rig.arm()
    assert rig.driver.state is State.DISARMED
    assert codes(rig) == ["voltage", "model"]
    rig.driver.on_arming_checks(())
    rig.arm()
    assert rig.driver.state is State.ARMED


def test_a_fault_of_the_robot_stops_and_is_held() -> None:
    rig = in_motion()
    rig.driver.on_fault(Fault("overload", "right_elbow", "joint right_elbow is overloaded"))
    rig.tick()
    assert rig.driver.state is State.STOPPING
    for _ in range(20):
        rig.tick()
    assert rig.driver.state is State.HOLD
    assert codes(rig) == ["overload"]
    expect_within_limits(rig)


def test_a_joint_that_does_not_follow_is_given_way_to() -> None:
    rig = Rig()
    rig.driver = ArmDriver(HOAP3, SafetySettings(following=np.full(28, np.deg2rad(5.0))))
    rig.tick()
    rig.arm()
    elbow = HOAP3.index("right_elbow")
    held = int(rig.robot.reader.target[elbow]) - 209 * 8
    rig.robot.held_joints[elbow] = held
    for _ in range(30):
        rig.tick()
    assert rig.driver.state is State.HOLD
    assert codes(rig) == ["following"]
    assert abs(int(rig.robot.reader.target[elbow]) - held) <= 1
    expect_within_limits(rig)


@pytest.mark.parametrize("period_us", [1000, 2000, 10_000])
def test_rows_of_another_period_are_driven_by_the_same_driver(period_us: int) -> None:
    robot = replace(HOAP3, stream=HOAP3.stream.model_copy(update={"period_us": period_us}))
    reader = StreamReader(robot, robot.units.to_counts(robot.base_pose))
    driver, now, played, statuses = ArmDriver(robot), 1_000_000_000, [reader.target], []
    for tick in range(60):
        now += 40_000_000
        driver.on_robot_state(reader.state(reader.target, now), now)
        if tick == 1:
            driver.on_arm_request(ArmRequest(source="test", armed=True, by_person=True), now)
        if tick == 3:
            driver.on_trajectory(trajectory("one", GOAL, duration_s=1.0), now)
        output = driver.tick(now)
        statuses += output.statuses
        if output.stream is not None:
            assert output.stream.period_us == period_us
            assert reader.offer(output.stream), reader.rejection
        played += [reader.play() for _ in range(40_000 // period_us)]
    assert statuses[-1].state == TrajectoryStatus.STATE_SUCCEEDED, statuses[-1].reason
    assert reader.rejected_batches == 0
    steps = np.abs(np.diff(np.array(played, dtype=np.float64), axis=0))
    period_s = period_us * 1e-6
    per_rad = np.abs(robot.units.counts_per_rad)
    assert (steps <= per_rad * robot.operating_velocity * period_s + 1).all()


def silent(rig: Rig) -> list[str]:
    """What the driver says of a robot that it does not hear for a second."""
    for _ in range(15):
        rig.now_ns += TICK_NS
        rig.output = rig.driver.tick(rig.now_ns)
        rig.statuses += rig.output.statuses
        rig.robot.play()
    assert rig.driver.state is State.DISCONNECTED
    return codes(rig)


def test_a_robot_that_falls_silent_after_a_fault_is_told_by_that_fault_first() -> None:
    rig = in_motion()
    rig.driver.on_fault(Fault("port_lost", "", "the port went away"))
    assert silent(rig) == ["port_lost", "robot_silent"]
    assert rig.statuses[-1].reason.startswith("the port went away; no data from the robot")
    rig.tick()
    rig.tick()
    assert rig.driver.state is State.DISARMED
    assert codes(rig) == ["port_lost", "robot_silent"]
    rig.arm()
    assert (rig.driver.state, codes(rig)) == (State.ARMED, [])
    assert silent(rig) == ["robot_silent"]


LINK_S = 0.08


def linked(rig: Rig) -> None:
    rig.driver.on_link(LinkState(hosts=["desk_pc"]), rig.now_ns + TICK_NS - 10_000_000)


def test_a_lost_link_stops_the_robot_and_its_return_moves_nothing() -> None:
    rig = Rig()
    rig.driver = ArmDriver(HOAP3, link_timeout_s=LINK_S)
    rig.tick()
    rig.arm()
    assert (rig.driver.state, codes(rig)) == (State.DISARMED, ["link_lost"])  # no other host has replied yet
    linked(rig)
    rig.arm()
    rig.send("one", GOAL, duration_s=2.0)
    for _ in range(8):
        linked(rig)
        rig.tick()
        assert rig.driver.state is State.ARMED
        assert not rig.driver.is_cut_off(rig.now_ns)
    rig.tick()
    rig.tick()
    assert (rig.driver.state, codes(rig)) == (State.STOPPING, ["link_lost"])
    for _ in range(20):
        linked(rig)
        rig.tick()
    assert (rig.driver.state, codes(rig)) == (State.HOLD, ["link_lost"])
    assert rig.statuses[-1].state == TrajectoryStatus.STATE_STOPPED
    assert "desk_pc" in rig.statuses[-1].reason
    linked(rig)
    rig.arm()
    assert rig.driver.state is State.ARMED
    assert rig.robot.reader.at_rest
    expect_within_limits(rig)


def test_a_lost_link_while_nothing_moves_only_keeps_it_disarmed() -> None:
    rig = Rig()
    rig.driver = ArmDriver(HOAP3, link_timeout_s=LINK_S)
    for _ in range(10):
        rig.tick()
    assert (rig.driver.state, codes(rig)) == (State.DISARMED, [])
    linked(rig)
    rig.arm()
    assert rig.driver.state is State.ARMED
