"""What an arm's driver does with each message that commands the arm, whichever arm it is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from paramove.bus import Received, Topic, topics
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory
from paramove.msgs.safety_state_pb2 import ArmRequest, LinkState, StopRequest


class CommandedArm(Protocol):
    """An arm that takes commands: `ArmDriver`, or a servo arm with its loop. See there."""

    def on_trajectory(self, message: JointTrajectory, captured_ns: int) -> None:
        """Takes a trajectory, which is checked as a whole before its first row moves the arm."""

    def on_arm_request(self, message: ArmRequest, captured_ns: int) -> None:
        """Takes a request to arm or to disarm."""

    def on_link(self, message: LinkState, captured_ns: int) -> None:
        """Takes that the other hosts reply."""

    def on_stop(self, message: StopRequest, resent: bool = False) -> None:
        """Takes a person's stop; `resent`: it was published before the arm's driver had subscribed."""


def command_handlers(arm: CommandedArm) -> dict[Topic, Callable[[Received], None]]:
    """By topic, what gives a message of it to the arm. A stop goes without its time, for it has no age."""
    handlers: dict[Topic, Callable[[Received], None]] = {
        topics.ARM_TRAJECTORY: lambda received: arm.on_trajectory(received.message, received.captured_ns),
        topics.HOSTS_LINK: lambda received: arm.on_link(received.message, received.captured_ns),
    }
    for topic in topics.ARMINGS:
        handlers[topic] = lambda received: arm.on_arm_request(received.message, received.captured_ns)
    for topic in topics.STOPS:
        handlers[topic] = lambda received: arm.on_stop(received.message, received.resent)
    return handlers
