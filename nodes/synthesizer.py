"""Synthesizer: turns relocation goals into trajectories of the learned reaching movement.

Subscribes  relocation/goal         RelocationGoal          event   right_shoulder
            arm/joint_states        foxglove.JointStates    15 Hz   rad
            arm/trajectory_status   TrajectoryStatus        event
Publishes   arm/trajectory          JointTrajectory         event   rad
            relocation/status       RelocationStatus        event
"""

from pathlib import Path

from paramove.bus import Bus, NodeConfig, Tick, main, topics
from paramove.motion import MovementSource, Synthesizer, plans_for
from paramove.robots import RobotFolder, SurfaceParameters

SUBSCRIBES = (topics.RELOCATION_GOAL, topics.ARM_JOINT_STATES, topics.ARM_TRAJECTORY_STATUS)
PUBLISHES = (topics.ARM_TRAJECTORY, topics.RELOCATION_STATUS)


class Config(NodeConfig):
    """`robot`: folder of the description. `movement`: a model file, or the demonstrations to train from."""

    robot: RobotFolder = Path("robot_description/hoap3")
    side: str = "right"
    movement: MovementSource = MovementSource()
    surface: SurfaceParameters = SurfaceParameters()


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes."""
    bus.starting("training or reading the reaching movement")
    synthesizer = Synthesizer(plans_for(config.robot, config.side, config.movement, config.surface))
    handle = {
        topics.RELOCATION_GOAL: synthesizer.on_goal,
        topics.ARM_JOINT_STATES: synthesizer.on_joint_states,
        topics.ARM_TRAJECTORY_STATUS: synthesizer.on_trajectory_status,
    }
    bus.ready(synthesizer.detail)
    for event in bus.events(*SUBSCRIBES, tick=True):
        if not isinstance(event, Tick):
            handle[event.topic](event.message)
            continue
        output = synthesizer.tick(event.now_ns)
        for trajectory in output.trajectories:
            bus.publish(topics.ARM_TRAJECTORY, trajectory)
        for status in output.statuses:
            bus.publish(topics.RELOCATION_STATUS, status)
        bus.ready(synthesizer.detail)


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
