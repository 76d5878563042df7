"""Recorder: keeps every recorded topic in `recording.mcap` of the run's folder.

When its process is started again it goes on in `recording.2.mcap`, ….

Hears   every topic that the topic table marks as recorded
"""

from paramove.bus import topics
from paramove.bus.node import Bus, NodeConfig, main
from paramove.recording.parts import next_part
from paramove.recording.writer import RecordingWriter

HEARS = topics.RECORDED
SAYS = ()

REPORT_EVERY = 1500


class Config(NodeConfig):
    """`file`: name of the recording in the run's folder."""

    file: str = "recording.mcap"


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes, then finish the file."""
    with RecordingWriter(next_part(bus.run_folder / config.file), "paramove recorder") as recording:
        bus.ready(f"recording to {recording.path.name}")
        for count, heard in enumerate(bus.events(*HEARS), start=1):
            recording.write(heard.topic.name, heard.message, heard.captured_ns, heard.published_ns, heard.sequence)
            if count % REPORT_EVERY == 0:
                bus.ready(f"{count} messages recorded")


if __name__ == "__main__":
    main(run, HEARS, SAYS, Config)
