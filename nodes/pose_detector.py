"""Pose detector: finds the arms of a person in the images of each camera with a pose network.

Subscribes  camera_1/image, camera_2/image,
            camera_3/image, camera_4/image             foxglove.CompressedImage   15 Hz   camera_1 … camera_4
Publishes   camera_1/key_points, camera_2/key_points,
            camera_3/key_points, camera_4/key_points   BodyKeyPoints              15 Hz
"""

from pathlib import Path

from paramove.bus import Bus, NodeConfig, main, topics
from paramove.cameras import FrameError, decode
from paramove.observation import PoseDetection, key_points_message

SUBSCRIBES = topics.CAMERA_IMAGES
PUBLISHES = topics.CAMERA_KEY_POINTS


class Config(NodeConfig):
    networks: Path | None = None  # folder of the networks; by default where `paramove webcam setup` stores them


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes. Of images that came while the network was busy, the latest of each camera counts."""
    detection = PoseDetection(config.networks)
    if detection.trouble:
        bus.degraded(detection.trouble)
    else:
        bus.ready("looking for a person")
    reported = detection.trouble
    for event in bus.latest(*SUBSCRIBES):
        camera = event.topic.name.removesuffix("/image")
        try:
            points = detection.detect(camera, decode(event.message))
        except FrameError:
            continue  # the tracker reports it
        if points is not None:
            topic = PUBLISHES[SUBSCRIBES.index(event.topic)]
            bus.publish(topic, key_points_message(points, event.captured_ns), event.captured_ns)
        if detection.trouble != reported:
            reported = detection.trouble
            bus.degraded(reported) if reported else bus.ready("sees a person")


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
