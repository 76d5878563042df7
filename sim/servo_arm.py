"""A servo arm in a world with more in it: emulated servos behind a port, whose driver lets time run while it drives."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from paramove.bus import Received, Topic
from paramove.documents import Floats
from paramove.robots import RobotDescription
from sim.emulated_arm import EmulatedArm
from sim.world import World


class ServoArm:
    """In its base pose at first, with torque.

    Args:
        description: Of the robot.
        port: Path of the link to the serial port.
        control: Path of the control socket.
        seed: Of communication faults.
    """

    def __init__(self, description: RobotDescription, port: Path, control: Path, seed: int) -> None:
        self.description = description
        self._port, self._control, self._seed = port, control, seed
        self._arm: EmulatedArm | None = None

    def connect(self, world: World, step: Callable[[], None]) -> None:
        """Puts the servos into a world that advances by `step`, and opens the port."""
        model = (world.model, world.data)
        arm = EmulatedArm(
            self.description, model, self._port, self._control, seed=self._seed, held=True, paced=True, advance=step
        )
        self._arm = arm.__enter__()

    def handle(self, received: Received) -> None:
        """Nothing on the bus moves it."""

    def run_to(self, world: World, steps: int, step: Callable[[], None]) -> None:
        """Lets the world run on where no driver did; raises RuntimeError."""
        assert self._arm is not None
        self._arm.run_to(steps)

    def messages(self, world: World, now_ns: int) -> Iterator[tuple[Topic, Any]]:
        """It reports over its port alone."""
        return iter(())

    def commanded_gripper(self) -> Floats | None:
        """Not known here."""
        return None

    def close(self) -> None:
        """Removes the port."""
        if self._arm is not None:
            self._arm.__exit__(None, None, None)
