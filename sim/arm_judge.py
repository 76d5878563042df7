"""Arm judge: records how the person's arm really is, for the report after the run.

Subscribes  truth/arm   TruthArm   15 Hz   table

Writes `truth.mcap` into the run folder, and goes on in `truth.2.mcap`, … when its process is started again.
"""

from __future__ import annotations

from paramove.bus import Bus, NodeConfig, Received, main, topics
from paramove.recording import Recorder

SUBSCRIBES = (topics.TRUTH_ARM,)
PUBLISHES = ()


class Config(NodeConfig):
    """No parameters."""


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes, then finish the file."""
    with Recorder(bus, bus.run_folder / "truth.mcap", "paramove, judge of an arm") as recording:
        recording.tell("records the truth")
        for event in bus.events(*SUBSCRIBES, tick=True):
            if isinstance(event, Received):
                recording.keep(event)
            recording.tell("records the truth")


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
