"""Arms at one table: one world that the servos of all of them move, step by step together."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Self

import mujoco
from pydantic import BaseModel, ConfigDict

from paramove.documents import InputError
from paramove.motion import check_model
from paramove.msgs.truth_pb2 import TruthState
from paramove.robots import RobotDescription, RobotFolder
from sim.emulated_arm import NS_PER_STEP, EmulatedArm


class MountedArm(BaseModel):
    """An arm and where its base stands.

    Attributes:
        robot: Folder of its description.
        x, y: In the world, m.
        yaw_deg: About the world's z axis; 0 looks along x.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    robot: RobotFolder
    x: float = 0.0
    y: float = 0.0
    yaw_deg: float = 0.0


class TableArms:
    """Context manager for the emulated arms at a table.

    The servos of the first arm run in real time. Each of their steps of a millisecond lets those of the next arm make
    one, too, and that of the last one the world, so that all torques of a step act in it together. Only the first
    arm's requests and replies take the time that a serial line takes.

    Args:
        scene: MJCF of the table and the things on it, without arms.
        arms: By namespace; its name and `_` come before the names of the arm's joints, bodies and sites in the world.
        folder: The arm's port is the link `port` in the folder of its namespace there.
        port: Relative path of the link.
        seed: Of communication faults.

    Raises:
        InputError: The scene or an arm cannot be simulated.

    Attributes:
        model, data: The world.
    """

    def __init__(self, scene: Path, arms: Mapping[str, MountedArm], folder: Path, port: Path, seed: int = 0) -> None:
        robots = {namespace: RobotDescription.load(arm.robot) for namespace, arm in arms.items()}
        for robot in robots.values():
            check_model(robot)
            if robot.chain is None:
                raise InputError(f"{robot.name} is not a servo arm: its robot.yaml has no chain")
        self.model = _world(scene, arms, robots)
        self.data = mujoco.MjData(self.model)
        self._arms: dict[str, EmulatedArm] = {}
        advance: Callable[[], None] = self._step_world
        first, *_ = arms
        for namespace in reversed(list(arms)):  # the world's step is within that of the last arm, and so on
            arm = EmulatedArm(
                robots[namespace],
                (self.model, self.data),
                folder / namespace / port,
                seed=seed,
                held=True,
                paced=namespace != first,
                advance=advance,
                prefix=f"{namespace}_",
            )
            advance = partial(self._step_arm, arm)
            self._arms[namespace] = arm
        self._first = self._arms[first]
        self._open = contextlib.ExitStack()

    def __enter__(self) -> Self:
        with contextlib.ExitStack() as opened:
            for arm in self._arms.values():  # at last the first one, which lets the others run
                opened.enter_context(arm)
            self._open = opened.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self._open.close()

    def check(self) -> None:
        """Raises EmulatorStoppedError if an arm's emulator has failed."""
        for arm in self._arms.values():
            arm.emulator.check()

    @property
    def detail(self) -> str:
        """That of each arm."""
        return "; ".join(arm.detail for arm in reversed(self._arms.values()))

    def truths(self, now_ns: int) -> Iterator[tuple[str, TruthState]]:
        """Namespace and true state of each arm, and of all things in the frame of its base."""
        with self._first.emulator.lock:
            states = [(namespace, arm.truth_in_still_world(now_ns)) for namespace, arm in self._arms.items()]
        yield from states

    def write_model(self, path: Path) -> None:
        """Writes the world as a binary model of MuJoCo, for those who draw it."""
        mujoco.mj_saveModel(self.model, str(path), None)

    def _step_world(self) -> None:
        mujoco.mj_step(self.model, self.data)

    def _step_arm(self, arm: EmulatedArm) -> None:
        arm.run_to(round(self.data.time * 1e9 / NS_PER_STEP) + 1)


def _world(scene: Path, arms: Mapping[str, MountedArm], robots: Mapping[str, RobotDescription]) -> mujoco.MjModel:
    """The scene with the arms in it; raises InputError."""
    try:
        world = mujoco.MjSpec.from_file(str(scene))
        for namespace, arm in arms.items():
            half = math.radians(arm.yaw_deg) / 2
            part = mujoco.MjSpec.from_file(str(robots[namespace].model_path))
            for key in list(part.keys):  # a pose of that arm alone is none of the world
                part.delete(key)
            mount = world.worldbody.add_frame(pos=[arm.x, arm.y, 0.0], quat=[math.cos(half), 0.0, 0.0, math.sin(half)])
            world.attach(part, prefix=f"{namespace}_", frame=mount)
        return world.compile()
    except ValueError as error:
        raise InputError(f"{scene} with {', '.join(arms)} cannot be simulated: {error}") from error
