"""The arm driver's node, replayed from a recording of a robot that was armed, moved and lost."""

import numpy as np
from numpy.testing import assert_allclose

from nodes import arm_driver
from paramove.bus import topics
from paramove.bus.recorded import RecordedBus
from paramove.bus.subscriber import Received
from paramove.bus.ticks import Tick
from paramove.msgs.joint_trajectory_pb2 import TrajectoryStatus
from paramove.msgs.safety_state_pb2 import ArmRequest, SafetyState
from paramove.robots.hoap3.wire import state_message
from tests.motion.reaching import ROBOT_FOLDER
from tests.robots.hoap3.movements import HOAP3
from tests.robots.streaming.fake_robot import TICK_NS, FakeRobot, trajectory

CONFIG = arm_driver.Config(robot=ROBOT_FOLDER)


def replayed(ticks: int, more: dict[int, list], until_state: int | None = None) -> RecordedBus:
    """The robot stands at its base pose; `more` is heard at its ticks; the robot says nothing from `until_state` on."""
    robot, events = FakeRobot(), []
    robot.reader.target[:] = HOAP3.units.to_counts(HOAP3.base_pose)
    for number in range(1, ticks + 1):
        now_ns = number * TICK_NS
        heard = list(more.get(number, []))
        if until_state is None or number < until_state:
            heard.insert(0, (topics.WIRE_HOAP3_STATE, state_message(robot.state(now_ns))))
        events += [Received(topic, message, now_ns, now_ns, number) for topic, message in heard]
        events.append(Tick(number, now_ns))
    bus = RecordedBus(events)
    arm_driver.run(bus, CONFIG)
    return bus


def states(bus: RecordedBus) -> list[int]:
    return [said.message.state for said in bus.published_on(topics.ARM_SAFETY)]


def test_says_joints_and_safety_once_a_tick() -> None:
    bus = replayed(20, {})
    joints = bus.published_on(topics.ARM_JOINT_STATES)
    assert len(joints) == len(states(bus)) == 20
    assert [said.captured_ns for said in joints] == [number * TICK_NS for number in range(1, 21)]
    found = {joint.name: joint.position for joint in joints[-1].message.joints}
    assert set(found) == set(HOAP3.joint_names)
    assert_allclose([found[name] for name in HOAP3.joint_names], HOAP3.base_pose, rtol=0, atol=np.deg2rad(0.8))
    assert set(states(bus)[1:]) == {SafetyState.STATE_DISARMED}
    assert bus.published_on(topics.WIRE_HOAP3_STREAM) == []
    assert {said.topic for said in bus.published} <= set(arm_driver.PUBLISHES)


def test_a_disarmed_driver_refuses_trajectories_and_streams_nothing() -> None:
    bus = replayed(20, {10: [(topics.ARM_TRAJECTORY, trajectory("one", {"right_elbow": -60.0}, 1.0))]})
    (status,) = (said.message for said in bus.published_on(topics.ARM_TRAJECTORY_STATUS))
    assert status.state == TrajectoryStatus.STATE_REJECTED
    assert "disarmed" in status.reason
    assert bus.published_on(topics.WIRE_HOAP3_STREAM) == []


def test_armed_by_a_word_it_streams_batches_that_end_in_a_stop_ramp() -> None:
    word = ArmRequest(source="a person", armed=True, by_person=True)
    bus = replayed(
        12,
        {
            5: [(topics.OPERATOR_ARM, word)],
            8: [(topics.ARM_TRAJECTORY, trajectory("one", {"right_elbow": -60.0}, 1.0))],
        },
    )
    assert states(bus)[3] == SafetyState.STATE_DISARMED
    assert states(bus)[5] == SafetyState.STATE_ARMED
    batches = [said.message for said in bus.published_on(topics.WIRE_HOAP3_STREAM)]
    assert batches
    assert batches[0].stop_ramp_frames > 0
    assert len(batches[0].frames) % (2 * HOAP3.n_joints) == 0
    first = bus.published_on(topics.ARM_TRAJECTORY_STATUS)[0].message
    assert (first.trajectory_id, first.state) == ("one", TrajectoryStatus.STATE_ACCEPTED)


def test_a_robot_that_falls_silent_is_told() -> None:
    bus = replayed(
        60, {5: [(topics.OPERATOR_ARM, ArmRequest(source="a person", armed=True, by_person=True))]}, until_state=20
    )
    assert states(bus)[15] == SafetyState.STATE_ARMED
    assert states(bus)[-1] != SafetyState.STATE_ARMED


def test_a_disarming_word_is_heard() -> None:
    words = {
        5: [(topics.OPERATOR_ARM, ArmRequest(source="a person", armed=True, by_person=True))],
        10: [(topics.OPERATOR_ARM, ArmRequest(source="a person", armed=False, by_person=True))],
    }
    found = states(replayed(30, words))
    assert found[7] == SafetyState.STATE_ARMED
    assert found[-1] == SafetyState.STATE_DISARMED
