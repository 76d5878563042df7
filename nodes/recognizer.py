"""Recognizer: tells what happens on the table, from tracked objects, and where a tracked arm points.

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
    RecognizerOptions,
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
    recognizer = Recognizer(RecognizerOptions(config.motion, config.pointing))
    pointing = config.pointing_source(bus.run_folder)
    calibration: PlaneCalibration | None = None
    bus.ready("watching objects and hand, not calibrated yet")
    for heard in bus.events(*SUBSCRIBES):
        for topic, message in pointing.handle(heard.topic, heard.message):
            bus.publish(topic, message, heard.captured_ns)
        if heard.topic.name in (topics.ACTION_ESTIMATE.name, topics.HUMAN_ARM_POSE.name):
            continue
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
    main(run, SUBSCRIBES, PUBLISHES, Config)
