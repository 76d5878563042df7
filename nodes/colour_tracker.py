"""Colour tracker: finds the coloured objects and the hand in each camera frame.

Subscribes  camera/image     foxglove.CompressedImage   15 Hz   camera_optical
Publishes   objects/tracked  TrackedObjects             15 Hz   image plane, pixels
"""

from paramove.bus import Bus, NodeConfig, main, topics
from paramove.cameras import FrameError, decode
from paramove.objects import DEFAULT_COLOURS, Colour, ColourTracker

SUBSCRIBES = (topics.CAMERA_IMAGE,)
PUBLISHES = (topics.OBJECTS_TRACKED,)


class Config(NodeConfig):
    colours: tuple[Colour, ...] = DEFAULT_COLOURS


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes. An image that cannot be decoded is skipped."""
    tracker = ColourTracker(config.colours)
    detail = f"tracking {', '.join(colour.name for colour in config.colours)}"
    bus.ready(detail)
    well = True
    for received in bus.latest(topics.CAMERA_IMAGE):
        try:
            image = decode(received.message)
        except FrameError as error:
            if well:
                well = False
                bus.degraded(str(error))
            continue
        bus.publish(topics.OBJECTS_TRACKED, tracker.update(image, received.captured_ns), received.captured_ns)
        if not well:
            well = True
            bus.ready(detail)


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
