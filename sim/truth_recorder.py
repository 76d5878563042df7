"""Truth recorder: records the truth of a simulated run, for the report after it.

Hears   truth/layout   TruthLayout         once, latched   world
        truth/state    TruthState          15 Hz           world
        truth/arm      TruthArm            15 Hz           table
        truth/view     foxglove.RawImage   15 Hz           if the simulator renders it

Writes `truth.mcap` (the view as JPEG) into the run folder, and goes on in `truth.2.mcap`, … when its process is started
again.
"""

from __future__ import annotations

import cv2
from pydantic import Field

from paramove.bus import topics
from paramove.bus.node import Bus, NodeConfig, main
from paramove.recording.parts import next_part
from paramove.recording.writer import RecordingWriter
from sim.judge import compressed

HEARS = (topics.TRUTH_LAYOUT, topics.TRUTH_STATE, topics.TRUTH_ARM, topics.TRUTH_VIEW)
SAYS = ()


class Config(NodeConfig):
    """`jpeg_quality`: of the view's images."""

    jpeg_quality: int = Field(default=88, ge=10, le=100)


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes, then finish the file."""
    cv2.setNumThreads(1)
    with RecordingWriter(next_part(bus.run_folder / "truth.mcap"), "paramove truth recorder") as recording:
        bus.ready("records the truth")
        for heard in bus.events(*HEARS):
            view = heard.topic is topics.TRUTH_VIEW
            message = compressed(heard.message, config.jpeg_quality) if view else heard.message
            recording.write(heard.topic.name, message, heard.captured_ns, heard.published_ns, heard.sequence)


if __name__ == "__main__":
    main(run, HEARS, SAYS, Config)
