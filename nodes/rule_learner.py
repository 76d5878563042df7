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

from paramove.applications import RuleLearner, RuleLearnerOptions
from paramove.bus import Bus, NodeConfig, Tick, main, publish_each, topics

SUBSCRIBES = (topics.GESTURES, topics.RELOCATION_STATUS, topics.ARM_SAFETY)
PUBLISHES = (topics.RELOCATION_GOAL, topics.CALIBRATION_PLANE, topics.RULES, topics.APPLICATION_STAGE, topics.SPEECH)


class Config(NodeConfig, RuleLearnerOptions):
    """See `RuleLearnerOptions`."""


def run(bus: Bus, config: Config) -> None:
    """Loop until all objects are put away, the arm is not armed any more, or the bus closes."""
    learner = RuleLearner(config, f"goal-{bus.now_ns}", bus.settings.begun_ns)
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
