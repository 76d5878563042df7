"""HOAP-3's control as it is in the world: the stream that a driver fills, and the firmware that plays it."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterator
from typing import Any, BinaryIO

import numpy as np

from paramove.bus import Received, Topic, topics
from paramove.documents import Floats
from paramove.msgs.hoap3_wire_pb2 import Hoap3State
from paramove.robots import RobotDescription
from paramove.robots.hoap3 import Firmware, receive, state_message
from paramove.robots.streaming import StreamReader
from sim.world import World

_log = logging.getLogger(__name__)


class Hoap3:
    """In its base pose at first.

    Args:
        description: Of the robot.
        log: Gets every frame that the firmware plays, 28 little-endian int16 a millisecond.
    """

    def __init__(self, description: RobotDescription, log: BinaryIO | None = None) -> None:
        self.description = description
        self.stream = StreamReader(description, description.units.to_counts(description.base_pose))
        self._firmware = Firmware(description)
        self._firmware.reset(description.base_pose)
        self._log = log
        self._played: list[np.ndarray] = []

    def handle(self, received: Received) -> None:
        """What came over the wire."""
        if received.topic is topics.WIRE_HOAP3_STREAM:
            receive(received.message, self.stream)

    def run_to(self, world: World, steps: int, step: Callable[[], None]) -> None:
        """Lets a world run up to so many steps, each by `step`."""
        while world.steps < steps:
            world.apply(self.torques(world.joint_positions(), world.joint_velocities()))
            step()
        self.write_log()

    def messages(self, world: World, now_ns: int) -> Iterator[tuple[Topic, Any]]:
        """What the robot reports."""
        yield topics.WIRE_HOAP3_STATE, self.state(world.joint_positions(), now_ns)

    def connect(self, world: World, step: Callable[[], None]) -> threading.Lock | None:
        """It moves by torques."""
        return None

    def close(self) -> None:
        """Nothing is open."""

    def torques(self, positions: Floats, velocities: Floats) -> Floats:
        """Of the motors, [J], N m, in the next millisecond; joints in rad and rad/s."""
        frame = self.stream.play()
        self._played.append(frame)
        return self._firmware.step(frame, positions, velocities)

    def write_log(self) -> None:
        """Appends what was played since the last call."""
        if self._log is not None:
            try:
                self._log.write(np.array(self._played, dtype="<i2").tobytes())
            except OSError as error:  # a full disk ends no run
                _log.warning("the log of the firmware ends: %s", error.strerror)
                self._log = None
        self._played.clear()

    def state(self, positions: Floats, now_ns: int) -> Hoap3State:
        """What the robot reports: its stream and its measured joints."""
        units = self.description.units
        counts = (units.zero_counts + units.counts_per_rad * positions).round().astype("int16")
        return state_message(self.stream.state(counts, now_ns))

    def commanded_gripper(self) -> Floats:
        """Gripper of the frame that the firmware plays, by forward kinematics, [3], shoulder frame, m."""
        arm = self.description.arms["right"]
        angles = self.description.units.to_radians(self.stream.target)[arm.indices]
        return np.asarray(arm.kinematics.forward(angles).gripper)
