"""Simulator with an instructor who is a whole arm: `sim.simulator`, and what two calibrated cameras see of that arm.

Subscribes  wire/hoap3/stream   StreamBatch         events  joint units
            speech              Speech              events
Publishes   clock               Clock               15 Hz
            camera/image_raw    foxglove.RawImage   15 Hz   camera_optical
            camera_1/image_raw,
            camera_2/image_raw  foxglove.RawImage   15 Hz, or a part of it   camera_1, camera_2
            wire/hoap3/state    Hoap3State          15 Hz   joint units
            truth/layout        TruthLayout         once, latched   world; only for evaluators
            truth/state         TruthState          15 Hz   world; only for evaluators
            truth/arm           TruthArm            15 Hz   table; only for evaluators
            truth/view          foxglove.RawImage   15 Hz   for people, on request; only for evaluators

Writes what people would measure beforehand into the run folder: `cameras.yaml` and `person.yaml`, in the table frame of
`sim.small_person`.
"""

from __future__ import annotations

from functools import partial

from pydantic import Field

from paramove.bus import Bus, main, topics
from sim import simulator
from sim.arm_simulation import ArmSimulation
from sim.simulation import Simulation

SUBSCRIBES = (topics.WIRE_HOAP3_STREAM, topics.SPEECH)
PUBLISHES = (
    topics.CLOCK,
    topics.CAMERA_IMAGE_RAW,
    *topics.STEREO_IMAGES_RAW,
    topics.WIRE_HOAP3_STATE,
    topics.TRUTH_LAYOUT,
    topics.TRUTH_STATE,
    topics.TRUTH_ARM,
    topics.TRUTH_VIEW,
)


class Config(simulator.Config):
    """See `sim.simulator`.

    Attributes:
        arm_image_every: The cameras of the arm give an image in every so many ticks of 1/15 s; rendering and tracking
            take most of the time of a run.
    """

    arm_image_every: int = Field(default=1, ge=1, le=4)


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes or the simulated time is up."""
    simulator.run(bus, config, ArmSimulation, partial(say_of_arm, every=config.arm_image_every))


def say_of_arm(bus: Bus, simulation: Simulation, every: int = 1) -> None:
    """The arm's ground truth in this tick, and its images in every `every`-th tick."""
    assert isinstance(simulation, ArmSimulation)
    renders = simulation.tick % every == 0
    for topic, image_raw in zip(topics.STEREO_IMAGES_RAW, simulation.arm_images_raw() if renders else [], strict=False):
        bus.publish(topic, image_raw, simulation.now_ns)
    bus.publish(topics.TRUTH_ARM, simulation.truth_arm(), simulation.now_ns)


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
