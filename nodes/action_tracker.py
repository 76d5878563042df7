"""Action tracker: follows a person's right arm in the images of calibrated cameras, and where it points.

Subscribes  camera_1/image, camera_2/image,
            camera_3/image, camera_4/image    foxglove.CompressedImage    15 Hz   camera_1 … camera_4
Publishes   action/estimate                   ActionEstimate              15 Hz   table, or that of `table_place`
            human/arm_pose                    ArmPose                     15 Hz   table
            action/outline                    foxglove.ImageAnnotations   15 Hz   camera_1
            action/scene                      foxglove.SceneUpdate        15 Hz   table, or that of `table_place`
"""

from paramove.action_space import TrackingSetup, arm_pose_message, estimate_message, outline_message, scene_message
from paramove.bus import Bus, NodeConfig, Tick, main, topics
from paramove.cameras import FrameError, decode

SUBSCRIBES = topics.CAMERA_IMAGES
PUBLISHES = (topics.ACTION_ESTIMATE, topics.HUMAN_ARM_POSE, topics.ACTION_OUTLINE, topics.ACTION_SCENE)


class Config(NodeConfig, TrackingSetup):
    """See `TrackingSetup`."""

    old_names = (("least_log_likelihood", "min_log_likelihood"),)


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes. An image that cannot be used is skipped and reported."""
    tracker = config.video_tracker(bus.run_folder)
    names, place = tracker.parameter_names, config.table_place
    detail = f"tracking {', '.join(names)} with {', '.join(tracker.cameras)}"
    bus.ready(detail)
    reported = tracker.problem_kind
    for event in bus.events(*SUBSCRIBES, tick=True):
        if isinstance(event, Tick):
            tracker.tick(event.now_ns)
        elif (camera := event.topic.name.removesuffix("/image")) in tracker.cameras:
            try:
                for estimate in tracker.see(camera, event.captured_ns, decode(event.message)):
                    at = estimate.captured_ns
                    bus.publish(topics.ACTION_ESTIMATE, estimate_message(estimate, names, config.particles, place), at)
                    bus.publish(topics.HUMAN_ARM_POSE, arm_pose_message(estimate), at)
                    bus.publish(topics.ACTION_OUTLINE, outline_message(estimate), at)
                    bus.publish(topics.ACTION_SCENE, scene_message(estimate, place), at)
            except FrameError as error:
                tracker.add_unreadable(camera, event.captured_ns, str(error))
        trouble = tracker.trouble()
        if tracker.problem_kind != reported:
            reported = tracker.problem_kind
            bus.degraded(trouble) if trouble else bus.ready(detail)


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
