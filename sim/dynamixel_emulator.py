"""Dynamixel emulator: replaces the servos of an arm, behind a serial port, in a simulated world that they move.

Publishes   truth/state   TruthState   15 Hz   world; only for evaluators
"""

from pathlib import Path

from pydantic import Field

from paramove.bus import Bus, NodeConfig, Tick, main, topics
from paramove.motion import check_grip, check_model
from paramove.robots import RobotDescription, RobotFolder
from sim.emulated_arm import EmulatedArm

SUBSCRIBES = ()
PUBLISHES = (topics.TRUTH_STATE,)

REPORT_TICKS = 75


class Config(NodeConfig):
    """`port`: path of the link to the port; `control`: path of the control socket for faults, '' for none. Both are
    absolute or relative to the run folder.

    `scene`: a file next to the robot's model; `posture_deg`: initial joint angles, others are in the base pose;
    `held`: whether torque is on from the start; `servo_rules_only`: whether to report only packets that the servos
    themselves reject, not goals that jump.
    """

    robot: RobotFolder = Path("robot_description/koch_v1_1")
    scene: Path = Path("scene.xml")
    port: Path = Path("by-id/usb-paramove_emulated_servos-if00-port0")
    control: str = ""
    posture_deg: dict[str, float] = Field(default_factory=dict)
    seed: int = Field(default=0, ge=0)
    held: bool = True
    servo_rules_only: bool = False


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes, then remove the port. Servos run in real time, independent of the bus clock."""
    robot = RobotDescription.load(config.robot)
    check_model(robot)
    check_grip(robot, robot.model_path.parent / config.scene)
    control = bus.run_folder / config.control if config.control else None
    link = bus.run_folder / config.port
    with EmulatedArm(
        robot, config.scene, link, control, config.posture_deg, config.seed, config.held, config.servo_rules_only
    ) as arm:
        bus.ready(arm.detail)
        for event in bus.events(tick=True):
            if isinstance(event, Tick):
                arm.emulator.check()
                bus.publish(topics.TRUTH_STATE, arm.truth(event.now_ns))
                if event.number % REPORT_TICKS == 0:
                    bus.ready(arm.detail)


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
