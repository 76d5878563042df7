"""Servo arm driver: plays trajectories on an arm of Dynamixel servos through the safety gate, and reports its status.

Subscribes  arm/trajectory          JointTrajectory        events
            operator/arm, operator/arm_at_start, operator/arm_away  ArmRequest   events, latched
            operator/stop, operator/estop, operator/stop_away       StopRequest  events, latched
            hosts/link              LinkState              100 Hz, while other hosts reply
Publishes   arm/joint_states        foxglove.JointStates   15 Hz   rad
            arm/joint_states/fast   foxglove.JointStates   100 Hz  rad
            arm/trajectory_status   TrajectoryStatus       events
            arm/safety              SafetyState            15 Hz, latched
            arm/motors              MotorStatus            1 Hz
"""

from paramove.bus import TICK_PERIOD_NS, Bus, NodeConfig, Tick, main, topics
from paramove.robots import RobotFolder, ThisLaunch
from paramove.robots.dynamixel import DrivenArm, ServoArmSetup, pacing_socket, prefer_the_loop
from paramove.robots.streaming import command_handlers

SUBSCRIBES = (topics.ARM_TRAJECTORY, *topics.ARMINGS, *topics.STOPS, topics.HOSTS_LINK)
JOINTS = (topics.ARM_JOINT_STATES, topics.ARM_JOINT_STATES_FAST)
PUBLISHES = (*JOINTS, topics.ARM_TRAJECTORY_STATUS, topics.ARM_SAFETY, topics.ARM_MOTORS)


class Config(NodeConfig, ServoArmSetup):
    """See `ServoArmSetup`."""

    robot: RobotFolder


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes; the arm then comes to rest."""
    launch = ThisLaunch.of(bus.settings)
    paced_by = pacing_socket(bus.settings.folder, bus.settings.namespace) if bus.settings.lockstep else None
    with config.driven_arm(bus.run_folder, launch, paced_by, checks_in_slices=paced_by is None) as arm:
        prefer_the_loop()
        bus.when_readable(arm.readable, lambda: publish_all(bus, arm))
        bus.when_idle(arm.check_on)
        bus.ready(arm.detail)
        handle = command_handlers(arm)
        for event in bus.events(*SUBSCRIBES, tick=True):
            if isinstance(event, Tick):
                arm.run_to(event.now_ns + TICK_PERIOD_NS)
                publish_all(bus, arm)
            else:
                handle[event.topic](event)
            bus.degraded(arm.trouble) if arm.trouble else bus.ready(arm.detail)


def publish_all(bus: Bus, arm: DrivenArm) -> None:
    """Publish all pending messages of the arm's loop."""
    for topic, message, captured_ns in arm.said():
        bus.publish(topic, message, captured_ns)


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
