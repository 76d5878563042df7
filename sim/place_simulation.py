"""One run of the simulated world in which a person points at places where the robot shall put an object."""

from __future__ import annotations

from typing import BinaryIO

import numpy as np
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from paramove.robots import RobotDescription
from sim import tool_box
from sim.arm_simulation import POINTING, ArmSimulation
from sim.place_instructor import OBJECT, START, PlaceInstructor
from sim.tool_box import NOMINAL, Measures


class PlaceSimulation(ArmSimulation):
    """See `ArmSimulation`. One object stands at its start; the robot has no camera but those that look at the arm."""

    def __init__(
        self,
        seed: int,
        description: RobotDescription,
        camera: bool = True,
        video: bool = False,
        firmware_log: BinaryIO | None = None,
        measures: Measures = NOMINAL,
    ) -> None:
        super().__init__(seed, description, camera, video, firmware_log, measures)
        self.world.place(OBJECT, tool_box.standing_centre(*START))

    def image_raw(self) -> RawImage | None:
        """None; the arm is brought into its present posture for the other cameras."""
        self.place_arm()
        return None

    def _new_instructor(self, draws: dict[str, np.random.Generator]) -> PlaceInstructor:
        return PlaceInstructor(self.world, self.looks.rules, draws, self.person, self._stream(POINTING))
