"""Turn taker: does tasks with the arms of several namespaces by the learned reaching, turn by turn, and ends.

Subscribes  NAMESPACE/relocation/status   RelocationStatus   event
            NAMESPACE/arm/safety          SafetyState        15 Hz, latched
Publishes   NAMESPACE/relocation/goal     RelocationGoal     event   arm_base
            NAMESPACE/speech              Speech             event
"""

from paramove.applications import ReachStep, Turns
from paramove.bus import Bus, NodeConfig, Tick, main, publish_each, topics

SUBSCRIBES = (topics.RELOCATION_STATUS, topics.ARM_SAFETY)
PUBLISHES = (topics.RELOCATION_GOAL, topics.SPEECH)


class Config(NodeConfig):
    """`turns`: of each turn, namespace of an arm -> what it does; see `ReachStep`."""

    turns: tuple[dict[str, ReachStep], ...]


def run(bus: Bus, config: Config) -> None:
    """Loop until all turns are done, a task cannot be done, or the bus closes."""
    turns = Turns(config.turns, f"turns-{bus.now_ns}")
    bus.settings.check_namespaces(turns.arms)
    published = {arm: [topics.topic_in(arm, topic) for topic in PUBLISHES] for arm in turns.arms}
    bus.ready(turns.detail)
    for event in bus.events(tick=True):
        if not isinstance(event, Tick):
            arm, _ = topics.split_name(event.topic.name)
            handle = turns.on_safety if event.topic.type is topics.ARM_SAFETY.type else turns.on_goal_status
            handle(arm, event.message)
            continue
        for arm, output in turns.tick(event.now_ns).items():
            publish_each(bus, published[arm], (output.goals, output.speech))
        if turns.failure:
            bus.failed(turns.failure)
        if turns.finished or turns.failure:
            return
        bus.ready(turns.detail)


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config, every_namespace=True)
