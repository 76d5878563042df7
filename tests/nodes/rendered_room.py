"""Rendered images of a room in which somebody points, leaves, does something else, or is not alone."""

from __future__ import annotations

from pathlib import Path

import cv2
import mujoco
import numpy as np

from sim.camera import with_noise
from sim.human import place_arm
from sim.pointing_world import PointingWorld

RATE_HZ = 15.0
VIEWS = (1, 2)
PERSON = ("arm", "hand", "palm", "finger", "thumb", "chest", "belly", "yoke", "neck", "head", "hair", "nose", "pelvis")
HIDDEN_GROUP = 5
Image = np.ndarray


class Room:
    """A person points once. Holds a graphics context: `close` it."""

    def __init__(self, folder: Path, seed: int = 40) -> None:
        self._world = PointingWorld(seed, 1, VIEWS)
        self._world.write_measures(folder)
        self._seed = seed
        self.studio = self._world._studio  # what is filmed is changed below
        self.times_s = np.arange(0.0, self._world.duration_s, 1.0 / RATE_HZ)
        self.rest = self.studio.at(0.0).pose
        self.arrives_s = float(self.studio.performance.acts[0].arrives_s[0])

    def pointing(self) -> list[list[Image]]:
        """Images BGR of each view, without noise."""
        return [[self.studio.film(float(time), view - 1)[:, :, ::-1] for time in self.times_s] for view in VIEWS]

    def empty(self) -> list[Image]:
        """The room without the person, an image of each view."""
        model = self.studio._model
        names = [model.geom(number).name for number in range(model.ngeom)]
        person = [
            number for number, name in enumerate(names) if any(part in name for part in (*PERSON, "thigh", "shin"))
        ]
        groups = model.geom_group.copy()
        model.geom_group[person] = HIDDEN_GROUP
        images = [self.studio.film(0.0, view - 1)[:, :, ::-1] for view in VIEWS]
        model.geom_group[:] = groups
        return images

    def moving(self, poses: np.ndarray) -> list[list[Image]]:
        """The person's arm goes through these poses (T, 9), m."""
        film: list[list[Image]] = [[] for _ in VIEWS]
        model, data = self.studio._model, self.studio._data
        for pose in poses:
            self.studio._place(0.0)
            place_arm(model, data, pose)
            mujoco.mj_kinematics(model, data)
            mujoco.mj_camlight(model, data)
            for number, view in enumerate(VIEWS):
                picture = self.studio._eye.look(data, self.studio.cameras[view - 1].name)
                film[number].append(self.studio._lenses[view - 1].image(picture)[:, :, ::-1])
        return film

    def noisy(self, film: list[list[Image]]) -> list[list[Image]]:
        """With the noise of the sensor, which no two images share; the same for a film whatever was asked before."""
        draw = np.random.default_rng(self._seed)
        return [
            [with_noise(np.ascontiguousarray(image), self.studio.room.noise, draw) for image in view] for view in film
        ]

    def close(self) -> None:
        self._world.close()


def second_person(film: list[list[Image]], empty: list[Image]) -> list[list[Image]]:
    """Somebody in red stands behind the person and waves."""
    result = []
    for view, room in zip(film, empty, strict=True):
        result.append([])
        for number, image in enumerate(view):
            behind = room.copy()
            height, width = behind.shape[:2]
            middle, angle = (width // 5, height // 3), 0.7 * np.sin(2 * np.pi * number / 10)
            cv2.rectangle(behind, (middle[0] - 22, middle[1]), (middle[0] + 22, middle[1] + 90), (40, 40, 190), -1)
            cv2.circle(behind, (middle[0], middle[1] - 18), 15, (130, 160, 210), -1)
            elbow = (middle[0] + 40, middle[1] + 5)
            hand = (round(elbow[0] + 45 * np.sin(angle)), round(elbow[1] - 45 * np.cos(angle)))
            cv2.line(behind, (middle[0] + 15, middle[1] + 10), elbow, (40, 40, 190), 16)
            cv2.line(behind, elbow, hand, (40, 40, 190), 13)
            cv2.circle(behind, hand, 9, (130, 160, 210), -1)
            person = (np.abs(image.astype(int) - room.astype(int)).max(axis=2) > 12).astype(np.uint8)
            person = cv2.dilate(person, np.ones((3, 3), np.uint8))[:, :, None]
            result[-1].append(np.where(person > 0, image, behind).astype(np.uint8))
    return result


def waving(rest: np.ndarray, seconds: float = 4.0) -> np.ndarray:
    """Poses (T, 9) at `RATE_HZ`: the arm goes up, the forearm swings, and it comes back."""
    shoulder, upper, lower = rest[:3], np.linalg.norm(rest[3:6] - rest[:3]), np.linalg.norm(rest[6:] - rest[3:6])
    elbow = shoulder + upper * _unit((0.35, -0.75, -0.4))
    angles = 0.6 * np.sin(2 * np.pi * np.arange(round(seconds * RATE_HZ)) / 12)
    up = [np.concatenate([shoulder, elbow, elbow + lower * _unit((0.3, np.sin(a), np.cos(a)))]) for a in angles]
    return _there_and_back(rest, np.array(up))


def scratching(rest: np.ndarray, seconds: float = 2.5) -> np.ndarray:
    """Poses (T, 9) at `RATE_HZ`: the hand goes to the head, moves a little there, and comes back."""
    shoulder, upper, lower = rest[:3], np.linalg.norm(rest[3:6] - rest[:3]), np.linalg.norm(rest[6:] - rest[3:6])
    elbow = shoulder + upper * _unit((0.5, -0.7, 0.1))
    tips = [elbow + lower * _unit((-0.35, 0.5 + 0.06 * np.sin(k), 0.75)) for k in range(round(seconds * RATE_HZ))]
    return _there_and_back(rest, np.array([np.concatenate([shoulder, elbow, tip]) for tip in tips]))


def _there_and_back(rest: np.ndarray, there: np.ndarray) -> np.ndarray:
    resting = np.repeat(rest[None], round(RATE_HZ), axis=0)
    return np.concatenate([resting, _way(rest, there[0]), there, _way(there[-1], rest), resting])


def _way(first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Poses between two, the segments as long as in the first."""
    share = (0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 12)))[:, None]
    poses = first + share * (last - first)
    for near, far in ((slice(0, 3), slice(3, 6)), (slice(3, 6), slice(6, 9))):
        length = np.linalg.norm(first[far] - first[near])
        poses[:, far] = poses[:, near] + length * _unit(poses[:, far] - poses[:, near])
    return poses


def _unit(vectors: object) -> np.ndarray:
    values = np.asarray(vectors, dtype=np.float64)
    return values / np.linalg.norm(values, axis=-1, keepdims=True)
