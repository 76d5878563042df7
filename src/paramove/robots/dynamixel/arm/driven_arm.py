"""A servo arm for the arm's driver node: messages in, messages out, the loop in a thread of its own between."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from functools import partial
from typing import Any, Self

import mujoco
import numpy as np

from paramove.bus import Topic, topics
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory
from paramove.msgs.motor_status_pb2 import MotorStatus
from paramove.msgs.safety_state_pb2 import ArmRequest, LinkState, SafetyState, StopRequest
from paramove.robots import RobotDescription
from paramove.robots.dynamixel.arm.servo_arm import ServoArm
from paramove.robots.dynamixel.arm.servo_checks import JointServo
from paramove.robots.dynamixel.arm.servo_loop import LoopSettings, ServoLoop
from paramove.robots.dynamixel.bus.servo_port import ServoPort
from paramove.robots.streaming import ArmDriver
from paramove.safety import SafetySettings, SelfCollision

FOLLOWING = float(np.deg2rad(10.0))
"""How far a joint may be from its commanded position: more means that somebody or something holds it."""
EMERGENCY_MS = 500.0
GATE_TIMEOUT_FACTOR = 1.5
"""Times the loop's timeout is the gate's, so that the loop, which knows the servos, first reports which has no data."""
SLOW_NS, MOTORS_NS = 1_000_000_000 // 15, 1_000_000_000


class DrivenArm:
    """An arm that is driven while this is a context.

    Args:
        description: Of an arm with servos; its units are those of this very arm.
        servos: In the order of its joints.
        port: Of its bus, closed.
        settings: How it is driven.

    Raises:
        InputError: On entering: the port is missing, forbidden or in use.

    Attributes:
        readable: A descriptor that can be read when `said` has something.
    """

    def __init__(
        self, description: RobotDescription, servos: tuple[JointServo, ...], port: ServoPort, settings: LoopSettings
    ) -> None:
        following = np.full(description.n_joints, FOLLOWING)
        following[list(description.gripper_indices)] = np.inf
        safety = SafetySettings(
            measured_timeout_ms=GATE_TIMEOUT_FACTOR * settings.timeouts.silent_s * 1e3,
            following=following,
            emergency_timeout_ms=EMERGENCY_MS if settings.stop_inputs.are_there else None,
        )
        self._caution, self._clock = settings.caution, port.clock
        d, model = description, mujoco.MjModel.from_xml_path(str(description.model_path))
        clearance = SelfCollision(model, d.joint_names, d.base_pose, d.soft_lower, d.soft_upper)
        self._driver = ArmDriver(
            d, safety, clearance, settings.why_no_program, settings.link_timeout_s, settings.checks_in_slices
        )
        self.readable, self._written = os.pipe2(os.O_NONBLOCK)
        self._loop = ServoLoop(self._driver, description, servos, port, settings, self._wake)
        self._slow_ns = self._safety_ns = self._motors_ns = 0
        self._published_state: SafetyState.State | None = None

    def __enter__(self) -> Self:
        self._loop.__enter__()
        return self

    def __exit__(self, *raised: Any) -> None:
        self._loop.__exit__(*raised)

    @property
    def detail(self) -> str:
        """The state of the arm, for people."""
        return self._driver.detail

    @property
    def trouble(self) -> str:
        """What is wrong: a lost port, servos without data, low voltage, a pressed emergency stop, servos that are not
        emulated though they should be; "" if nothing is.

        Raises:
            RuntimeError: The loop has failed; the servos rest by their own watchdog.
        """
        if self._loop.has_failed:
            raise RuntimeError("the arm's loop has failed, the lines above say why; its servos rest by their watchdog")
        loop = self._loop
        return (
            loop.lost
            or loop.arm.not_responding()
            or "; ".join(filter(None, (self._caution, loop.pressed, *loop.arm.warnings())))
        )

    def on_trajectory(self, message: JointTrajectory, captured_ns: int) -> None:
        """Take a trajectory; the loop accepts or rejects it within a period."""
        self._loop.hand_over(partial(self._driver.on_trajectory, message, captured_ns))

    def on_arm_request(self, message: ArmRequest, captured_ns: int) -> None:
        """Take an arming request, to arm or disarm."""
        self._loop.hand_over(partial(self._driver.on_arm_request, message, captured_ns))

    def on_link(self, message: LinkState, captured_ns: int) -> None:
        """Take that the other hosts reply; at once, whatever the loop is doing."""
        self._driver.on_link(message, captured_ns)

    def on_stop(self, message: StopRequest, resent: bool = False) -> None:
        """Take a person's stop: the stop ramp begins in the next period. `resent`: see `ArmDriver.on_stop`."""
        self._driver.on_stop(message, resent)
        self._loop.stop_waits()

    def check_on(self) -> bool:
        """Checks a waiting trajectory for some milliseconds while the loop goes on; returns whether there is more."""
        return self._driver.check_on()

    def run_to(self, time_ns: int) -> None:
        """Drive the arm up to a time, if it is an emulator's; else the arm is driven by itself.

        Raises:
            ClockLostError: The emulator has ended.
        """
        self._loop.run_to(time_ns)

    def said(self) -> Iterator[tuple[Topic, Any, int]]:
        """What is to be published since the last call: topic, message, and the time of its data, ns."""
        with contextlib.suppress(BlockingIOError):
            os.read(self.readable, 4096)
        output, now_ns = self._loop.take(), self._clock.now_ns
        states = [one.joint_states for one in output if one.joint_states is not None]
        yield from ((topics.ARM_JOINT_STATES_FAST, one, one.timestamp.ToNanoseconds()) for one in states)
        yield from ((topics.ARM_TRAJECTORY_STATUS, status, now_ns) for one in output for status in one.statuses)
        safety = output[-1].safety if output else None  # the driver itself may already be in its next tick
        due = now_ns - self._safety_ns >= SLOW_NS
        if safety is not None and (due or safety.state != self._published_state):
            self._published_state, self._safety_ns = safety.state, now_ns
            yield topics.ARM_SAFETY, safety, now_ns
        if states and now_ns - self._slow_ns >= SLOW_NS:
            self._slow_ns = now_ns
            yield topics.ARM_JOINT_STATES, states[-1], states[-1].timestamp.ToNanoseconds()
        if now_ns - self._motors_ns >= MOTORS_NS:
            self._motors_ns = now_ns
            yield topics.ARM_MOTORS, motor_status(self._loop.arm, now_ns), now_ns

    def _wake(self) -> None:
        with contextlib.suppress(BlockingIOError):  # a full pipe is readable already
            os.write(self._written, b".")


def motor_status(arm: ServoArm, now_ns: int) -> MotorStatus:
    """The state of the servos of an arm, and the age of their data."""
    message = MotorStatus(warnings=arm.warnings())
    message.captured.FromNanoseconds(now_ns)
    for servo in arm.servos:
        health = arm.health[servo.joint]
        motor = message.motors.add(joint=servo.joint, id=servo.number, model=servo.model.name)
        if health.answers is not None:
            motor.responding, motor.age_s = True, 1e-9 * (now_ns - health.answers.at_ns)
        motor.torque = bool(health.torque)
        motor.voltage_v, motor.temperature_c = health.voltage or 0.0, health.temperature or 0.0
        motor.hardware_error = health.hardware_error
    return message
