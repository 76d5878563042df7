"""The two calibrated cameras that look at the instructor's arm, like chapter 6's, but at the robot's scale.

Poses are in the table frame of `sim.small_person`, in which they are calibrated.
"""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from paramove.bus import Topic, topics
from paramove.cameras import CalibratedCamera
from paramove.diagnosis import Eye
from paramove.documents import Floats
from sim.camera import raw_image, with_noise
from sim.human import camera_frame
from sim.performances import Lens
from sim.performances_scene import (
    HEIGHT_PX,
    MARGIN_PX,
    WIDTH_PX,
    as_calibrated,
    draw_camera,
)
from sim.small_person import SCALE, shoulder_from_table, turn_of_table

PLACES = (  # eye and target in the human frame: from the right, and from above over the robot's left shoulder
    ((0.30, -1.80, 0.85), (-0.03, -0.16, 0.12)),
    ((0.85, -0.80, 1.75), (-0.03, -0.17, 0.06)),
)
RENDERED_PX = (WIDTH_PX + 2 * MARGIN_PX, HEIGHT_PX + 2 * MARGIN_PX)
HEIGHT_OF_SCENE = 0.04
"""Of the human frame's origin over the working plane, about."""
BOARD_SHIFT, BOARD_TURN = 0.001, 0.003
"""Maximum errors, m and rad, with which the calibration board was laid on the table; all cameras share them."""


def draw_arm_cameras(draw: np.random.Generator) -> tuple[CalibratedCamera, ...]:
    """The cameras around the arm, a little elsewhere and with another lens each time. Without errors."""
    return tuple(
        draw_camera(f"camera_{number}", eye, target, draw, SCALE, HEIGHT_OF_SCENE)
        for number, (eye, target) in enumerate(PLACES, start=1)
    )


def calibrated(cameras: tuple[CalibratedCamera, ...], draw: np.random.Generator) -> tuple[CalibratedCamera, ...]:
    """As somebody calibrated them, with the errors of a calibration and of where its board lay."""
    shift, turn = draw.uniform(-BOARD_SHIFT, BOARD_SHIFT, 2), float(draw.uniform(-BOARD_TURN, BOARD_TURN))
    table_from_board = np.eye(4)
    table_from_board[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    table_from_board[:2, 3] = shift
    calibrated = []
    for camera in cameras:
        one = as_calibrated(camera, draw)
        pose = one.camera_from_world @ table_from_board
        calibrated.append(CalibratedCamera(one.name, one.width_px, one.height_px, one.matrix, one.distortion, pose))
    return tuple(calibrated)


def add_arm_cameras(spec: mujoco.MjSpec, world_from_shoulder: Floats, cameras: tuple[CalibratedCamera, ...]) -> None:
    """Adds them to a world, and room to render their pictures."""
    view = spec.visual.global_
    view.offwidth = max(view.offwidth, RENDERED_PX[0])
    view.offheight = max(view.offheight, RENDERED_PX[1])
    for camera in cameras:
        shoulder_from_camera = np.eye(4)
        shoulder_from_camera[:3, :3] = turn_of_table() @ camera.camera_from_world[:3, :3].T
        shoulder_from_camera[:3, 3] = shoulder_from_table(camera.position) + world_from_shoulder
        position, quaternion = camera_frame(np.linalg.inv(shoulder_from_camera))
        half = HEIGHT_PX / 2 + MARGIN_PX
        fovy = float(np.rad2deg(2 * np.arctan(half / camera.matrix[1, 1])))
        spec.worldbody.add_camera(name=camera.name, pos=position, quat=quaternion, fovy=fovy)


class ArmCameras:
    """What falls on the cameras' sensors; see `ImageSource`.

    Args:
        model: With the cameras in it.
        cameras: As they really are.
        noise: Standard deviation of the sensors' noise, of 255.
        draw: Of the noise.
        every: They give an image in every so many ticks.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        cameras: tuple[CalibratedCamera, ...],
        noise: float,
        draw: np.random.Generator,
        every: int = 1,
    ) -> None:
        self._lenses = {camera.name: Lens(camera) for camera in cameras}
        self._eye = Eye(model, *RENDERED_PX)
        self._noise, self._draw, self._every = noise, draw, every
        self.close = self._eye.close

    def images(self, data: mujoco.MjData, tick: int, now_ns: int) -> Iterator[tuple[Topic, RawImage]]:
        """See `ImageSource.images`; RGB [240, 320, 3] each."""
        if tick % self._every == 0:
            for topic, (name, lens) in zip(topics.STEREO_IMAGES_RAW, self._lenses.items(), strict=True):
                exposed = with_noise(lens.image(self._eye.look(data, name)), self._noise, self._draw)
                yield topic, raw_image(exposed, name, now_ns)
