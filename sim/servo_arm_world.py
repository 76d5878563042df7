"""An arm of emulated servos in its own scene, in the time of the run: for lockstep."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from paramove.bus import Received, Topic, topics
from paramove.msgs.truth_pb2 import TruthLayout
from paramove.robots import RobotDescription
from sim.emulated_arm import NS_PER_STEP, EmulatedArm
from sim.simulation import step_of_tick

MODEL_SCENE = Path("scene.xml")


class ServoArmWorld:
    """Its driver lets time run, over the control socket, while it drives; the rest of a tick runs here.

    Args:
        robot: With servos in its joints.
        port: Path of the link to the serial port.
        control: Path of the control socket.
        seed: Of communication faults.
    """

    finished = False

    def __init__(self, robot: RobotDescription, port: Path, control: Path, seed: int) -> None:
        self._arm = EmulatedArm(robot, MODEL_SCENE, port, control, seed=seed, held=True, paced=True)
        self._arm.__enter__()

    @property
    def now_ns(self) -> int:
        """Simulated time since the start."""
        time_ms: float = round(self._arm.mechanics.data.time * 1e3)
        return int(time_ms) * NS_PER_STEP

    def write_measures(self, folder: Path) -> None:
        """Nobody measures anything."""

    def layout(self) -> TruthLayout | None:
        """There is none."""
        return None

    def handle(self, received: Received) -> None:
        """Nothing on the bus moves it."""

    def run_to_tick(self, tick: int) -> None:
        """Lets the world run where no driver did."""
        self._arm.run_to(step_of_tick(tick))

    def messages(self) -> Iterator[tuple[Topic, Any]]:
        """The truth."""
        yield topics.TRUTH_STATE, self._arm.truth(self.now_ns)

    def detail(self, wall_s: float) -> str:
        """The arm's, and how fast time runs."""
        return f"{self._arm.detail}; {1e-9 * self.now_ns:.0f} s simulated in {wall_s:.0f} s"

    def close(self) -> None:
        """Removes the port."""
        self._arm.__exit__(None, None, None)


class ServoArmWorlds:
    """Arms in scenes of their own, each in the namespace of its driver.

    Args:
        worlds: By namespace.
    """

    finished = False

    def __init__(self, worlds: Mapping[str, ServoArmWorld]) -> None:
        self._worlds = worlds

    @property
    def now_ns(self) -> int:
        """Simulated time since the start, which is the same in all of them between two ticks."""
        return min(world.now_ns for world in self._worlds.values())

    def write_measures(self, folder: Path) -> None:
        """Nobody measures anything."""

    def layout(self) -> TruthLayout | None:
        """There is none."""
        return None

    def handle(self, received: Received) -> None:
        """Nothing on the bus moves them."""

    def run_to_tick(self, tick: int) -> None:
        """Lets the worlds run where no driver did."""
        for world in self._worlds.values():
            world.run_to_tick(tick)

    def messages(self) -> Iterator[tuple[Topic, Any]]:
        """The truth in each namespace."""
        for namespace, world in self._worlds.items():
            for topic, message in world.messages():
                yield topics.topic_in(namespace, topic), message

    def detail(self, wall_s: float) -> str:
        """That of each arm."""
        return "; ".join(world.detail(wall_s) for world in self._worlds.values())

    def close(self) -> None:
        """Removes the ports."""
        for world in self._worlds.values():
            world.close()
