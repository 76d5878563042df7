"""Arm judge: records how the person's arm really is, for the report after the run.

Hears   truth/arm   TruthArm   15 Hz   table

Writes `truth.mcap` into the run folder, and goes on in `truth.2.mcap`, … when its process is started again.
"""

from __future__ import annotations

from paramove.bus import topics
from paramove.bus.node import Bus, NodeConfig, main
from paramove.recording.parts import next_part
from paramove.recording.writer import RecordingWriter

HEARS = (topics.TRUTH_ARM,)
SAYS = ()


class Config(NodeConfig):
    """No parameters."""


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes, then finish the file."""
    with RecordingWriter(next_part(bus.run_folder / "truth.mcap"), "paramove, judge of an arm") as recording:
        bus.ready("records the truth")
        for heard in bus.events(*HEARS):
            recording.write(heard.topic.name, heard.message, heard.captured_ns, heard.published_ns, heard.sequence)


if __name__ == "__main__":
    main(run, HEARS, SAYS, Config)
