"""Shared table: replaces the servos of several arms, each behind a serial port, in one simulated world that they move.

Publishes   truth/NAMESPACE/state   TruthState   15 Hz   the base of that namespace's arm; only for evaluators

The world is written into the run folder: `table.mjb`.
"""

from pathlib import Path

from pydantic import Field

from paramove.bus import Bus, NodeConfig, Tick, main, topics
from paramove.workspace import Workspace
from sim.table_arms import MountedArm, TableArms

SUBSCRIBES = ()
PUBLISHES = (topics.TRUTH_STATE,)

REPORT_TICKS = 75
MODEL_FILE = "table.mjb"


class Config(NodeConfig):
    """`scene`: file of the workspace with the table and the things on it. `arms`: by namespace; the first one's servos
    run in real time, and those of the others with them. `port`: path of the link to an arm's port, in the folder of its
    namespace.
    """

    scene: Path
    arms: dict[str, MountedArm] = Field(min_length=1)
    port: Path = Path("by-id/usb-paramove_emulated_servos-if00-port0")
    seed: int = Field(default=0, ge=0)


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes, then remove the ports. Servos run in real time, independent of the bus clock."""
    bus.settings.check_namespaces(config.arms)
    scene = Workspace.here().find(config.scene)
    with TableArms(scene, config.arms, bus.run_folder, config.port, config.seed) as table:
        table.write_model(bus.run_folder / MODEL_FILE)
        bus.ready(table.detail)
        for event in bus.events(tick=True):
            if isinstance(event, Tick):
                table.check()
                for namespace, state in table.truths(event.now_ns):
                    bus.publish(topics.topic_in(namespace, topics.TRUTH_STATE), state)
                if event.number % REPORT_TICKS == 0:
                    bus.ready(table.detail)


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config, every_namespace=True)
