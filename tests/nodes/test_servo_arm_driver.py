"""The servo arm's driver on a real bus, with emulated servos: who stops it, and what is left of who commanded it."""

from __future__ import annotations

import contextlib
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dynamixel_emulator.emulator import DynamixelEmulator
from nodes import servo_arm_driver
from paramove.bus import topics
from paramove.bus.bus import Bus
from paramove.bus.inspection import BusVisitor
from paramove.bus.publisher import Publisher
from paramove.bus.settings import BusSettings
from paramove.msgs.joint_trajectory_pb2 import TrajectoryStatus
from paramove.msgs.safety_state_pb2 import ArmRequest, SafetyState, StopRequest
from paramove.operator.terminal import request_arming, stop_arms
from paramove.robots.description import RobotDescription
from sim.emulated_arm import emulated_servos

FOLDER = Path("robot_description/open_manipulator_x")
ROBOT = RobotDescription.load(FOLDER)
PATIENT_S = 120.0
TIMEOUTS = {"silent_s": 2.0, "watchdog_s": 2.54, "read_s": 0.4}
SUBSCRIBES = (topics.ARM_SAFETY, topics.ARM_TRAJECTORY_STATUS, topics.ARM_JOINT_STATES_FAST)
MOVE = """
import sys
from pathlib import Path
from paramove.bus import topics
from paramove.bus.bus import Bus
from paramove.bus.settings import BusSettings
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory
from tests.nodes.test_servo_arm_driver import there, ROBOT
with Bus("mover", BusSettings(folder=Path(sys.argv[1])), (), (topics.ARM_TRAJECTORY,)) as bus:
    message = JointTrajectory(id=sys.argv[2], joints=ROBOT.joint_names)
    for time_s, angles in ((0.0, ROBOT.base_pose), (1.5, there())):
        message.points.add(time_s=time_s, position_rad=angles.tolist())
    for event in bus.events(tick=True):
        bus.publish(topics.ARM_TRAJECTORY, message)
"""
"""A program that commands a movement, again and again until it is ended."""


def there() -> np.ndarray:
    target = ROBOT.base_pose.copy()
    target[0] += 0.5
    return target


class Run:
    """A driver that runs, and what it has said."""

    def __init__(self, folder: Path, emulator: DynamixelEmulator, bus: Bus) -> None:
        self.folder, self.emulator = folder, emulator
        self.safety, self.angles = SafetyState(), None
        self.statuses: list[TrajectoryStatus] = []
        self._events = bus.events(*SUBSCRIBES, tick=True)

    def hears_until(self, what) -> None:
        until_s = time.monotonic() + PATIENT_S
        while not what():
            assert time.monotonic() < until_s, (self.safety, self.statuses[-1:])
            self.hears_once()

    def hears_once(self) -> None:
        event = next(self._events)
        if getattr(event, "topic", None) is topics.ARM_SAFETY:
            self.safety = event.message
        elif getattr(event, "topic", None) is topics.ARM_TRAJECTORY_STATUS:
            self.statuses.append(event.message)
        elif hasattr(event, "topic"):
            self.angles = np.array([joint.position for joint in event.message.joints])

    def waits_for(self, state: str) -> None:
        self.hears_until(lambda: self.safety.state == getattr(SafetyState, f"STATE_{state}"))

    @contextlib.contextmanager
    def moved_by_a_program(self, name: str):
        """While this is a context, another process commands a movement, which is under way."""
        with subprocess.Popen([sys.executable, "-c", MOVE, str(self.folder), name], cwd=FOLDER.parents[1]) as program:
            try:
                self.hears_until(lambda: self.angles is not None and self.angles[0] > ROBOT.base_pose[0] + 0.05)
                yield program
            finally:
                program.kill()

    def goals(self) -> list[int]:
        with self.emulator.lock:
            return [servo.memory["Goal Position"] for servo in self.emulator.bus.servos]


@pytest.fixture
def run():
    """A driver in a thread of its own, armed from a terminal; other programs may keep the emulator waiting."""
    with tempfile.TemporaryDirectory(prefix="arm-") as name, contextlib.ExitStack() as opened:
        folder, link = Path(name), Path(name) / "usb-emulated_0001-if00-port0"
        emulator = opened.enter_context(DynamixelEmulator(emulated_servos(ROBOT), link))
        config = servo_arm_driver.Config(robot=FOLDER, port=link, timeouts=TIMEOUTS)
        made: list[Bus] = []

        def drive() -> None:
            with Bus(
                "driver", BusSettings(folder=folder), servo_arm_driver.SUBSCRIBES, servo_arm_driver.PUBLISHES
            ) as bus:
                made.append(bus)
                servo_arm_driver.run(bus, config)

        thread = threading.Thread(target=drive)
        thread.start()
        with Bus("test", BusSettings(folder=folder), SUBSCRIBES) as bus:
            run = Run(folder, emulator, bus)
            try:
                run.waits_for("DISARMED")
                assert request_arming(folder, True, PATIENT_S).state == SafetyState.STATE_ARMED
                yield run
            finally:
                made[0].stop()
                thread.join()


