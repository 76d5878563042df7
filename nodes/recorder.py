"""Recorder: keeps every recorded topic in `recording.mcap` of the run's folder.

When its process is started again, or the disk was full, it goes on in `recording.2.mcap`, ….

Subscribes  every topic that the topic table marks as recorded, in all namespaces or in its own
"""

from paramove.bus import Bus, NodeConfig, Received, main, topics
from paramove.documents import FileName
from paramove.recording import Recorder

SUBSCRIBES = topics.RECORDED
PUBLISHES = ()

REPORT_EVERY = 1500


class Config(NodeConfig):
    """`file`: name of the recording in the run's folder."""

    file: FileName = "recording.mcap"


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes, then finish the file."""
    with Recorder(bus, bus.run_folder / config.file, "paramove recorder") as recording:
        count, detail = 0, f"recording to {recording.part_name}"
        recording.tell(detail)
        for event in bus.events(tick=True):
            if isinstance(event, Received):
                recording.keep(event)
                count += 1
                if count % REPORT_EVERY == 0:
                    detail = f"{count} messages recorded"
            recording.tell(detail)
        for received in bus.rest():  # of the nodes that have ended before
            recording.keep(received)


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config, every_namespace=True)
