"""One run of a simulated world: what comes in from the bus, what happens in a camera period, what it shows."""

from __future__ import annotations

import contextlib
import logging
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol

import mujoco

from paramove.bus import Received, Topic, topics
from paramove.documents import Floats
from paramove.msgs.truth_pb2 import TruthLayout
from sim import truth
from sim.arm import ELBOW, SHOULDER, TIP, WRIST
from sim.camera import ImageSource
from sim.human import place_arm
from sim.looks import Looks
from sim.person import Person
from sim.world import World

_log = logging.getLogger(__name__)

CAMERA_HZ = 15
ARM_PREFIX = "instructor_"
"""Of the bodies of a person's arm in the model."""


def step_of_tick(tick: int) -> int:
    """Physics steps from the start to a tick of 1/15 s: 67, 67, 66 ms in turn."""
    return -(-1000 * tick // CAMERA_HZ)


class Simulated(Protocol):
    """What the simulator runs: a `Simulation`, or a world that is only filmed."""

    @property
    def now_ns(self) -> int:
        """Simulated time since the start."""

    @property
    def finished(self) -> bool:
        """Whether nothing more will happen."""

    def write_measures(self, folder: Path) -> None:
        """Writes what people measure before the run."""

    def layout(self) -> TruthLayout | None:
        """What does not change in a run; None: nothing."""

    def handle(self, received: Received) -> None:
        """Handles a message of the bus."""

    def run_to_tick(self, tick: int) -> None:
        """Lets the world run up to a tick; raises SimulationError."""

    def messages(self) -> Iterator[tuple[Topic, Any]]:
        """Everything that the world shows now."""

    def detail(self, wall_s: float) -> str:
        """One line about the run, `wall_s` after its start."""

    def close(self) -> None:
        """Gives the graphics contexts back."""


class SimulatedRobot(Protocol):
    """What moves a robot's motors in a world."""

    def connect(self, world: World, step: Callable[[], None]) -> threading.Lock | None:
        """Begins to move in a world that advances by `step`; if by itself, in real time, under the lock returned."""

    def handle(self, received: Received) -> None:
        """Handles a message of the bus."""

    def run_to(self, world: World, steps: int, step: Callable[[], None]) -> None:
        """Lets the world run up to so many steps."""

    def messages(self, world: World, now_ns: int) -> Iterator[tuple[Topic, Any]]:
        """What it reports on the bus."""

    def commanded_gripper(self) -> Floats | None:
        """Gripper as commanded, [3], frame of the tool box's measures, m; None if it is unknown."""

    def close(self) -> None:
        """Disconnects."""


class Simulation:
    """A world of physics with a robot, a person and cameras in it.

    Args:
        looks: How the world looks, and who belongs where.
        world: Its physics.
        robot: What moves the robot's motors.
        person: Who acts in it.
        cameras: What gives images of it.
        world_from_table: Pose [4, 4] of the frame in which a tracked arm is measured.
        write_measures: Writes what people measure before the run into a folder.

    Attributes:
        physics_s, rendering_s: Wall time spent since the start.
    """

    finished = False

    def __init__(
        self,
        looks: Looks,
        world: World,
        robot: SimulatedRobot,
        person: Person,
        cameras: Sequence[ImageSource] = (),
        world_from_table: Floats | None = None,
        write_measures: Callable[[Path], None] = lambda _: None,
    ) -> None:
        self.looks, self.world, self.robot, self.person = looks, world, robot, person
        self._cameras = cameras
        self.world_from_table = world_from_table
        self.write_measures = write_measures
        self.physics_s = self.rendering_s = 0.0
        lock = robot.connect(world, self._step)
        self._lock = lock or contextlib.nullcontext()
        self._copy = None if lock is None else mujoco.MjData(world.model)  # rendered while the world runs on

    @property
    def now_ns(self) -> int:
        """Simulated time since the start, or monotonic time of a world that runs by itself."""
        return self.world.steps * 1_000_000 if self._copy is None else time.monotonic_ns()

    @property
    def tick(self) -> int:
        """Number of the latest tick of 1/15 s."""
        return self.world.steps * CAMERA_HZ // 1000

    def layout(self) -> TruthLayout:
        """What does not change in a run."""
        return truth.layout(self.looks, self.world, self.world_from_table)

    def handle(self, received: Received) -> None:
        """Handle a message of the stream or of the robot's speech."""
        with self._lock:
            self.robot.handle(received)
            if received.topic is topics.SPEECH:
                self.person.handle(received.message.request, received.message.object)

    def run_to_tick(self, tick: int) -> None:
        """Let the world run up to a tick; raises SimulationError."""
        started = time.perf_counter()
        self.robot.run_to(self.world, step_of_tick(tick), self._step)
        self.physics_s += time.perf_counter() - started

    def _step(self) -> None:
        self.person.advance(0.001)
        self.world.step()

    def messages(self) -> Iterator[tuple[Topic, Any]]:
        """Everything that the world shows now. A state that is not finite never gets here: the step raises."""
        started = time.perf_counter()
        world, person, data = self.world, self.person, self.world.data
        with self._lock:
            now_ns, tick = self.now_ns, self.tick
            if person.arm is not None:
                self._show_arm(person.arm.posture)
            others = [
                *self.robot.messages(world, now_ns),
                (topics.TRUTH_STATE, truth.state(now_ns, world, self.robot, person)),
            ]
            if person.arm is not None:
                others.append((topics.TRUTH_ARM, truth.arm(now_ns, person.arm)))
            if self._copy is not None:
                mujoco.mj_copyData(self._copy, world.model, data)
                data = self._copy
        images = [image for camera in self._cameras for image in camera.images(data, tick, now_ns)]
        self.rendering_s += time.perf_counter() - started
        yield from images
        yield from others

    def shown(self) -> dict[Topic, Any]:
        """The same by topic."""
        return dict(self.messages())

    def detail(self, wall_s: float) -> str:
        """One line about the run, `wall_s` after its start."""
        time_s = max(self.world.time_s, 1e-9)
        percent = 100 / max(wall_s, 1e-9)
        return (
            f"{time_s:.0f} s simulated, {time_s / max(wall_s, 1e-9):.2f} times real time "
            f"(physics {self.physics_s * percent:.0f} %, rendering {self.rendering_s * percent:.0f} %); "
            f"instructor {self.person.doing}"
        )

    def close(self) -> None:
        """Gives the graphics contexts back, and logs contacts that should not have been."""
        self.robot.close()
        for camera in self._cameras:
            camera.close()
        pairs = self.world.contacts.unwanted_pairs
        if pairs:
            named = ", ".join(f"{name} ({count})" for name, count in sorted(pairs.items()))
            _log.warning("unwanted contacts: %s", named)

    def _show_arm(self, posture: Floats) -> None:
        """Brings the rendered arm into a posture (4, 3), shoulder frame."""
        model, data = self.world.model, self.world.data
        points = posture + self.world.world_from_shoulder
        place_arm(model, data, points[[SHOULDER, ELBOW, TIP]].ravel(), points[WRIST], ARM_PREFIX)
        mujoco.mj_kinematics(model, data)
