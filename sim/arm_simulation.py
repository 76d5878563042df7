"""One run of the simulated world whose instructor is a whole arm, with calibrated cameras."""

from __future__ import annotations

import time
from pathlib import Path
from typing import BinaryIO

import mujoco
import numpy as np
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from paramove.cameras import write_cameras
from paramove.documents import Floats
from paramove.msgs.truth_pb2 import TruthArm
from paramove.robots import RobotDescription
from sim import scene
from sim.arm_cameras import ArmCameras, add_arm_cameras, calibrated, draw_arm_cameras
from sim.arm_instructor import ELBOW, SHOULDER, TIP, WRIST, ArmInstructor
from sim.human import PersonLook, add_arm, add_cloth, place_arm
from sim.performances_scene import PATTERNS, colour
from sim.simulation import Simulation
from sim.small_person import SmallPerson, shoulder_from_table, table_from_shoulder, turn_of_table
from sim.tool_box import NOMINAL, Measures
from sim.world import World

SEED_SPACE = 4200
PERSON, POINTING, LOOK, CAMERAS, NOISE, CALIBRATION = range(6)
VIEW = ((0.50, 0.62, 0.40), (0.12, -0.10, 0.0))
"""The view for people, from the robot's left: from its right the arm would be in the way. World, m."""
PREFIX = "instructor_"
NOISE_RANGE = (2.0, 6.0)  # standard deviation of 255


class ArmSimulation(Simulation):
    """See `Simulation`. What the arm adds draws from generators of its own, so the rest of the world is as without it.

    Attributes:
        person: The instructor.
        cameras: Of the arm, as they really are, in the table frame.
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
        self._seed = seed
        self.person = SmallPerson(self._stream(PERSON))
        self.cameras = draw_arm_cameras(self._stream(CAMERAS))
        super().__init__(seed, description, camera, video, firmware_log, measures)
        noise = self._stream(NOISE)
        level = float(noise.uniform(*NOISE_RANGE))
        self._arm_cameras = ArmCameras(self.world.model, self.cameras, level, noise) if camera else None

    @property
    def world_from_table(self) -> Floats:
        """Pose [4, 4] of the table frame, in which cameras and person are measured."""
        pose = np.eye(4)
        pose[:3, :3] = turn_of_table()
        pose[:3, 3] = shoulder_from_table(np.zeros(3)) + self.world.world_from_shoulder
        return pose

    def write_measures(self, folder: Path) -> None:
        """What people measure beforehand: `cameras.yaml`, with the errors of a calibration, and `person.yaml`."""
        write_cameras(folder / "cameras.yaml", calibrated(self.cameras, self._stream(CALIBRATION)))
        self.person.write_measures(folder / "person.yaml")

    def image_raw(self) -> RawImage | None:
        """The image of the robot's camera; the arm is brought into its present posture first."""
        self.place_arm()
        return super().image_raw()

    def arm_images_raw(self) -> list[RawImage]:
        """The images of the calibrated cameras; none without cameras."""
        if self._arm_cameras is None:
            return []
        started = time.perf_counter()
        images_raw = self._arm_cameras.images_raw(self.world.data, self.now_ns)
        self.rendering_s += time.perf_counter() - started
        return images_raw

    def place_arm(self) -> None:
        """Brings the rendered arm into the instructor's posture."""
        posture = self._arm_instructor.posture + self.world.world_from_shoulder
        pose = posture[[SHOULDER, ELBOW, TIP]].ravel()
        place_arm(self.world.model, self.world.data, pose, posture[WRIST], PREFIX)
        mujoco.mj_kinematics(self.world.model, self.world.data)

    def truth_arm(self) -> TruthArm:
        """How the arm really is and where it points, in the table frame."""
        instructor = self._arm_instructor
        message = TruthArm(time_ns=self.now_ns)
        points = table_from_shoulder(instructor.posture[[SHOULDER, ELBOW, TIP]])
        for name, (x, y, z) in zip(("shoulder", "elbow", "hand"), points, strict=True):
            message.points.add(name=name, x=x, y=y, z=z)
        if instructor.target is not None:
            message.action, message.performance = "pointing", instructor.pointings
            message.target.x, message.target.y, message.target.z = table_from_shoulder(instructor.target)
            message.at_target = instructor.at_target
        return message

    def close(self) -> None:
        """Gives the graphics contexts back."""
        super().close()
        if self._arm_cameras is not None:
            self._arm_cameras.close()

    @property
    def _arm_instructor(self) -> ArmInstructor:
        assert isinstance(self.instructor, ArmInstructor)
        return self.instructor

    def _stream(self, purpose: int) -> np.random.Generator:
        return np.random.default_rng((SEED_SPACE, self._seed, purpose))

    def _new_world(self, description: RobotDescription) -> World:
        return World(self.looks, description, self._furnish)

    def _new_instructor(self, draws: dict[str, np.random.Generator]) -> ArmInstructor:
        return ArmInstructor(self.world, self.looks.rules, draws, self.person, self._stream(POINTING))

    def _furnish(self, spec: mujoco.MjSpec, world_from_shoulder: Floats) -> None:
        """The arm and its cameras; the hand alone, which holds objects, is no longer rendered."""
        for geom in spec.body("hand").geoms:
            geom.group = scene.HIDDEN_GROUP
        look = draw_look(self._stream(LOOK))
        add_cloth(spec, look)
        add_arm(spec, self.person.sizes, look, PREFIX)
        add_arm_cameras(spec, world_from_shoulder, self.cameras)
        scene.place_view(spec, *VIEW)


def draw_look(draw: np.random.Generator) -> PersonLook:
    """Dark sleeves of almost no colour, so that nobody takes them for an object, and a hand of the hand's colour."""
    value = float(draw.uniform(0.12, 0.30))
    red, green, blue, _ = scene.RGBA["hand"]
    return PersonLook(
        cloth=colour(draw.random(), 0.10, value),
        second=colour(draw.random(), 0.10, value + float(draw.uniform(0.08, 0.2))),
        pattern=PATTERNS[int(draw.integers(4))],
        skin=(red, green, blue),
        hand_shape="pointing",
    )
