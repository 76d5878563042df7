"""ROS 2: publishes the run there, and takes goals and stops from there; it arms nothing.

Subscribes  arm/joint_states, arm/joint_states/fast, arm/safety, camera images, gestures/scene, action/scene,
            relocation/status, every node's status; in all namespaces
Publishes   nothing itself: a stop and a goal from ROS are published as those of any program outside of the run
"""

from pydantic import Field

from paramove.bus import Bus, NodeConfig, Received, main, topics
from paramove.dashboard import subscribe_to_nodes
from paramove.ros2 import Ros2Bridge

ARM = (topics.ARM_JOINT_STATES, topics.ARM_JOINT_STATES_FAST, topics.ARM_SAFETY)
SEEN = (topics.CAMERA_IMAGE, *topics.CAMERA_IMAGES, topics.GESTURES_SCENE, topics.ACTION_SCENE)
SUBSCRIBES = (*ARM, *SEEN, topics.RELOCATION_STATUS)
PUBLISHES = ()


class Config(NodeConfig):
    """`domain_id`: of ROS; by default ROS_DOMAIN_ID of the terminal, else 0."""

    domain_id: int | None = Field(None, ge=0, le=232)


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes."""
    settings = bus.settings
    namespaces = settings.namespaces or ("",)
    with Ros2Bridge(settings.folder, namespaces, settings.clock == "simulated", config.domain_id) as bridge:
        bus.ready("is a node of ROS 2")
        for event in bus.events(tick=True):
            if isinstance(event, Received):
                bridge.handle(event)
            else:
                subscribe_to_nodes(bus)
                bridge.tick(event.now_ns)


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config, visitor=True, every_namespace=True)
