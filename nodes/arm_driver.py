"""Arm driver: plays trajectories on HOAP-3 through the safety gate, and reports its joints.

Subscribes  arm/trajectory         JointTrajectory        events
            operator/arm, operator/arm_at_start, operator/arm_away  ArmRequest   events, latched
            operator/stop, operator/estop, operator/stop_away       StopRequest  events, latched
            hosts/link             LinkState              100 Hz, while other hosts reply
            wire/hoap3/state       Hoap3State             15 Hz   joint units
Publishes   wire/hoap3/stream      StreamBatch            15 Hz while moving, joint units
            arm/joint_states       foxglove.JointStates   15 Hz   rad
            arm/trajectory_status  TrajectoryStatus       events
            arm/safety             SafetyState            15 Hz, latched
"""

from pathlib import Path

from paramove.bus import Bus, NodeConfig, Tick, main, topics
from paramove.robots import RobotDescription, RobotFolder, ThisLaunch
from paramove.robots.hoap3 import batch_message, state_of
from paramove.robots.streaming import ArmDriver, command_handlers

SUBSCRIBES = (topics.ARM_TRAJECTORY, *topics.ARMINGS, *topics.STOPS, topics.HOSTS_LINK, topics.WIRE_HOAP3_STATE)
PUBLISHES = (topics.WIRE_HOAP3_STREAM, topics.ARM_JOINT_STATES, topics.ARM_TRAJECTORY_STATUS, topics.ARM_SAFETY)


class Config(NodeConfig):
    """`robot`: folder of the robot's description; `link_timeout_s`: see `ArmDriver`."""

    robot: RobotFolder = Path("robot_description/hoap3")
    link_timeout_s: float | None = None


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes; the robot then comes to rest by the stop ramp that it already has."""
    launch = ThisLaunch.of(bus.settings)
    robot, no_program = RobotDescription.load(config.robot), lambda: launch.why_no_program(bus.settings)
    timeout_s, in_slices = config.link_timeout_s, not bus.settings.lockstep
    driver = ArmDriver(robot, no_program=no_program, link_timeout_s=timeout_s, checks_in_slices=in_slices)
    bus.when_idle(driver.check_on)
    handle = command_handlers(driver)
    handle[topics.WIRE_HOAP3_STATE] = lambda it: driver.on_robot_state(state_of(it.message), it.captured_ns)
    bus.ready(driver.detail)
    for event in bus.events(*SUBSCRIBES, tick=True):
        if not isinstance(event, Tick):
            handle[event.topic](event)
            if event.topic not in topics.STOPS:
                continue  # a stop does not wait for the next period
        output = driver.tick(bus.now_ns)
        if output.stream is not None:
            bus.publish(topics.WIRE_HOAP3_STREAM, batch_message(output.stream))
        if output.joint_states is not None:
            bus.publish(topics.ARM_JOINT_STATES, output.joint_states, output.joint_states.timestamp.ToNanoseconds())
        for status in output.statuses:
            bus.publish(topics.ARM_TRAJECTORY_STATUS, status)
        bus.publish(topics.ARM_SAFETY, output.safety)
        bus.ready(driver.detail)


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
