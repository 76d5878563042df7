"""Relocator: holds an object, puts it where a person points, fetches it again and waits for the next place.

Subscribes  gestures             Gesture            event    right_shoulder
            action/estimate      ActionEstimate     15 Hz    right_shoulder
            relocation/status    RelocationStatus   event
            arm/safety           SafetyState        15 Hz, latched
Publishes   relocation/goal      RelocationGoal     event    right_shoulder
            application/stage    ApplicationStage   1 Hz
            speech               Speech             event
"""

from paramove.applications import Relocator, RelocatorOptions
from paramove.bus import Bus, NodeConfig, Tick, main, publish_each, topics

SUBSCRIBES = (topics.GESTURES, topics.ACTION_ESTIMATE, topics.RELOCATION_STATUS, topics.ARM_SAFETY)
PUBLISHES = (topics.RELOCATION_GOAL, topics.APPLICATION_STAGE, topics.SPEECH)


class Config(NodeConfig, RelocatorOptions):
    """See `RelocatorOptions`."""


def run(bus: Bus, config: Config) -> None:
    """Loop until the object was put at all places, the arm is not armed any more, or the bus closes."""
    relocator = Relocator(config, f"goal-{bus.now_ns}")
    handle = (relocator.on_gesture, relocator.on_estimate, relocator.on_goal_status, relocator.on_safety)
    bus.ready("waiting for the arm")
    for event in bus.events(*SUBSCRIBES, tick=True):
        if not isinstance(event, Tick):
            handle[SUBSCRIBES.index(event.topic)](event.message)
            continue
        output = relocator.tick(event.now_ns * 1e-9)
        publish_each(bus, PUBLISHES, (output.goals, output.stages, output.speech))
        if relocator.failure:
            bus.failed(relocator.failure)
        if relocator.finished or relocator.failure:
            return
        bus.ready(relocator.detail)


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
