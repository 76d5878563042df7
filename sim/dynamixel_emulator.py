"""Dynamixel emulator: stands where the servos of an arm stand, behind a serial port, in a world that they move.

Publishes   truth/state   TruthState   15 Hz   world; only for evaluators
"""

from pathlib import Path

from pydantic import Field

from paramove.bus import Bus, NodeConfig, Tick, main, topics
from paramove.robots import RobotDescription
from sim.emulated_arm import EmulatedArm

SUBSCRIBES = ()
PUBLISHES = (topics.TRUTH_STATE,)

REPORT_TICKS = 75


class Config(NodeConfig):
    """`port`: a link to the port, `control`: a socket for faults, '' for none; both in the run folder or absolute.

    `scene`: a file by the robot's model; `posture_deg`: angles of joints at the start, others are in the base pose;
    `held`: whether the servos hold from the start; `servo_rules_only`: whether only what servos themselves reject is
    counted, not goals that jump.
    """

    robot: Path = Path("robot_description/koch_v1_1")
    scene: Path = Path("scene.xml")
    port: Path = Path("by-id/usb-paramove_emulated_servos-if00-port0")
    control: str = ""
    posture_deg: dict[str, float] = Field(default_factory=dict)
    seed: int = Field(default=0, ge=0)
    held: bool = True
    servo_rules_only: bool = False


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes; then the port is gone. Servos run in real time, whatever the clock of the others."""
    robot = RobotDescription.load(config.robot)
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
