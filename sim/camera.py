"""What falls on the camera's sensor: MuJoCo's picture, bent by the lens, with the noise of the sensor."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

import cv2
import mujoco
import numpy as np
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from numpy.typing import NDArray

from paramove.bus import Topic, topics
from paramove.diagnosis import Eye
from paramove.documents import Image
from sim import looks, scene
from sim.drawn_person import DrawnPerson
from sim.looks import Camera, Looks

NOISE_IMAGES = 8
VIEW_DIFFUSE, VIEW_AMBIENT = 0.36, 0.20
"""Of each light in the view for people, whatever the light in the world."""


class Sensor:
    """Lens and sensor of one seed's camera.

    Args:
        camera: Its lens.
        pixel_noise: Standard deviation, of 255.
        draw: Of the noise.
    """

    def __init__(self, camera: Camera, pixel_noise: float, draw: np.random.Generator) -> None:
        columns, rows = undistorting_map(camera)
        self._columns, self._rows = cv2.convertMaps(columns, rows, cv2.CV_16SC2)
        shape = (looks.HEIGHT_PX, looks.WIDTH_PX, 3)
        # Drawing noise costs more than rendering: a few images are drawn once and used from random offsets.
        values = draw.normal(0.0, pixel_noise, (NOISE_IMAGES, int(np.prod(shape)))).round().astype(np.int8)
        self._noise = np.concatenate([values, values], axis=1)
        self._shape = shape
        self._draw = draw

    def expose(self, picture: Image) -> Image:
        """The image [H, W, 3] of a rendered picture, which is larger by the margin the lens may pull in."""
        bent = cv2.remap(picture, self._columns, self._rows, cv2.INTER_LINEAR)
        number = int(self._draw.integers(NOISE_IMAGES))
        start = int(self._draw.integers(bent.size))
        noise = self._noise[number, start : start + bent.size].reshape(self._shape)
        return np.asarray(cv2.add(bent, noise, dtype=cv2.CV_8U), dtype=np.uint8)


class ImageSource(Protocol):
    """Cameras in a world. Holds a graphics context: use it in one thread and `close` it."""

    def images(self, data: mujoco.MjData, tick: int, now_ns: int) -> Iterator[tuple[Topic, RawImage]]:
        """What they see now, each with its topic."""

    def close(self) -> None:
        """Gives the graphics context back."""


class RobotCamera:
    """The camera that looks at the robot's working area; see `ImageSource`.

    Args:
        model: With the camera in it.
        world_looks: Its lens, and its noise.
        draw: Of the noise.
    """

    def __init__(self, model: mujoco.MjModel, world_looks: Looks, draw: np.random.Generator) -> None:
        self._eye = Eye(model, *scene.RENDERED_PX)
        self._sensor = Sensor(world_looks.camera, world_looks.pixel_noise, draw)
        self.close = self._eye.close

    def images(self, data: mujoco.MjData, tick: int, now_ns: int) -> Iterator[tuple[Topic, RawImage]]:
        """See `ImageSource.images`."""
        exposed = self._sensor.expose(self._eye.look(data, "camera"))
        yield topics.CAMERA_IMAGE_RAW, raw_image(exposed, "camera_optical", now_ns)


class ViewForPeople:
    """A view of the whole scene without lens and noise, in good light; see `ImageSource`.

    Args:
        model: Of the world.
        person: Drawn around the person's hand; None: the hand is drawn as it is.
    """

    def __init__(self, model: mujoco.MjModel, person: DrawnPerson | None = None) -> None:
        self._eye = Eye(model, *scene.VIEW_PX)
        self._person = person
        if person is not None:  # who has sleeves
            self._eye.options.geomgroup[scene.SLEEVE_GROUP] = 0
        self.close = self._eye.close

    def images(self, data: mujoco.MjData, tick: int, now_ns: int) -> Iterator[tuple[Topic, RawImage]]:
        """See `ImageSource.images`."""

        def adorn(drawn: mujoco.MjvScene) -> None:
            for light in drawn.lights[: drawn.nlight]:
                light.diffuse[:], light.ambient[:] = VIEW_DIFFUSE, VIEW_AMBIENT
            if self._person is not None:
                hand = data.body(scene.HAND)
                self._person.draw(drawn, hand.xpos, hand.xmat.reshape(3, 3)[:, 2])

        yield topics.TRUTH_VIEW, raw_image(self._eye.look(data, "view", adorn), "view", now_ns)


def with_noise(image: Image, deviation: float, draw: np.random.Generator) -> Image:
    """The image with the noise of a sensor; standard deviation of 255."""
    noise = draw.normal(0.0, deviation, image.shape).round().astype(np.int8)
    return np.asarray(cv2.add(image, noise, dtype=cv2.CV_8U), dtype=np.uint8)


def raw_image(image: Image, frame: str, now_ns: int) -> RawImage:
    """An RGB image [H, W, 3] as a message."""
    height, width = image.shape[:2]
    message = RawImage(
        frame_id=frame, width=width, height=height, encoding="rgb8", step=3 * width, data=image.tobytes()
    )
    message.timestamp.FromNanoseconds(now_ns)
    return message


def undistorting_map(camera: Camera) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """For each pixel of the image, column and row in the rendered picture, each [H, W].

    Solves distorted = undistorted * (1 + k1 r^2) for the undistorted point by Newton's method on r.
    """
    centre = np.array(camera.principal_point_px)
    grid = np.stack(np.meshgrid(np.arange(looks.WIDTH_PX), np.arange(looks.HEIGHT_PX)), axis=-1)
    distorted = (grid - centre) / camera.focal_px
    radius = np.linalg.norm(distorted, axis=-1)
    undistorted = radius.copy()
    for _ in range(8):
        excess = undistorted * (1 + camera.k1 * undistorted**2) - radius
        undistorted -= excess / (1 + 3 * camera.k1 * undistorted**2)
    scale = np.divide(undistorted, radius, out=np.ones_like(radius), where=radius > 0)
    middle = (np.array(scene.RENDERED_PX) - 1) / 2
    picture = (distorted * scale[..., None] * camera.focal_px + middle).astype(np.float32)
    return np.ascontiguousarray(picture[..., 0]), np.ascontiguousarray(picture[..., 1])
