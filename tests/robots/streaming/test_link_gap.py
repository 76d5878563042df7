"""The link between driver and robot stands still for half a second, as Wi-Fi does: it stops, and does not resume."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from paramove.msgs.joint_trajectory_pb2 import TrajectoryStatus
from paramove.robots.streaming.driver import DriverOutput
from paramove.robots.streaming.stream import StreamBatch
from paramove.safety.gate_io import State
from tests.robots.hoap3.movements import HOAP3
from tests.robots.streaming.fake_robot import TICK_NS, Rig
from tests.robots.streaming.test_driver import GOAL, expect_within_limits
from tests.robots.streaming.test_driver_failures import from_where_it_is

GAP_NS = 500_000_000
BEGINS = 15
"""Ticks after which the link stands still."""


class Link:
    """One direction of the link: what is said while it stands still arrives, in order, when it goes on."""

    def __init__(self, stands_still: bool) -> None:
        self.stands_still = stands_still
        self.open_ns = 0
        self._waiting: list[Any] = []

    def closes(self, until_ns: int) -> None:
        if self.stands_still:
            self.open_ns = until_ns

    def carry(self, message: Any, now_ns: int) -> list[Any]:
        """What arrives now."""
        self._waiting.append(message)
        if now_ns < self.open_ns:
            return []
        arrived, self._waiting = self._waiting, []
        return arrived


class LinkedRig(Rig):
    """A driver and a robot with a link between them."""

    def __init__(self, to_robot: bool, to_driver: bool) -> None:
        super().__init__()
        self.to_robot, self.to_driver = Link(to_robot), Link(to_driver)

    def tick(self, *, lose: bool = False, driver_runs: bool = True) -> DriverOutput | None:
        self.now_ns += TICK_NS
        for captured_ns, state in self.to_driver.carry((self.now_ns, self.robot.state(self.now_ns)), self.now_ns):
            self.driver.on_robot_state(state, captured_ns)
        self.output = self.driver.tick(self.now_ns)
        self.statuses += self.output.statuses
        said: StreamBatch | None = self.output.stream
        for batch in self.to_robot.carry(said, self.now_ns):
            if batch is not None:
                self.robot.reader.offer(batch)
        self.robot.play()
        return self.output


@pytest.mark.parametrize(
    ("to_robot", "to_driver", "code", "detail"),
    [
        (True, False, "stream_under_run", "the robot ran out of rows after "),
        (True, True, "robot_silent", "no data from the robot for 533 ms, allowed 500 ms"),
        (
            False,
            True,
            "robot_silent",
            "no data from the robot for 533 ms, allowed 500 ms",
        ),
    ],
    ids=["to the robot", "both ways", "to the driver"],
)
def test_half_a_second_without_the_link_is_a_stop_that_only_a_new_arm_word_ends(
    to_robot: bool, to_driver: bool, code: str, detail: str
) -> None:
    rig = LinkedRig(to_robot, to_driver)
    rig.tick()
    rig.arm()
    rig.send("one", GOAL, duration_s=3.0)
    for _ in range(BEGINS):
        rig.tick()
    assert not rig.robot.reader.at_rest
    for link in (rig.to_robot, rig.to_driver):
        link.closes(rig.now_ns + TICK_NS + GAP_NS)
    faults = []
    for _ in range(24):
        output = rig.tick()
        assert output is not None
        faults += [(fault.code, fault.detail) for fault in output.safety.faults]
    assert rig.robot.reader.at_rest
    assert faults[0][0] == code
    assert faults[0][1].startswith(detail)
    assert "arm again" in faults[0][1]
    assert rig.statuses[-1].state == TrajectoryStatus.STATE_STOPPED
    assert rig.statuses[-1].reason.startswith(detail)
    assert rig.driver.state in (State.HOLD, State.DISARMED)
    expect_within_limits(rig)
    resting = rig.robot.reader.target.copy()
    assert (resting != HOAP3.units.to_counts(HOAP3.base_pose)).any()
    rig.driver.on_trajectory(from_where_it_is(rig, "early"), rig.now_ns)
    for _ in range(20):
        rig.tick()
    assert rig.statuses[-1].code == "not_armed"
    np.testing.assert_array_equal(rig.robot.reader.target, resting)
    rig.arm()
    assert rig.driver.state is State.ARMED
    rig.driver.on_trajectory(from_where_it_is(rig, "home"), rig.now_ns)
    rig.run_until_rest()
    assert rig.statuses[-1].state == TrajectoryStatus.STATE_SUCCEEDED
    np.testing.assert_array_equal(rig.robot.reader.target, HOAP3.units.to_counts(HOAP3.base_pose))
    expect_within_limits(rig)
