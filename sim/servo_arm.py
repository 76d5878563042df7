"""A servo arm in a world with more in it: emulated servos behind a port.

In lockstep their driver lets time run while it drives; otherwise servos and world run by themselves, in real time.
"""

from __future__ import annotations

import threading
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
        paced: Whether it is in lockstep.
    """

    def __init__(self, description: RobotDescription, port: Path, control: Path, seed: int, paced: bool) -> None:
        self.description = description
        self._port, self._control, self._seed, self._paced = port, control, seed, paced
        self._arm: EmulatedArm | None = None

    def connect(self, world: World, step: Callable[[], None]) -> threading.Lock | None:
        """Puts the servos into a world that advances by `step`, and opens the port."""
        self._arm = EmulatedArm(
            self.description,
            (world.model, world.data),
            self._port,
            self._control,
            seed=self._seed,
            held=True,
            paced=self._paced,
            advance=step,
        )
        self._arm.__enter__()
        return None if self._paced else self._arm.emulator.lock

    def handle(self, received: Received) -> None:
        """Nothing on the bus moves it."""

    def run_to(self, world: World, steps: int, step: Callable[[], None]) -> None:
        """Lets a world in lockstep run on where no driver did; raises RuntimeError."""
        assert self._arm is not None
        if self._paced:
            self._arm.run_to(steps)
        else:
            self._arm.emulator.check()

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
