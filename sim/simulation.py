"""One run of the simulated world: what comes in from the bus, what happens in a camera period, what it shows."""

from __future__ import annotations

import logging
import time
from pathlib import Path
from typing import BinaryIO

import numpy as np
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from paramove.bus import Received, topics
from paramove.documents import Floats, Image
from paramove.msgs.hoap3_wire_pb2 import Hoap3State
from paramove.robots import RobotDescription
from paramove.robots.hoap3 import Firmware, receive, state_message
from paramove.robots.streaming import StreamReader
from sim import looks, scene
from sim.camera import Eye, Sensor
from sim.instructor import Instructor
from sim.looks import Looks
from sim.tool_box import NOMINAL, Measures
from sim.world import World

_log = logging.getLogger(__name__)

CAMERA_HZ = 15


def step_of_tick(tick: int) -> int:
    """Physics steps from the start to a tick of 1/15 s: 67, 67, 66 ms in turn."""
    return -(-1000 * tick // CAMERA_HZ)


class Simulation:
    """The robot with its firmware and stream, the world, the instructor and the camera.

    Args:
        seed: Of everything random.
        description: Of the robot.
        camera: Whether the camera's images are rendered.
        video: Whether the view for people is rendered.
        firmware_log: Gets every frame that the firmware plays, 28 little-endian int16 a millisecond.
        measures: Of the tool box and of the nominal camera.

    Attributes:
        physics_s, rendering_s: Wall time spent since the start.
    """

    def __init__(
        self,
        seed: int,
        description: RobotDescription,
        camera: bool = True,
        video: bool = False,
        firmware_log: BinaryIO | None = None,
        measures: Measures = NOMINAL,
    ) -> None:
        self._firmware_log = firmware_log
        draws = looks.streams(seed)
        self.looks = Looks.draw(seed, measures)
        self.world = self._new_world(description)
        self.firmware = Firmware(description)
        self.firmware.reset(description.base_pose)
        self.stream = StreamReader(description, description.units.to_counts(description.base_pose))
        self.instructor = self._new_instructor(draws)
        self.description = description
        self._eye = Eye(self.world.model, *scene.RENDERED_PX) if camera else None
        self._view = Eye(self.world.model, *scene.VIEW_PX) if video else None
        self._sensor = Sensor(self.looks.camera, self.looks.pixel_noise, draws["noise"])
        self.physics_s = 0.0
        self.rendering_s = 0.0

    def _new_world(self, description: RobotDescription) -> World:
        return World(self.looks, description)

    def _new_instructor(self, draws: dict[str, np.random.Generator]) -> Instructor:
        return Instructor(self.world, self.looks.rules, draws)

    @property
    def now_ns(self) -> int:
        """Simulated time since the start."""
        return self.world.steps * 1_000_000

    @property
    def tick(self) -> int:
        """Number of the latest tick of 1/15 s."""
        return self.world.steps * CAMERA_HZ // 1000

    @property
    def world_from_table(self) -> Floats | None:
        """Pose [4, 4] of the table frame of a tracked arm; None where there is none."""
        return None

    def write_measures(self, folder: Path) -> None:
        """Writes what people measure before the run: nothing in this world."""

    def handle(self, received: Received) -> None:
        """Handle a message of the stream or of the robot's speech."""
        if received.topic is topics.WIRE_HOAP3_STREAM:
            receive(received.message, self.stream)
        elif received.topic is topics.SPEECH:
            self.instructor.handle(received.message.request, received.message.object)

    def run_to_tick(self, tick: int) -> None:
        """Let the world run up to a tick; raises SimulationError."""
        started = time.perf_counter()
        world, firmware, stream, instructor = self.world, self.firmware, self.stream, self.instructor
        played = []
        while world.steps < step_of_tick(tick):
            frame = stream.play()
            played.append(frame)
            torques = firmware.step(frame, world.joint_positions(), world.joint_velocities())
            instructor.advance(0.001)
            world.step(torques)
        if self._firmware_log is not None:
            try:
                self._firmware_log.write(np.array(played, dtype="<i2").tobytes())
            except OSError as error:  # a full disk ends no run
                _log.warning("the log of the firmware ends: %s", error.strerror)
                self._firmware_log = None
        self.physics_s += time.perf_counter() - started

    def image_raw(self) -> RawImage | None:
        """The camera's image now; None without a camera."""
        if self._eye is None:
            return None
        started = time.perf_counter()
        image = self._sensor.expose(self._eye.look(self.world.data, "camera"))
        message = self._raw(image, "camera_optical")
        self.rendering_s += time.perf_counter() - started
        return message

    def view(self) -> RawImage | None:
        """The view for people; None without video."""
        if self._view is None:
            return None
        started = time.perf_counter()
        message = self._raw(self._view.look(self.world.data, "view"), "view")
        self.rendering_s += time.perf_counter() - started
        return message

    def robot_state(self) -> Hoap3State:
        """What the robot reports: its stream and its measured joints."""
        units = self.description.units
        counts = (units.zero_counts + units.counts_per_rad * self.world.joint_positions()).round().astype("int16")
        return state_message(self.stream.state(counts, self.now_ns))

    def close(self) -> None:
        """Gives the graphics contexts back."""
        for eye in (self._eye, self._view):
            if eye is not None:
                eye.close()

    def _raw(self, image: Image, frame: str) -> RawImage:
        height, width = image.shape[:2]
        message = RawImage(
            frame_id=frame, width=width, height=height, encoding="rgb8", step=3 * width, data=image.tobytes()
        )
        message.timestamp.FromNanoseconds(self.now_ns)
        return message
