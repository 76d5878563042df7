"""Reacher: does a list of tasks with a servo arm by the learned reaching, one after the other, and ends.

Subscribes  arm/joint_states        foxglove.JointStates    15 Hz   rad
            arm/safety              SafetyState             15 Hz, latched
            arm/trajectory_status   TrajectoryStatus        event
Publishes   arm/trajectory          JointTrajectory         event   rad
            speech                  Speech                  event
"""

from pathlib import Path

from paramove.applications import ReachStep, ReachTask
from paramove.bus import Bus, NodeConfig, Tick, main, publish_each, topics
from paramove.motion import MovementSource, ServoArmReaching
from paramove.robots import RobotDescription

SUBSCRIBES = (topics.ARM_JOINT_STATES, topics.ARM_SAFETY, topics.ARM_TRAJECTORY_STATUS)
PUBLISHES = (topics.ARM_TRAJECTORY, topics.SPEECH)


class Config(NodeConfig):
    """`robot`: folder of the arm's description. `tasks`: see `ReachStep`. `movement`: as of the synthesizer."""

    robot: Path
    tasks: tuple[ReachStep, ...]
    movement: MovementSource = MovementSource()


def run(bus: Bus, config: Config) -> None:
    """Loop until all tasks are done, one cannot be done, or the bus closes."""
    bus.starting("training or reading the reaching movement, and planning the tasks")
    reaching = ServoArmReaching(RobotDescription.load(config.robot), config.movement.trained())
    task = ReachTask(reaching, config.tasks, f"reach-{bus.now_ns}")
    handle = (task.on_joint_states, task.on_safety, task.on_trajectory_status)
    bus.ready(task.detail)
    for event in bus.events(*SUBSCRIBES, tick=True):
        if not isinstance(event, Tick):
            handle[SUBSCRIBES.index(event.topic)](event.message)
            continue
        output = task.tick(event.now_ns)
        publish_each(bus, PUBLISHES, (output.trajectories, output.speech))
        if task.failure:
            bus.failed(task.failure)
        if task.finished or task.failure:
            return
        bus.ready(task.detail)


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
