"""Body tracker: finds the marked points of a person's right arm in space, in the images of calibrated cameras.

Subscribes  camera_1/image, camera_2/image,
            camera_3/image, camera_4/image    foxglove.CompressedImage    15 Hz   camera_1 … camera_4
Publishes   human/arm_pose                    ArmPose                     15 Hz   table
            action/outline                    foxglove.ImageAnnotations   15 Hz   camera_1
            action/scene                      foxglove.SceneUpdate        15 Hz   table
"""

from paramove.bus import Bus, NodeConfig, Tick, main, topics
from paramove.cameras import FrameError, decode
from paramove.observation import BodyTrackingSetup, body_messages

SUBSCRIBES = topics.CAMERA_IMAGES
PUBLISHES = (topics.HUMAN_ARM_POSE, topics.ACTION_OUTLINE, topics.ACTION_SCENE)


class Config(NodeConfig, BodyTrackingSetup):
    """See `BodyTrackingSetup`."""

    old_names = (("most_residual_px", "max_residual_px"),)


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes. An image that cannot be used is skipped and reported."""
    tracking = config.body_tracking(bus.run_folder)
    first = tracking.cameras["camera_1"]
    detail = f"looking for {', '.join(tracking.point_names)} with {', '.join(tracking.cameras)}"
    bus.ready(detail)
    reported = ""
    for event in bus.events(*SUBSCRIBES, tick=True):
        if isinstance(event, Tick):
            tracking.watch.tick(event.now_ns)
        elif (camera := event.topic.name.removesuffix("/image")) in tracking.cameras:
            try:
                for pose in tracking.see(camera, event.captured_ns, decode(event.message)):
                    for topic, message in zip(PUBLISHES, body_messages(pose, first), strict=True):
                        bus.publish(topic, message, pose.captured_ns)
            except FrameError as error:
                tracking.watch.reject(camera, event.captured_ns, str(error))
        if (trouble := tracking.trouble()) != reported:
            reported = trouble
            bus.degraded(trouble) if trouble else bus.ready(detail)


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
