"""The arm driver's and the operator's nodes on a bus that joins them to a robot without physics."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from nodes import arm_driver, operator
from paramove.bus import topics
from paramove.bus.settings import BusSettings
from paramove.bus.subscriber import Received
from paramove.bus.ticks import Tick
from paramove.bus.topics import Topic
from paramove.msgs.joint_trajectory_pb2 import TrajectoryStatus
from paramove.msgs.safety_state_pb2 import SafetyState
from paramove.operator.arming_at_start import Operator
from paramove.robots.hoap3.wire import receive, state_message
from tests.robots.streaming.fake_robot import TICK_NS, FakeRobot, trajectory

WORKSPACE = Path(__file__).parents[3]


class RobotBus:
    """Runs 60 ticks; the robot answers at once, the operator by the next tick; a trajectory comes at tick 10.

    Nothing here is launched, so the operator's request is taken only as a person's.
    """

    node, run_folder = "arm_driver", Path()

    def __init__(self, by_person: bool) -> None:
        self.settings = BusSettings(folder=Path("no_bus"))
        self.by_person = by_person
        self.now_ns = 0
        self.robot = FakeRobot()
        self.operator = Operator(arms_at_start=True)
        self.pending: list[tuple[Topic, Any]] = []
        self.published: list[tuple[Topic, Any]] = []

    def ready(self, detail: str) -> None:
        assert detail

    def when_idle(self, work: Callable[[], bool]) -> None:
        self.work = work

    def publish(self, topic: Topic, message: Any, captured_ns: int | None = None) -> None:
        assert topic in arm_driver.PUBLISHES
        assert isinstance(message, topic.type)
        self.published.append((topic, message))
        if topic is topics.WIRE_HOAP3_STREAM:
            assert receive(message, self.robot.reader), self.robot.reader.rejection
        if topic is topics.ARM_SAFETY and (word := self.operator.update(message, self.now_ns)):
            word.by_person = self.by_person
            self.pending.append((topics.OPERATOR_ARM_AT_START, word))

    def events(self, *wanted: Topic, tick: bool) -> Iterator[Received | Tick]:
        assert wanted == arm_driver.SUBSCRIBES
        assert tick
        for number in range(1, 61):
            self.now_ns = number * TICK_NS
            if number == 10:
                self.pending.append((topics.ARM_TRAJECTORY, trajectory("one", {"right_elbow": -60.0}, 1.0)))
            self.pending.append((topics.WIRE_HOAP3_STATE, state_message(self.robot.state(self.now_ns))))
            heard, self.pending = self.pending, []
            for topic, message in heard:
                yield Received(topic, message, self.now_ns, self.now_ns, number)
            while self.work():
                pass
            yield Tick(number, self.now_ns)
            self.robot.play()


def test_operator_arms_and_the_driver_plays_a_trajectory(monkeypatch: Any) -> None:
    monkeypatch.chdir(WORKSPACE)
    bus = RobotBus(by_person=True)
    arm_driver.run(bus, arm_driver.Config())
    statuses = [message for topic, message in bus.published if topic is topics.ARM_TRAJECTORY_STATUS]
    assert statuses[0].state == TrajectoryStatus.STATE_ACCEPTED
    assert statuses[-1].state == TrajectoryStatus.STATE_SUCCEEDED
    assert sum(topic is topics.ARM_SAFETY for topic, _ in bus.published) == 60
    assert sum(topic is topics.ARM_JOINT_STATES for topic, _ in bus.published) == 60


def test_a_driver_started_by_hand_takes_no_program_for_a_person(monkeypatch: Any) -> None:
    monkeypatch.chdir(WORKSPACE)
    bus = RobotBus(by_person=False)
    arm_driver.run(bus, arm_driver.Config())
    states = [message for topic, message in bus.published if topic is topics.ARM_SAFETY]
    assert {state.state for state in states} == {SafetyState.STATE_DISARMED}
    assert [fault.code for fault in states[-1].faults] == ["arming_program"]
    assert "operator node is a program" in states[-1].faults[0].detail
    assert "started by hand" in states[-1].faults[0].detail


def test_with_a_real_robot_the_operator_refuses_to_start(tmp_path: Path) -> None:
    config = tmp_path / "operator.yaml"
    config.write_text(
        f"node: operator\nbus: {{folder: {tmp_path}/bus, clock: monotonic}}\nparameters: {{real: true}}\n",
        encoding="utf-8",
    )
    done = subprocess.run(
        [sys.executable, "-m", "nodes.operator", "--config", str(config)],
        cwd=WORKSPACE,
        env=os.environ,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 78, done.stderr
    assert "a person must" in done.stderr
    assert operator.PUBLISHES == (topics.OPERATOR_ARM_AT_START,)
