"""Pointing simulator: images that calibrated cameras have of a person at a table, who points.

Publishes   clock                             Clock               15 Hz
            camera_1/image_raw, camera_2/image_raw,
            camera_3/image_raw, camera_4/image_raw   foxglove.RawImage   15 Hz   camera_1 … camera_4
            truth/arm                         TruthArm            15 Hz   table; only for evaluators

Writes what people would measure beforehand into the run folder: `cameras.yaml` and `person.yaml`.
"""

from __future__ import annotations

import time
from typing import Literal

from pydantic import Field

from paramove.bus import Bus, LockstepBarrier, NodeConfig, main, topics
from sim.pointing_world import PointingWorld

SUBSCRIBES = ()
PUBLISHES = (topics.CLOCK, *topics.CAMERA_IMAGES_RAW, topics.TRUTH_ARM)

CAMERA_HZ = 15
REPORT_S = 5


class Config(NodeConfig):
    """Parameters of the simulator.

    Attributes:
        seed: Of person, room, cameras and noise.
        targets: How often the person points.
        views: Which cameras look, from 1.
        markers: Points of the arm at which the person wears coloured balls.
        pace: Simulated seconds per second when nobody waits for anybody (not in lockstep).
    """

    seed: int = Field(default=0, ge=0)
    targets: int = Field(default=5, ge=1, le=100)
    views: tuple[int, ...] = Field(default=(1, 2), min_length=1, max_length=4)
    markers: tuple[Literal["shoulder", "elbow", "wrist", "index"], ...] = ()
    pace: float = Field(default=1.0, gt=0)


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes or the person is done."""
    world = PointingWorld(config.seed, config.targets, config.views, config.markers)
    try:
        world.write_measures(bus.run_folder)
        bus.ready("the person sits at the table")
        _loop(bus, config, world)
    finally:
        world.close()


def _loop(bus: Bus, config: Config, world: PointingWorld) -> None:
    barrier = LockstepBarrier(bus)
    if not barrier.wait_for_members():
        return
    started_s = time.perf_counter()
    while not bus.stopped and barrier.tick / CAMERA_HZ <= world.duration_s:
        now_s = barrier.tick / CAMERA_HZ
        now_ns = round(now_s * 1e9)
        for topic, image_raw in zip(topics.CAMERA_IMAGES_RAW, world.images_raw(now_s), strict=False):
            bus.publish(topic, image_raw, now_ns)
        truth = world.truth(now_s)
        bus.publish(topics.TRUTH_ARM, truth, now_ns)
        barrier.advance(now_ns)
        if not bus.settings.lockstep:
            bus.idle(started_s + (now_s + 1 / CAMERA_HZ) / config.pace - time.perf_counter())
        if barrier.tick % (REPORT_S * CAMERA_HZ) == 0:
            bus.ready(f"{now_s:.0f} s: the person {'points' if truth.action else 'rests'}")
    barrier.close()


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
