"""Action tracker: follows a person's right arm in the images of calibrated cameras, and where it points.

Subscribes  camera_1/image, camera_2/image,
            camera_3/image, camera_4/image    foxglove.CompressedImage    15 Hz   camera_1 … camera_4
            camera_1/key_points, camera_2/key_points, camera_3/key_points, camera_4/key_points   BodyKeyPoints   15 Hz
Publishes   action/estimate                   ActionEstimate              15 Hz   table, or that of `table_place`
            human/arm_pose                    ArmPose                     15 Hz   table
            action/outline                    foxglove.ImageAnnotations   15 Hz   camera_1
            action/scene                      foxglove.SceneUpdate        15 Hz   table, or that of `table_place`
"""

from collections.abc import Iterable

from paramove.action_space import TrackedState, TrackingSetup, messages_of
from paramove.bus import Bus, NodeConfig, Tick, main, topics
from paramove.cameras import FrameError, decode
from paramove.observation import key_points_from

SUBSCRIBES = (*topics.CAMERA_IMAGES, *topics.CAMERA_KEY_POINTS)
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
        states: Iterable[TrackedState] = ()
        if isinstance(event, Tick):
            states = tracker.tick(event.now_ns)
        elif (camera := event.topic.name.partition("/")[0]) in tracker.cameras:
            try:
                if event.topic in topics.CAMERA_KEY_POINTS:
                    states = tracker.see_key_points(camera, event.captured_ns, key_points_from(event.message))
                else:
                    states = tracker.see(camera, event.captured_ns, decode(event.message))
            except FrameError as error:
                tracker.watch.reject(camera, event.captured_ns, str(error))
        for state in states:
            for topic, message in zip(PUBLISHES, messages_of(state, names, config.particles, place), strict=True):
                bus.publish(topic, message, state.captured_ns)
        trouble = tracker.trouble()
        if tracker.problem_kind != reported:
            reported = tracker.problem_kind
            bus.degraded(trouble) if trouble else bus.ready(detail)


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
