"""Recognizer: recognises events on the table, from tracked objects, and where a tracked arm points.

Subscribes  objects/tracked     TrackedObjects     15 Hz   image plane, pixels
            calibration/plane   PlaneCalibration   event   right_shoulder
            action/estimate     ActionEstimate     15 Hz   table
            human/arm_pose      ArmPose            event   table
Publishes   gestures            Gesture            event   pixels, and metres once calibrated
            gestures/scene      SceneUpdate        15 Hz   table; the ball where arm poses point
"""

from paramove.bus import Bus, NodeConfig, main, topics
from paramove.msgs.plane_calibration_pb2 import PlaneCalibration
from paramove.objects import (
    HomographyError,
    MotionThresholds,
    PlaneHomography,
    PointingThresholds,
    Recognizer,
)
from paramove.pointing import PointingSetup

SUBSCRIBES = (topics.OBJECTS_TRACKED, topics.CALIBRATION_PLANE, topics.ACTION_ESTIMATE, topics.HUMAN_ARM_POSE)
PUBLISHES = (topics.GESTURES, topics.GESTURES_SCENE)


class Config(NodeConfig, PointingSetup):
    old_names = (("motion.patience_s", "motion.timeout_s"), *PointingSetup.old_names)

    motion: MotionThresholds = MotionThresholds()
    pointing: PointingThresholds = PointingThresholds()


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes."""
    recognizer = Recognizer(config.motion, config.pointing)
    pointing = config.pointing_source(bus.run_folder)
    calibration: PlaneCalibration | None = None
    bus.ready("watching objects and hand, not calibrated yet")
    for received in bus.events(*SUBSCRIBES):
        for topic, message in pointing.handle(received.topic, received.message):
            bus.publish(topic, message, received.captured_ns)
        if received.topic.name in (topics.ACTION_ESTIMATE.name, topics.HUMAN_ARM_POSE.name):
            continue
        if received.topic.name == topics.CALIBRATION_PLANE.name:
            try:
                PlaneHomography.from_message(received.message)
            except HomographyError as error:
                bus.degraded(f"calibration rejected: {error}")
                continue
            calibration = received.message
            bus.ready("watching objects and hand on the calibrated plane")
            continue
        for gesture in recognizer.update(received.message, calibration):
            bus.publish(topics.GESTURES, gesture, received.captured_ns)


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
