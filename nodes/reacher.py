"""Reacher: does a list of tasks with a servo arm by the learned reaching, one after the other, and ends.

Subscribes  relocation/status   RelocationStatus   event
            arm/safety          SafetyState        15 Hz, latched
Publishes   relocation/goal     RelocationGoal     event   arm_base
            speech              Speech             event
"""

from typing import Any

from pydantic import model_validator

from paramove.applications import ReachStep, ReachTask
from paramove.bus import Bus, NodeConfig, Tick, main, publish_each, topics

SUBSCRIBES = (topics.RELOCATION_STATUS, topics.ARM_SAFETY)
PUBLISHES = (topics.RELOCATION_GOAL, topics.SPEECH)


class Config(NodeConfig):
    """`tasks`: see `ReachStep`."""

    tasks: tuple[ReachStep, ...]

    @model_validator(mode="before")
    @classmethod
    def _moved(cls, given: Any) -> Any:
        moved = sorted({"robot", "movement"} & set(given)) if isinstance(given, dict) else []
        if moved:
            raise ValueError(f"found {' and '.join(moved)}, which are parameters of synthesizer: it plans the motions")
        return given


def run(bus: Bus, config: Config) -> None:
    """Loop until all tasks are done, one cannot be done, or the bus closes."""
    task = ReachTask(config.tasks, f"reach-{bus.now_ns}")
    handle = (task.on_goal_status, task.on_safety)
    bus.ready(task.detail)
    for event in bus.events(*SUBSCRIBES, tick=True):
        if not isinstance(event, Tick):
            handle[SUBSCRIBES.index(event.topic)](event.message)
            continue
        output = task.tick(event.now_ns)
        publish_each(bus, PUBLISHES, (output.goals, output.speech))
        if task.failure:
            bus.failed(task.failure)
        if task.finished or task.failure:
            return
        bus.ready(task.detail)


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