def pressed_on(name: str):
    """Whoever says one of the topics: the live page, or a program that watches a button."""

    def press(run: Run) -> str:
        topic = topics.by_name(name)
        with Bus("button", BusSettings(folder=run.folder), (), (topic,)) as bus:
            for _ in bus.events(tick=True):
                if run.safety.faults:
                    break
                bus.publish(topic, StopRequest(source="button"))
                run.hears_once()
        return "stopped from the button by a person"

    return press


def pressed_at_a_terminal(run: Run) -> str:
    assert stop_arms(run.folder, "terminal", PATIENT_S)[""] is not None
    return "stopped from the terminal by a person"


@pytest.mark.parametrize(
    "press",
    [pressed_on("operator/estop"), pressed_at_a_terminal],
    ids=["estop", "terminal"],
)
def test_a_stop_by_a_topic_is_latched_and_its_source_may_end(run: Run, press) -> None:
    with run.moved_by_a_program("one"):
        detail = press(run)
        run.waits_for("HOLD")  # who pressed is gone, the program still asks
        assert [(fault.code, fault.detail) for fault in run.safety.faults] == [("person_stop", detail)]
        stopped = [one for one in run.statuses if one.state == TrajectoryStatus.STATE_STOPPED]
        assert stopped[0].reason == detail
        rested = run.goals()
        assert rested != list(ROBOT.units.to_counts(there()))
        said = len(run.statuses)
        run.hears_until(lambda: len(run.statuses) > said + 5)
        assert run.goals() == rested
        assert run.safety.state == SafetyState.STATE_HOLD
    while (found := request_arming(run.folder, True, PATIENT_S)).state != SafetyState.STATE_ARMED:
        assert {fault.code for fault in found.faults} <= {"arming_slow", "arming_stale"}  # a busy machine
    assert run.goals() == rested


@pytest.mark.parametrize("name", ["operator/stop", "operator/estop", "operator/stop_away"])
@pytest.mark.parametrize("ahead_s", [-10_000, 10_000, 9_000_000_000])
def test_a_stop_and_a_request_to_disarm_count_whatever_clock_their_sender_has(
    run: Run, name: str, ahead_s: int
) -> None:
    """In a container, in a time namespace, on another host; each is published once."""
    topic = topics.by_name(name)
    with BusVisitor(run.folder, "button") as visitor:
        stamped(visitor.publisher(topic), StopRequest(source="button"), ahead_s)
        run.waits_for("HOLD")
    assert [fault.code for fault in run.safety.faults] == ["person_stop"]
    with BusVisitor(run.folder, "terminal") as visitor:
        stamped(visitor.publisher(topics.OPERATOR_ARM), ArmRequest(source="terminal", armed=False), ahead_s)
        run.waits_for("DISARMED")


def stamped(publisher: Publisher, message: Any, ahead_s: int) -> None:
    """Publishes it once somebody has subscribed, with the times of another clock."""
    until_s = time.monotonic() + PATIENT_S
    while not publisher.subscriptions:
        publisher.serve()
        assert time.monotonic() < until_s
    there_ns = time.monotonic_ns() + ahead_s * 1_000_000_000
    message.captured.seconds = there_ns // 1_000_000_000
    publisher.publish(message, there_ns, there_ns)


def test_a_movement_of_a_program_that_is_killed_is_played_to_its_end_and_nothing_after_it(run: Run) -> None:
    """It was judged whole, and ends at rest."""
    with run.moved_by_a_program("of a program"):
        pass
    run.hears_until(lambda: any(one.state == TrajectoryStatus.STATE_SUCCEEDED for one in run.statuses))
    assert {one.trajectory_id for one in run.statuses} == {"of a program"}
    assert run.goals() == list(ROBOT.units.to_counts(there()))
    before = len(run.statuses)
    packets = run.emulator.bus.checker.packets
    run.hears_until(lambda: run.emulator.bus.checker.packets > packets + 50)
    assert len(run.statuses) == before
    assert run.goals() == list(ROBOT.units.to_counts(there()))
