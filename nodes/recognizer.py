"""Recognizer: tells from tracked objects what happens on the table: moved, rested, vanished, appeared, pointed at.

Hears   objects/tracked     TrackedObjects     15 Hz   image plane, pixels
        calibration/plane   PlaneCalibration   event   right_shoulder
Says    gestures            Gesture            event   pixels, and metres once calibrated
"""

from paramove.bus import topics
from paramove.bus.node import Bus, NodeConfig, main
from paramove.msgs.plane_calibration_pb2 import PlaneCalibration
from paramove.vision.homography import HomographyError, PlaneHomography
from paramove.vision.object_motion import MotionThresholds
from paramove.vision.pointing import PointingThresholds
from paramove.vision.recognizer import Recognizer, RecognizerOptions

HEARS = (topics.OBJECTS_TRACKED, topics.CALIBRATION_PLANE)
SAYS = (topics.GESTURES,)


class Config(NodeConfig):
    rim_clearance: float = RecognizerOptions.rim_clearance  # m
    motion: MotionThresholds = MotionThresholds()
    pointing: PointingThresholds = PointingThresholds()


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes."""
    recognizer = Recognizer(RecognizerOptions(config.motion, config.pointing, config.rim_clearance))
    calibration: PlaneCalibration | None = None
    bus.ready("watching objects and hand, not calibrated yet")
    for heard in bus.events(topics.OBJECTS_TRACKED, topics.CALIBRATION_PLANE):
        if heard.topic.name == topics.CALIBRATION_PLANE.name:
            try:
                PlaneHomography.from_message(heard.message)
            except HomographyError as error:
                bus.degraded(f"calibration refused: {error}")
                continue
            calibration = heard.message
            bus.ready("watching objects and hand on the calibrated plane")
            continue
        for gesture in recognizer.update(heard.message, calibration):
            bus.publish(topics.GESTURES, gesture, heard.captured_ns)


if __name__ == "__main__":
    main(run, HEARS, SAYS, Config)
