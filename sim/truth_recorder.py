"""Truth recorder: records the truth of a simulated run, for the report after it.

Subscribes  truth/layout   TruthLayout         once, latched   world
            truth/state    TruthState          15 Hz           world
            truth/arm      TruthArm            15 Hz           table
            truth/view     foxglove.RawImage   15 Hz           if the simulator renders it

Writes `truth.mcap` (the view as JPEG) into the run folder, and goes on in `truth.2.mcap`, … when its process is started
again.
"""

from __future__ import annotations

import cv2
from pydantic import Field

from paramove.bus import Bus, NodeConfig, Received, main, topics
from paramove.recording import Recorder
from sim.judge import compressed

SUBSCRIBES = (topics.TRUTH_LAYOUT, topics.TRUTH_STATE, topics.TRUTH_ARM, topics.TRUTH_VIEW)
PUBLISHES = ()


class Config(NodeConfig):
    """`jpeg_quality`: of the view's images."""

    jpeg_quality: int = Field(default=88, ge=10, le=100)


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes, then finish the file."""
    cv2.setNumThreads(1)
    with Recorder(bus, bus.run_folder / "truth.mcap", "paramove truth recorder") as recording:
        recording.tell("records the truth")
        for event in bus.events(*SUBSCRIBES, tick=True):
            if isinstance(event, Received):
                view = event.topic is topics.TRUTH_VIEW
                recording.keep(event, compressed(event.message, config.jpeg_quality) if view else None)
            recording.tell("records the truth")


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
