"""Rule learner: calibrates the camera with the robot's own hand, watches the rules, and applies them.

Subscribes  gestures             Gesture            event    pixels, and metres once calibrated
            relocation/status    RelocationStatus   event
            arm/safety           SafetyState        15 Hz, latched
Publishes   relocation/goal      RelocationGoal     event    right_shoulder
            calibration/plane    PlaneCalibration   event    right_shoulder
            rules                Rules              event    right_shoulder
            application/stage    ApplicationStage   1 Hz
            speech               Speech             event
"""

from paramove.applications import Pointing, RuleLearner, RuleLearnerOptions, Surface
from paramove.bus import Bus, NodeConfig, Tick, main, publish_each, topics

SUBSCRIBES = (topics.GESTURES, topics.RELOCATION_STATUS, topics.ARM_SAFETY)
PUBLISHES = (topics.RELOCATION_GOAL, topics.CALIBRATION_PLANE, topics.RULES, topics.APPLICATION_STAGE, topics.SPEECH)


class Config(NodeConfig):
    """Positions in the right shoulder's frame, m; the rest: see `RuleLearnerOptions`."""

    old_names = (("arm_patience_s", "arming_timeout_s"),)

    objects: tuple[str, ...] = ("yellow", "green", "blue")
    corners: tuple[tuple[float, float], ...] = ((0.135, -0.10), (0.135, 0.076), (0.19, 0.076), (0.19, -0.10))
    offer: tuple[float, float, float] = (0.155, -0.02, -0.05)
    grasp_z: float = -0.098
    surface_x: tuple[float, float] = (0.100, 0.240)
    surface_y: tuple[float, float] = (-0.170, 0.130)
    ask_again_s: float = 25.0
    arming_timeout_s: float = 10.0
    pointing: Pointing = "nearness"


def run(bus: Bus, config: Config) -> None:
    """Loop until all objects are put away, the arm is not armed any more, or the bus closes."""
    positions = config.model_dump(exclude={"surface_x", "surface_y"})
    options = RuleLearnerOptions(**positions, surface=Surface(config.surface_x, config.surface_y))
    learner = RuleLearner(options, f"goal-{bus.now_ns}")
    handle = (learner.on_gesture, learner.on_goal_status, learner.on_safety)
    bus.ready("waiting for the arm")
    for event in bus.events(*SUBSCRIBES, tick=True):
        if not isinstance(event, Tick):
            handle[SUBSCRIBES.index(event.topic)](event.message)
            continue
        output = learner.tick(event.now_ns * 1e-9)
        publish_each(bus, PUBLISHES, (output.goals, output.calibrations, output.rules, output.stages, output.speech))
        if learner.failure:
            bus.failed(learner.failure)
        if learner.finished or learner.failure:
            return
        bus.ready(learner.detail)


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
