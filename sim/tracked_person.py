"""A person whose arm calibrated cameras see: who it is, how that looks, where the cameras are, what people measure."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from paramove.cameras import write_cameras
from paramove.documents import Floats
from sim import scene
from sim.arm_cameras import ArmCameras, add_arm_cameras, calibrated, draw_arm_cameras
from sim.human import PersonLook, add_arm, add_cloth
from sim.performances_scene import PATTERNS, colour
from sim.simulation import ARM_PREFIX
from sim.small_person import SmallPerson, shoulder_from_table, turn_of_table
from sim.world import World

SEED_SPACE = 4200
PERSON, POINTING, LOOK, CAMERAS, NOISE, CALIBRATION = range(6)
VIEW = ((0.50, 0.62, 0.40), (0.12, -0.10, 0.0))
"""The view for people, from the robot's left: from its right the arm would be in the way. World, m."""
NOISE_RANGE = (2.0, 6.0)  # standard deviation of 255


class TrackedPerson:
    """Draws from generators of its own, so the rest of the world is as without it.

    Args:
        seed: Of everything about the person and the cameras.

    Attributes:
        body: Whose arm it is.
        cameras: As they really are, in the table frame.
        pointing: Generator of how the person points each time.
    """

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self.body = SmallPerson(self._stream(PERSON))
        self.cameras = draw_arm_cameras(self._stream(CAMERAS))
        self.pointing = self._stream(POINTING)

    def furnish(self, spec: mujoco.MjSpec, world_from_shoulder: Floats) -> None:
        """The arm and its cameras; the hand alone, which holds objects, is no longer rendered."""
        for geom in spec.body(scene.HAND).geoms:
            geom.group = scene.HIDDEN_GROUP
        look = draw_look(self._stream(LOOK))
        add_cloth(spec, look)
        add_arm(spec, self.body.sizes, look, ARM_PREFIX)
        add_arm_cameras(spec, world_from_shoulder, self.cameras)
        scene.place_view(spec, *VIEW)

    def images(self, world: World, every: int) -> ArmCameras:
        """What the cameras see, in every so many ticks."""
        noise = self._stream(NOISE)
        return ArmCameras(world.model, self.cameras, float(noise.uniform(*NOISE_RANGE)), noise, every)

    def write_measures(self, folder: Path) -> None:
        """What people measure beforehand: `cameras.yaml`, with the errors of a calibration, and `person.yaml`."""
        write_cameras(folder / "cameras.yaml", calibrated(self.cameras, self._stream(CALIBRATION)))
        self.body.write_measures(folder / "person.yaml")

    def _stream(self, purpose: int) -> np.random.Generator:
        return np.random.default_rng((SEED_SPACE, self._seed, purpose))


def world_from_table(world: World) -> Floats:
    """Pose [4, 4] of the table frame, in which cameras and person are measured."""
    pose = np.eye(4)
    pose[:3, :3] = turn_of_table()
    pose[:3, 3] = shoulder_from_table(np.zeros(3)) + world.world_from_shoulder
    return pose


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
