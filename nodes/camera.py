"""Camera: reads frames from a camera, a file or a topic, checks them and publishes them compressed.

Subscribes  camera/image_raw   foxglove.RawImage          15 Hz   camera_optical   with source topic:camera/image_raw
Publishes   camera/image       foxglove.CompressedImage   15 Hz   camera_optical
"""

from pydantic import Field

from paramove.bus import Bus, NodeConfig, Received, main, topics
from paramove.cameras import EndOfFrames, FrameChecks, FrameError, encode, open_source, without_password

SUBSCRIBES = (topics.CAMERA_IMAGE_RAW,)
PUBLISHES = (topics.CAMERA_IMAGE,)


class Config(NodeConfig):
    source: str = (
        "topic:camera/image_raw"  # or file:PATH, device:PATH, device:URL, folder:PATH@RATE, recording:PATH#TOPIC
    )
    width: int = Field(480, gt=0)
    height: int = Field(360, gt=0)
    jpeg_quality: int = Field(95, ge=1, le=100)
    frozen_after: int = Field(5, ge=0)  # equal frames in a row; 0: equal frames are allowed


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes or a video file ends. A bad frame is not published and makes the node degraded."""
    source = open_source(config.source, config.width, config.height, bus.run_folder)
    checks = FrameChecks(config.width, config.height, config.frozen_after)
    name = without_password(config.source)
    bus.ready(f"frames from {name}")
    fault = ""
    try:
        for event in bus.events(topics.CAMERA_IMAGE_RAW, tick=True) if source.from_topic else bus.events(tick=True):
            now_ns, raw = (event.captured_ns, event.message) if isinstance(event, Received) else (event.now_ns, None)
            try:
                frame = source.frame(now_ns, raw)
                if frame is None:
                    continue
                bus.publish(topics.CAMERA_IMAGE, encode(checks.passed(frame), config.jpeg_quality), frame.captured_ns)
            except EndOfFrames as end:
                bus.ready(str(end))
                return
            except FrameError as error:
                if error.kind != fault:
                    fault = error.kind
                    bus.degraded(str(error))
                continue
            if fault:
                fault = ""
                bus.ready(f"frames from {name} again")
    finally:
        source.close()


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
