"""Simulator of relocation by pointing: `sim.arm_simulator` with one object, and a person who points at free places.

Subscribes  wire/hoap3/stream   StreamBatch         events  joint units
            speech              Speech              events
Publishes   clock               Clock               15 Hz
            camera_1/image_raw,
            camera_2/image_raw  foxglove.RawImage   15 Hz   camera_1, camera_2
            wire/hoap3/state    Hoap3State          15 Hz   joint units
            truth/layout        TruthLayout         once, latched   world; only for evaluators
            truth/state         TruthState          15 Hz   world; only for evaluators
            truth/arm           TruthArm            15 Hz   table; only for evaluators
            truth/view          foxglove.RawImage   15 Hz   for people, on request; only for evaluators

Writes what people would measure beforehand into the run folder: `cameras.yaml` and `person.yaml`, in the table frame of
`sim.small_person`.
"""

from __future__ import annotations

from paramove.bus import Bus, main, topics
from sim import arm_simulator, simulator
from sim.place_simulation import PlaceSimulation

SUBSCRIBES = (topics.WIRE_HOAP3_STREAM, topics.SPEECH)
PUBLISHES = (
    topics.CLOCK,
    *topics.STEREO_IMAGES_RAW,
    topics.WIRE_HOAP3_STATE,
    topics.TRUTH_LAYOUT,
    topics.TRUTH_STATE,
    topics.TRUTH_ARM,
    topics.TRUTH_VIEW,
)


class Config(simulator.Config):
    """See `sim.simulator`."""


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes or the simulated time is up."""
    simulator.run(bus, config, PlaceSimulation, arm_simulator.say_of_arm)


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
