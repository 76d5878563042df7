"""The arm driver against a robot that only plays its stream."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paramove.msgs.joint_trajectory_pb2 import TrajectoryStatus
from paramove.msgs.safety_state_pb2 import ArmRequest, SafetyState, StopRequest
from paramove.robots.streaming.driver import ArmDriver
from paramove.safety.gate_io import State
from tests.robots.hoap3.movements import HOAP3
from tests.robots.streaming.fake_robot import TICK_NS, Rig, armed, trajectory

GOAL = {"right_shoulder_pitch": 40.0, "right_elbow": -70.0, "right_wrist": 30.0, "right_fingers": 20.0}
ACCEPTED, EXECUTING, SUCCEEDED, STOPPED, REJECTED = range(1, 6)


def expect_within_limits(rig: Rig) -> None:
    counts = np.array(rig.robot.played, dtype=np.float64)
    per_rad = np.abs(HOAP3.units.counts_per_rad)
    assert (np.abs(np.diff(counts, axis=0)) <= per_rad * HOAP3.operating_velocity * 1e-3 + 1).all()
    bend = np.abs(counts[16:] - 2 * counts[8:-8] + counts[:-16])
    assert (bend <= per_rad * HOAP3.stop_acceleration * 0.008**2 + 2).all()


def test_disarmed_at_the_start_and_sends_nothing() -> None:
    rig = Rig()
    output = rig.tick()
    assert output is not None
    assert output.stream is None
    assert output.safety.state == SafetyState.STATE_DISARMED
    assert [joint.name for joint in output.joint_states.joints] == list(HOAP3.joint_names)
    rig.send("early", GOAL)
    rig.tick()
    assert rig.statuses[-1].state == REJECTED
    assert "only while armed" in rig.statuses[-1].reason


def test_a_trajectory_is_played_to_its_end_and_the_rest_of_the_body_keeps_its_pose() -> None:
    rig = armed()
    rig.send("one", GOAL)
    rig.run_until_rest()
    states = [status.state for status in rig.statuses]
    assert states[0] == ACCEPTED
    assert set(states[1:-1]) == {EXECUTING}
    assert states[-1] == SUCCEEDED
    expected = HOAP3.base_pose.copy()
    expected[HOAP3.indices(GOAL)] = np.deg2rad(list(GOAL.values()))
    np.testing.assert_array_equal(rig.robot.reader.target, HOAP3.units.to_counts(expected))
    still = np.setdiff1d(np.arange(28), HOAP3.indices(GOAL))
    assert (np.array(rig.robot.played)[:, still] == HOAP3.units.to_counts(HOAP3.base_pose)[still]).all()
    assert rig.robot.reader.rejected_batches == 0
    expect_within_limits(rig)


def test_a_second_trajectory_continues_where_the_first_ended() -> None:
    rig = armed()
    for name, goal in (("out", GOAL), ("back", dict.fromkeys(GOAL, 0.0))):
        message = trajectory(name, GOAL, 1.0)
        if name == "back":
            points = [list(point.position_rad) for point in message.points]
            for point, position in zip(message.points, reversed(points), strict=True):
                point.position_rad[:] = position
        rig.driver.on_trajectory(message, rig.now_ns)
        rig.run_until_rest()
        assert rig.statuses[-1].state == SUCCEEDED, (goal, rig.statuses[-1].reason)
    np.testing.assert_array_equal(rig.robot.reader.target, HOAP3.units.to_counts(HOAP3.base_pose))
    expect_within_limits(rig)


@pytest.mark.parametrize("lost", [1, 3])
def test_lost_batches_are_ridden_through(lost: int) -> None:
    rig = armed()
    rig.send("one", GOAL, duration_s=2.0)
    for tick in range(60):
        rig.tick(lose=5 <= tick < 5 + lost)
    assert rig.statuses[-1].state == SUCCEEDED
    expect_within_limits(rig)


def test_a_driver_that_is_faster_than_the_robot_does_not_fill_its_buffer() -> None:
    rig = armed()
    rig.send("one", GOAL, duration_s=3.0)
    reader, depths = rig.robot.reader, []
    for _ in range(300):  # the robot plays nothing meanwhile
        rig.now_ns += 1_000_000
        rig.driver.on_robot_state(rig.robot.state(rig.now_ns), rig.now_ns)
        batch = rig.driver.tick(rig.now_ns).stream
        assert batch is None or reader.offer(batch)
        depths.append(reader.depth)
    assert depths[-1] == max(depths)
    stream = HOAP3.stream
    assert 0 < max(depths) < stream.cover_ms + stream.guard_ms + 400  # with the stop ramp
    rig.run_until_rest()
    assert rig.statuses[-1].state == SUCCEEDED, rig.statuses[-1].reason
    expect_within_limits(rig)


def test_a_dead_driver_leaves_a_robot_that_stops_smoothly() -> None:
    rig = armed()
    rig.send("one", GOAL, duration_s=2.0)
    for tick in range(25):
        rig.tick(driver_runs=tick < 8)
    assert rig.robot.reader.at_rest
    assert len({bytes(frame) for frame in rig.robot.played[-100:]}) == 1
    expect_within_limits(rig)


def test_an_under_run_is_latched_until_somebody_arms_again() -> None:
    rig = armed()
    rig.send("one", GOAL, duration_s=2.0)
    for tick in range(25):
        rig.tick(lose=tick >= 8)
    assert rig.driver.state is State.HOLD
    assert rig.statuses[-1].state == STOPPED
    assert "ran out of rows" in rig.statuses[-1].reason
    rig.send("two", GOAL)
    rig.tick()
    assert rig.statuses[-1].state == REJECTED
    rig.arm()
    assert rig.driver.state is State.ARMED


def test_disarming_in_motion_stops_early_along_the_path_and_disarms() -> None:
    rig = armed()
    rig.send("one", GOAL, duration_s=2.0)
    for _ in range(12):
        rig.tick()
    before = rig.robot.reader.next_index
    rig.arm(armed=False)
    assert rig.driver.state is State.STOPPING
    for _ in range(8):
        rig.tick()
    assert rig.driver.state is State.DISARMED
    assert rig.statuses[-1].state == STOPPED
    assert rig.robot.reader.next_index - before < 400  # rows; guard, ramp and one tick
    expect_within_limits(rig)


def test_a_restarted_driver_is_disarmed_even_if_the_old_arm_word_comes_again() -> None:
    rig = armed()
    old_word_ns = rig.now_ns
    rig.driver = ArmDriver(HOAP3)

    rig.driver.on_arm_request(ArmRequest(source="test", armed=True, by_person=True), old_word_ns)
    rig.tick()
    rig.driver.on_arm_request(ArmRequest(source="test", armed=True, by_person=True), old_word_ns)
    rig.tick()
    assert rig.driver.state is State.DISARMED
    rig.arm()
    rig.send("new life", GOAL)
    rig.run_until_rest()
    assert rig.statuses[-1].state == SUCCEEDED


def test_a_program_arms_a_robot_that_is_emulated_and_no_other() -> None:
    for no_program, state in (("", State.ARMED), ("it is real", State.DISARMED)):
        rig = Rig(no_program)
        rig.tick()
        rig.arm(by_person=False)
        assert rig.driver.state is state


@pytest.mark.parametrize(("ahead_s", "accepted"), [(0.03, True), (0.07, False), (0.9, False), (1e6, False)])
def test_a_trajectory_from_the_future_is_refused_like_an_old_one(ahead_s: float, accepted: bool) -> None:
    rig = armed()
    rig.driver.on_trajectory(trajectory("one", GOAL, 1.0), rig.now_ns + TICK_NS + round(ahead_s * 1e9))
    rig.tick()
    assert (rig.statuses[-1].state != REJECTED) is accepted
    assert accepted or (rig.statuses[-1].code, "age -" in rig.statuses[-1].reason) == ("stale", True)


def test_the_same_trajectory_is_played_once_and_answered_again() -> None:
    rig = armed()
    rig.send("one", GOAL)
    rig.send("one", GOAL)
    rig.tick()
    assert [status.state for status in rig.statuses] == [ACCEPTED, ACCEPTED]
    rig.send("other", GOAL)
    rig.tick()
    assert "busy" in rig.statuses[-1].reason


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"start_deg": 2.5}, "(start) at point 0"),
        ({"duration_s": 0.4}, "(velocity)"),
        ({"goal_deg": {"right_elbow": 0.5}}, "joint_limit"),
        ({"goal_deg": {"right_shoulder_pitch": float("nan")}}, "not_finite"),
    ],
)
def test_trajectories_that_cannot_be_played_are_refused(change: dict, reason: str) -> None:
    rig = armed()
    goal = {**GOAL, **change.pop("goal_deg", {})}
    rig.send("bad", goal, **change)
    rig.tick()
    assert rig.statuses[-1].state == REJECTED
    assert reason in rig.statuses[-1].reason
    assert rig.output is not None
    assert rig.output.stream is None
    assert rig.output.safety.rejected_trajectories == 1


def test_old_trajectories_are_refused() -> None:
    rig = armed()
    rig.driver.on_trajectory(trajectory("old", GOAL, 1.0), rig.now_ns - 2_000_000_000)
    rig.tick()
    assert "stale" in rig.statuses[-1].reason


def test_fingers_that_hold_something_are_done_and_a_blocked_elbow_is_not() -> None:
    rig = armed()
    rig.robot.held_joints[HOAP3.index("right_fingers")] = 20
    rig.send("grasp", GOAL)
    rig.run_until_rest()
    assert rig.statuses[-1].state == SUCCEEDED
    rig = armed()
    rig.robot.held_joints[HOAP3.index("right_elbow")] = 20_000
    rig.send("blocked", GOAL)
    rig.run_until_rest()
    assert rig.statuses[-1].state == STOPPED
    assert "right_elbow" in rig.statuses[-1].reason


def test_a_silent_robot_disconnects_the_driver() -> None:
    rig = armed()
    for _ in range(10):
        rig.now_ns += 66_666_667
        output = rig.driver.tick(rig.now_ns)
    assert output.safety.state == SafetyState.STATE_DISCONNECTED
    assert output.safety.faults[0].code == "robot_silent"
    rig.tick()
    assert rig.driver.state is State.DISARMED


@settings(deadline=None, max_examples=25, derandomize=True)
@given(pattern=st.lists(st.sampled_from(["tick", "tick", "tick", "lose", "dead"]), min_size=10, max_size=40))
def test_whatever_is_lost_the_robot_moves_smoothly(pattern: list[str]) -> None:
    rig = armed()
    rig.send("one", GOAL, duration_s=1.5)
    for event in pattern:
        rig.tick(lose=event == "lose", driver_runs=event != "dead")
    expect_within_limits(rig)


def test_states_of_the_status_are_those_of_the_message() -> None:
    assert (TrajectoryStatus.STATE_ACCEPTED, TrajectoryStatus.STATE_REJECTED) == (ACCEPTED, REJECTED)


def in_slices() -> Rig:
    """An armed arm whose driver checks trajectories while it has nothing else to do."""
    rig = Rig()
    rig.driver = ArmDriver(HOAP3, checks_in_slices=True)
    rig.tick()
    rig.arm()
    assert rig.driver.state is State.ARMED
    return rig


def test_a_trajectory_that_is_checked_in_slices_begins_with_the_tick_after_its_check() -> None:
    rig = in_slices()
    rig.send("long", {"right_elbow": -60.0}, duration_s=60.0)
    rig.tick()
    assert rig.driver.check_on()
    rig.send("long", {"right_elbow": -60.0}, duration_s=60.0)  # once more: it is known
    rig.send("second", {"right_elbow": -60.0})
    rig.tick()
    assert [(one.trajectory_id, one.code) for one in rig.statuses] == [("second", "busy")]
    while rig.driver.check_on():
        pass
    assert rig.tick().stream is not None
    assert ("long", TrajectoryStatus.STATE_ACCEPTED) in [(one.trajectory_id, one.state) for one in rig.statuses]


def test_a_check_that_is_not_over_is_given_up_after_a_stop_or_when_it_takes_too_long() -> None:
    rig = in_slices()
    rig.send("slow", {"right_elbow": -60.0}, duration_s=60.0)
    for _ in range(60):
        rig.tick()
    assert [(one.trajectory_id, one.code) for one in rig.statuses] == [("slow", "stale")]
    rig.send("stopped", {"right_elbow": -60.0}, duration_s=60.0)
    rig.tick()
    rig.driver.on_stop(StopRequest(source="page"))
    rig.tick()
    rig.tick()
    assert rig.driver.state is State.HOLD
    assert (rig.statuses[-1].trajectory_id, rig.statuses[-1].code) == ("stopped", "not_armed")
    assert not rig.driver.check_on()


def test_a_movement_that_was_made_before_the_arm_was_armed_is_not_played() -> None:
    rig = Rig()
    rig.tick()
    made_ns = rig.now_ns
    rig.arm()
    rig.driver.on_trajectory(trajectory("early", {"right_elbow": -60.0}, 1.0), made_ns)
    rig.tick()
    assert [(one.trajectory_id, one.code) for one in rig.statuses] == [("early", "stale")]
